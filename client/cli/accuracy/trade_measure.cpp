// SPDX-License-Identifier: Apache-2.0
// Measuring the trade: see trade.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <tuple>
#include <utility>

#include "client/cli/accuracy/trade.h"
#include "engine/collider.h"

namespace warmfront::client {
namespace {

float nearest_float(double x) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(x, -kMost, kMost));
}

std::vector<TypedQuery> in_float32(std::span<const TypedQuery> queries) {
  std::vector<TypedQuery> rounded(queries.begin(), queries.end());
  for (TypedQuery& query : rounded) {
    for (VertexMotion& vertex : query.query.vertices) {
      for (auto* position : {&vertex.t0, &vertex.t1}) {
        for (double& x : *position) x = nearest_float(x);
      }
    }
  }
  return rounded;
}

bool same_but_for_bounds(const TradeSetting& a, const TradeSetting& b) {
  return std::tie(a.tier, a.tolerance, a.positions) == std::tie(b.tier, b.tolerance, b.positions);
}

double separation_of(std::span<const TradeSetting> settings) {
  return settings.empty() ? 0 : settings.front().separation;
}

/// The positions of all frames, so that reading them is not measured.
struct Frames {
  std::vector<std::vector<double>> exact;
  std::vector<std::vector<double>> rounded;  ///< to float32; empty when the input is float32

  std::span<const double> at(std::size_t frame, PositionType type) const {
    return type == PositionType::kFloat32 && !rounded.empty() ? rounded[frame] : exact[frame];
  }
};

Result<Frames> read_frames(Input& input, FrameRange range, std::uint32_t substeps) {
  Result<FrameSteps> steps = FrameSteps::open(input, range, substeps);
  if (!steps) return steps.error();
  Frames frames;
  bool is_float32 = true;
  const auto take = [&](const Positions& positions) {
    is_float32 = is_float32 && positions.index() == 0;
    frames.exact.push_back(
        std::visit([](const auto& x) { return std::vector<double>(x.begin(), x.end()); }, positions));
  };
  take(steps.value().end());
  for (std::uint64_t k = steps.value().step_count(); k > 0; --k) {
    if (Status status = steps.value().next(); !status) return status.error();
    take(steps.value().end());
  }
  if (!is_float32) {
    frames.rounded = frames.exact;
    for (auto& frame : frames.rounded) std::ranges::transform(frame, frame.begin(), nearest_float);
  }
  return frames;
}

using StepContacts = std::vector<std::vector<Contact>>;

struct SceneRun {
  StepContacts contacts;
  double ms_frame = 0;
  double elementary_ms = 0;  ///< of all frames
  std::uint64_t elementary_tests = 0;
};

Result<SceneRun> step_through(const std::shared_ptr<const Scene>& scene, const Frames& frames,
                              const TradeSetting& setting, const std::shared_ptr<Workers>& workers) {
  const ColliderOptions options{.tier = setting.tier,
                                .tolerance = setting.tolerance,
                                .min_separation = setting.separation,
                                .bounds = setting.bounds};
  Result<Collider> collider = Collider::create(scene, frames.at(0, setting.positions), options, workers);
  if (!collider) return collider.error();
  SceneRun run;
  for (std::size_t k = 1; k < frames.exact.size(); ++k) {
    const Result<StepResult> step = collider.value().step(frames.at(k, setting.positions));
    if (!step) return step.error();
    run.contacts.emplace_back(step.value().contacts.begin(), step.value().contacts.end());
    run.ms_frame += step.value().statistics.ms.total;
    run.elementary_ms += step.value().statistics.ms.elementary;
    run.elementary_tests += step.value().statistics.counts.elementary_tests;
  }
  run.ms_frame /= static_cast<double>(run.contacts.size());
  return run;
}

/// Both are sorted as steps report them.
void compare(std::span<const Contact> answer, std::span<const Contact> truth, TradeRow& row) {
  const auto key = [](const Contact& c) { return std::tie(c.kind, c.a, c.b); };
  auto exact = truth.begin();
  for (const Contact& contact : answer) {
    for (; exact != truth.end() && key(*exact) < key(contact); ++exact) ++row.tally.false_negatives;
    if (exact != truth.end() && key(*exact) == key(contact)) {
      row.toi.add(contact.toi, exact->toi);
      ++exact;
    } else {
      ++row.tally.false_positives;
    }
    row.tally.possible +=
        contact.status == ContactStatus::kPossible || contact.status == ContactStatus::kBudget;
  }
  row.tally.false_negatives += static_cast<std::uint64_t>(truth.end() - exact);
  row.tally.contacts += truth.size();
}

KnownComparison compare(const Scene& scene, std::span<const Contact> contacts, const KnownPairs& known) {
  std::vector<PairKey> found;
  for (const Contact& contact : contacts)
    found.push_back(PairKey::of(contact.kind, scene.vertices_of(contact)));
  std::ranges::sort(found);
  const auto common = [&](const std::vector<PairKey>& pairs) {
    std::vector<PairKey> both;
    std::ranges::set_intersection(found, pairs, std::back_inserter(both));
    return both.size();
  };
  const std::size_t confirmed = common(known.touching);
  const std::size_t contradicted = common(known.apart);
  return {known.touching.size(), known.touching.size() - confirmed, contradicted,
          found.size() - confirmed - contradicted};
}

}  // namespace

std::string_view to_string(PositionType type) {
  return type == PositionType::kFloat64 ? "float64" : "float32";
}

std::string TradeSetting::name() const {
  std::string name(to_string(tier));
  if (tier != Tier::kCertified) return name;
  char text[32];
  std::snprintf(text, sizeof text, " %g", tolerance);
  return name + text;
}

void ToiErrors::add(double toi, double exact) {
  const double error = std::fabs(toi - exact);
  ++compared;
  late += toi > exact;
  sum += error;
  max = std::max(max, error);
}

std::vector<TradeRow> measure_queries(const std::string& name, std::span<const TypedQuery> queries,
                                      std::span<const TradeSetting> settings, std::uint32_t rounds,
                                      const TradeProgress& progress) {
  std::vector<TradeSetting> distinct;
  for (const TradeSetting& setting : settings) {
    if (std::ranges::none_of(distinct, [&](const auto& d) { return same_but_for_bounds(d, setting); }))
      distinct.push_back(setting);
  }
  const std::vector<TypedQuery> rounded = in_float32(queries);
  const std::uint64_t total = queries.size() * (distinct.size() * rounds + 1);
  const std::vector<TimedVerdict> truth =
      run_timed(queries, {.tier = Tier::kExact, .min_separation = separation_of(settings)}, 1,
                [&](std::uint64_t done) { progress(done, total); });
  std::vector<TradeRow> rows;
  for (const TradeSetting& setting : distinct) {
    const std::uint64_t before = queries.size() * (rows.size() * rounds + 1);
    TradeRow row{.set = name, .setting = setting};
    const auto answers = run_timed(
        setting.positions == PositionType::kFloat32 ? std::span<const TypedQuery>(rounded) : queries,
        {.tier = setting.tier, .tolerance = setting.tolerance, .min_separation = setting.separation}, rounds,
        [&](std::uint64_t done) { progress(before + done, total); });
    std::vector<double> nanoseconds;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const Verdict& verdict = answers[i].verdict;
      row.tally.add(verdict, setting.separation > 0 ? truth[i].verdict.contact : queries[i].query.truth);
      if (verdict.contact && truth[i].verdict.contact) row.toi.add(verdict.toi, truth[i].verdict.toi);
      nanoseconds.push_back(answers[i].nanoseconds);
    }
    row.ns = times_of(std::move(nanoseconds));
    rows.push_back(std::move(row));
  }
  return rows;
}

Result<SceneTrade> measure_scene(const std::string& name, Input& input, FrameRange range,
                                 std::uint32_t substeps, std::span<const TradeSetting> settings,
                                 std::uint32_t rounds, std::shared_ptr<Workers> workers,
                                 const KnownPairs* known, const TradeProgress& progress) {
  SceneDescription description = input.scene();
  for (Body& body : description.bodies) body.screw = false;  // which positions know nothing of
  Result<Scene> created = Scene::create(std::move(description));
  if (!created) return created.error();
  const auto scene = std::make_shared<const Scene>(std::move(created).value());
  const Result<Frames> read = read_frames(input, range, substeps);
  if (!read) return read.error();
  const Frames& frames = read.value();

  std::vector<TradeRow> rows;
  for (const TradeSetting& setting : settings) {
    if (setting.positions == PositionType::kFloat32 && frames.rounded.empty()) continue;
    rows.push_back({.set = name, .scene = true, .setting = setting});
  }
  const std::uint64_t total = rows.size() * rounds + 1;
  progress(0, total);
  const Result<SceneRun> truth =
      step_through(scene, frames, {.tier = Tier::kExact, .separation = separation_of(settings)}, workers);
  if (!truth) return truth.error();
  std::vector<std::vector<double>> ms(rows.size());
  std::vector<std::vector<double>> ns(rows.size());
  for (std::uint32_t round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      progress(1 + round * rows.size() + i, total);
      TradeRow& row = rows[i];
      const Result<SceneRun> run = step_through(scene, frames, row.setting, workers);
      if (!run) return run.error();
      ms[i].push_back(run.value().ms_frame);
      const auto tests = static_cast<double>(std::max<std::uint64_t>(run.value().elementary_tests, 1));
      ns[i].push_back(1e6 * run.value().elementary_ms * workers->threads() / tests);
      if (round > 0) continue;
      row.tally.queries = run.value().elementary_tests;
      for (std::size_t k = 0; k < run.value().contacts.size(); ++k)
        compare(run.value().contacts[k], truth.value().contacts[k], row);
    }
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].ms_frame = median(ms[i]);
    rows[i].ns.mean = median(ns[i]);
  }
  SceneTrade trade{std::move(rows), std::nullopt};
  if (known) trade.comparison = compare(*scene, truth.value().contacts.front(), *known);
  return trade;
}

}  // namespace warmfront::client
