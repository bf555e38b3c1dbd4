// SPDX-License-Identifier: Apache-2.0
// Mixes: see mix.h.
#include "client/cli/load/mix.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "client/io/text.h"

namespace warmfront::client::load {
namespace {

constexpr std::uint64_t kMostOfAKind = 1000;

using Counts = std::array<std::size_t, kAskedKinds>;

std::size_t& count_of(Counts& counts, Asked asked) {
  return counts[static_cast<std::size_t>(asked)];
}

Error malformed_item(std::string_view item, const std::string& why) {
  return invalid_argument(in_quotes(item) + ": " + why +
                          "; give NAME=COUNT, like trial=3,commit=1, where NAME " +
                          "is one of step, trial, commit, max_step, proximity, intersections");
}

// NAME=COUNT.
Result<std::pair<Asked, std::size_t>> parse_item(std::string_view item) {
  const std::size_t equals = item.find('=');
  const std::string_view name = item.substr(0, equals);
  const auto* found = std::ranges::find(kAskedNames, name);
  if (found == kAskedNames.end()) return malformed_item(item, "no question has that name");
  if (equals == std::string_view::npos) return malformed_item(item, "its count is missing");
  std::uint64_t count = 0;
  if (!parse_number(item.substr(equals + 1), count) || count < 1 || count > kMostOfAKind)
    return malformed_item(item, "COUNT is a whole number from 1 to " + std::to_string(kMostOfAKind));
  return std::pair{static_cast<Asked>(found - kAskedNames.begin()), std::size_t{count}};
}

// The i-th of `groups` even shares of `count`.
std::size_t share(std::size_t count, std::size_t groups, std::size_t i) {
  return count * (i + 1) / groups - count * i / groups;
}

std::vector<Asked> cycle_of(Counts counts) {
  const std::size_t trials = count_of(counts, Asked::kTrial), max_steps = count_of(counts, Asked::kMaxStep);
  const std::size_t commits = count_of(counts, Asked::kCommit), steps = count_of(counts, Asked::kStep);
  const std::size_t near = count_of(counts, Asked::kProximity);
  const std::size_t tangles = count_of(counts, Asked::kIntersections);
  const std::size_t groups = std::max<std::size_t>(1, commits > 0 ? commits : steps);
  // Evenly mixed; a max_step comes first, as solvers ask. Each commit gets at least one of them.
  std::vector<Asked> asks(max_steps + trials);
  for (std::size_t i = 0, m = 0, t = 0; i < asks.size(); ++i) {
    const bool max_step = m < max_steps && m * asks.size() <= i * max_steps;
    asks[i] = max_step || t == trials ? Asked::kMaxStep : Asked::kTrial;
    (asks[i] == Asked::kMaxStep ? m : t) += 1;
  }
  std::vector<Asked> cycle;
  auto ask = asks.cbegin();
  for (std::size_t g = 0; g < groups; ++g) {
    cycle.insert(cycle.end(), share(near, groups, g), Asked::kProximity);
    cycle.insert(cycle.end(), share(tangles, groups, g), Asked::kIntersections);
    const auto end = ask + static_cast<std::ptrdiff_t>(share(asks.size(), groups, g));
    cycle.insert(cycle.end(), ask, end);
    ask = end;
    if (commits > 0) cycle.push_back(Asked::kCommit);
    cycle.insert(cycle.end(), share(steps, groups, g), Asked::kStep);
  }
  return cycle;
}

}  // namespace

Result<Mix> parse_mix(std::span<const std::string> items) {
  Mix mix;
  Counts counts{};
  for (const std::string& item : items) {
    const auto parsed = parse_item(item);
    if (!parsed) return parsed.error();
    const auto [asked, count] = parsed.value();
    if (std::exchange(count_of(counts, asked), count) > 0) return malformed_item(item, "it is given twice");
    mix.text += (mix.text.empty() ? "" : ",") + item;
  }
  const std::size_t asks = count_of(counts, Asked::kTrial) + count_of(counts, Asked::kMaxStep);
  const std::size_t commits = count_of(counts, Asked::kCommit);
  if (commits > asks)
    return malformed_item(
        "commit=" + std::to_string(commits),
        "each commit takes a trial or max_step before it, of which there are " + std::to_string(asks));
  if (!items.empty()) mix.cycle = cycle_of(counts);
  return mix;
}

}  // namespace warmfront::client::load
