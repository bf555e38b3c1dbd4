// SPDX-License-Identifier: Apache-2.0
// The settings that `warmfront bench` compares, and whether they agree: see bench_run.h.
#include <algorithm>
#include <tuple>
#include <utility>

#include "client/cli/bench/run.h"

namespace warmfront::client {
namespace {

bool same(const ColliderOptions& a, const ColliderOptions& b) {
  const auto key = [](const ColliderOptions& o) {
    const bool lazy = o.front == FrontMode::kWarm && o.lazy_front;
    return std::tuple(o.tier, o.front, lazy, o.bounds, o.normal_cones, o.leaf_size, o.find_bodies,
                      o.find_rigid, o.separate_parts);
  };
  return key(a) == key(b);
}

}  // namespace

std::vector<BenchSetting> bench_settings(const ColliderOptions& base, std::span<const int> threads,
                                         const Ablations& ablations) {
  std::vector<BenchSetting> settings;
  for (const int count : threads) settings.push_back({"default", base, count});
  const auto add = [&](std::string name, auto&& change) {
    ColliderOptions options = base;
    change(options);
    if (!same(options, base) && validate(options).ok())
      settings.push_back({std::move(name), options, threads.front()});
  };
  if (ablations.front) {
    for (const FrontMode mode : {FrontMode::kNone, FrontMode::kPaper, FrontMode::kWarm}) {
      add("front " + std::string(to_string(mode)), [&](ColliderOptions& o) {
        o.front = mode;
        o.lazy_front = false;
      });
    }
    add("front warm, lazy", [](ColliderOptions& o) {
      o.front = FrontMode::kWarm;
      o.lazy_front = true;
    });
  }
  if (ablations.cones) {
    for (const bool on : {false, true})
      add(on ? "cones on" : "cones off", [&](ColliderOptions& o) { o.normal_cones = on; });
  }
  if (ablations.bounds) {
    for (const BoundsKind kind : {BoundsKind::kAabb, BoundsKind::kKDop18})
      add("bounds " + std::string(to_string(kind)), [&](ColliderOptions& o) { o.bounds = kind; });
  }
  if (ablations.found) {
    add("nothing found", [](ColliderOptions& o) { o.find_bodies = o.find_rigid = o.separate_parts = false; });
    add("parts not separated", [](ColliderOptions& o) { o.separate_parts = false; });
  }
  if (ablations.leaf) {
    for (const std::uint32_t size : {1U, 2U, 4U, 8U, 16U, 32U, 64U})
      add("leaf " + std::to_string(size), [&](ColliderOptions& o) { o.leaf_size = size; });
  }
  if (ablations.tier) {
    for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact})
      add("tier " + std::string(to_string(tier)), [&](ColliderOptions& o) { o.tier = tier; });
  }
  return settings;
}

std::optional<std::string> disagreement(std::span<const BenchRow> rows) {
  for (const BenchRow& row : rows) {
    const auto first = std::ranges::find(rows, row.setting.options.tier,
                                         [](const BenchRow& r) { return r.setting.options.tier; });
    if (first->hash == row.hash) continue;
    return "answers differ: \"" + first->setting.name + "\" on " + std::to_string(first->setting.threads) +
           " gives " + first->hash + ", \"" + row.setting.name + "\" on " +
           std::to_string(row.setting.threads) + " " + row.hash;
  }
  return std::nullopt;
}

}  // namespace warmfront::client
