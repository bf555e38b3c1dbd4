// SPDX-License-Identifier: Apache-2.0
// Reading and comparing tokens. Thread safety as stated in the header.
#include "server/auth/tokens.h"

#include <algorithm>
#include <iterator>
#include <sstream>

#include "server/process/small_file.h"

namespace warmfront::server {
namespace {

constexpr std::size_t kShortestToken = 16;

/// Without a branch on what is compared.
bool equal(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  volatile unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

bool printable(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c > ' ' && c < '\x7f'; });
}

}  // namespace

Result<Tokens> Tokens::parse(std::string_view text) {
  Tokens tokens;
  std::istringstream lines{std::string(text)};
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    const std::vector<std::string> word{std::istream_iterator<std::string>(words), {}};
    if (word.empty() || word[0].starts_with('#')) continue;
    const std::string where = "line " + std::to_string(number) + ": ";
    if (word.size() < 2)
      return invalid_argument(where + "TOKEN PRINCIPAL, and perhaps admin and a quota, is expected");
    if (word[0].size() < kShortestToken || !printable(word[0]))
      return invalid_argument(where + "a token of at least " + std::to_string(kShortestToken) +
                              " printable characters is expected; 32 random ones are a good choice");
    if (!printable(word[1]))
      return invalid_argument(where + "a principal of printable characters is expected");
    if (tokens.find(word[0])) return invalid_argument(where + "the token stands in an earlier line already");
    const bool admin = word.size() > 2 && word[2] == "admin";
    const Result<PartialQuota> quota = parse_quota(std::span(word).subspan(admin ? 3 : 2));
    // Without the words themselves, one of which may be a token at the wrong place.
    if (!quota)
      return invalid_argument(
          where +
          "after the principal, admin or a quota is expected, e.g. sessions=8 bytes=4GiB; "
          "see --quotas");
    if (quota.value() != PartialQuota{}) {
      const auto [stands, is_new] = tokens.quotas_.emplace(word[1], quota.value());
      if (!is_new && stands->second != quota.value())
        return invalid_argument(where + "another quota of this principal stands in an earlier line");
    }
    tokens.entries_.push_back({word[0], {word[1], admin}});
  }
  if (tokens.entries_.empty()) return invalid_argument("it holds no token, so nobody could call");
  return tokens;
}

bool Tokens::name(std::string_view principal) const {
  return std::ranges::any_of(entries_, [&](const Entry& e) { return e.principal.name == principal; });
}

Result<Tokens> Tokens::read(const std::string& path) {
  const Result<std::string> text = read_small_file("token-file", path);
  if (!text) return text.error();
  Result<Tokens> tokens = parse(text.value());
  if (!tokens) return invalid_argument("token-file " + path + ": " + tokens.error().message);
  return tokens;
}

std::optional<Principal> Tokens::find(std::string_view token) const {
  const Entry* found = nullptr;
  for (const Entry& entry : entries_)
    if (equal(entry.token, token)) found = &entry;
  return found == nullptr ? std::nullopt : std::optional(found->principal);
}

}  // namespace warmfront::server
