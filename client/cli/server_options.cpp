// SPDX-License-Identifier: Apache-2.0
// Server options: see server_options.h.
#include "client/cli/server_options.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <string>

#include "client/lib/address.h"
#include "proto/wire/trace_context.h"

namespace warmfront::client {
void add_server_options(CLI::App& app, std::string& address, ClientOptions& connection,
                        const std::string& server_help, bool required) {
  CLI::Option* server = app.add_option("--server", address, server_help)->required(required);
  server->check([](const std::string& text) { return is_server_address(text) ? "" : kAddressExpected; });
  // As tools that trace commands pass a span on, otel-cli for example.
  server->each([&connection](const std::string&) {
    const char* given = std::getenv("TRACEPARENT");  // NOLINT(concurrency-mt-unsafe): nothing writes it
    if (given == nullptr || *given == '\0') return;
    if (!wire::TraceContext::parse(given))
      throw CLI::ValidationError("TRACEPARENT", std::string("the environment's '") + given + "': " +
                                                    wire::kTraceparentExpected + "; correct or unset it");
    connection.traceparent = given;
  });
  ClientSecurity& security = connection.security;
  const auto add_file = [&](const char* name, std::string& value, const char* help) {
    return app.add_option(name, value, help)->type_name("FILE")->needs(server);
  };
  app.add_flag("--tls", security.tls, "Encrypt, and trust this system's CAs")->needs(server);
  add_file("--tls-ca", security.ca_file, "Encrypt, and trust only the CAs in this file (PEM)");
  CLI::Option* cert = add_file("--tls-cert", security.cert_file, "This client's certificate (PEM)");
  CLI::Option* key = add_file("--tls-key", security.key_file, "The key of --tls-cert (PEM)");
  cert->needs(key);
  key->needs(cert);
  app.add_option("--tls-server-name", security.server_name,
                 "Name expected in the daemon's certificate, if not the address's host")
      ->type_name("NAME")
      ->needs(server);
  add_file("--token-file", security.token_file, "File with the token to send");
}

}  // namespace warmfront::client
