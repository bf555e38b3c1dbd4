// SPDX-License-Identifier: Apache-2.0
// Reading credentials. Thread safety as stated in the header.
#include "client/lib/security.h"

#include <array>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>

namespace warmfront::client {
namespace {

constexpr const char* kCertificate = "CERTIFICATE";
constexpr const char* kPrivateKey = "PRIVATE KEY";

/// The file's content; empty for no file.
Result<std::string> read(const char* what, const std::string& path) {
  if (path.empty()) return std::string();
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf()))
    return invalid_argument(std::string(what) + " " + path + ": cannot be read, or is empty");
  return text.str();
}

/// Has the text a PEM block of what ends in these words?
bool has_pem(std::string_view text, std::string_view what) {
  constexpr std::string_view kBegin = "-----BEGIN ";
  const std::string end = std::string(what) + "-----";
  for (std::size_t at = 0; (at = text.find(kBegin, at)) != text.npos; at += kBegin.size()) {
    const std::string_view line = text.substr(at, text.find_first_of("\r\n", at) - at);
    if (line.find(end) != line.npos) return true;
  }
  return false;
}

/// The same of a file that is to hold one of these.
Result<std::string> read_pem(const char* what, const std::string& path, const char* holds) {
  Result<std::string> text = read(what, path);
  if (text && !path.empty() && !has_pem(text.value(), holds))
    return invalid_argument(std::string(what) + " " + path + ": has no " + holds + " in PEM format");
  return text;
}

/// Without the blanks and line ends around it.
std::string trimmed(const std::string& text) {
  constexpr const char* kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(kBlank) + 1 - first);
}

bool stays_here(const std::string& address) {
  return address.starts_with("unix:") || address.starts_with("localhost:") || address.starts_with("[::1]:") ||
         address.starts_with("127.");
}

}  // namespace

Result<Credentials> read_credentials(const std::string& address, const ClientSecurity& security) {
  if (security.cert_file.empty() != security.key_file.empty())
    return invalid_argument("a client certificate needs its key, and a key its certificate: give both files");
  const Result<std::string> ca = read_pem("CA file", security.ca_file, kCertificate);
  if (!ca) return ca.error();
  const Result<std::string> certificate = read_pem("certificate file", security.cert_file, kCertificate);
  if (!certificate) return certificate.error();
  const Result<std::string> key = read_pem("key file", security.key_file, kPrivateKey);
  if (!key) return key.error();
  const Result<std::string> token = read("token file", security.token_file);
  if (!token) return token.error();

  const bool tls = security.tls || !ca.value().empty() || !certificate.value().empty();
  Credentials credentials;
  credentials.server_name = security.server_name;
  credentials.encrypted = tls;
  credentials.channel = tls ? grpc::SslCredentials({ca.value(), key.value(), certificate.value()})
                            : grpc::InsecureChannelCredentials();
  if (security.token_file.empty()) return credentials;
  const std::string secret = trimmed(token.value());
  if (secret.find_first_of(" \t\r\n") != std::string::npos)
    return invalid_argument("token file " + security.token_file + ": exactly one token is expected");
  if (!tls && !stays_here(address))
    return invalid_argument("the token would travel to " + address + " unencrypted; use TLS");
  credentials.authorization = "Bearer " + secret;
  return credentials;
}

std::string what_to_try(std::string_view why, bool encrypted) {
  if (!encrypted) {  // a daemon with TLS takes such a connection, and closes it
    const bool closed = why.ends_with("Socket closed") || why.ends_with("Connection reset by peer");
    return closed ? "does it want TLS? Then give its CA (security.ca_file, --tls-ca)"
                  : "is it running there?";
  }
  constexpr std::array<std::pair<std::string_view, const char*>, 3> kHints{
      {{"certificate verify failed",
        "is that the CA that signed its certificate (security.ca_file, --tls-ca)?"},
       {"is not in peer certificate",
        "give a name that its certificate has (security.server_name, --tls-server-name)"},
       {"wrong version number", "does it speak TLS? Leave the CA out where it does not"}}};
  for (const auto& [said, hint] : kHints)
    if (why.find(said) != std::string_view::npos) return hint;
  return "is it running there?";
}

}  // namespace warmfront::client
