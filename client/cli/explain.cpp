// SPDX-License-Identifier: Apache-2.0
#include "client/cli/explain.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <utility>
#include <vector>

namespace warmfront::client {

Result<Explanation> Explanation::start(const SceneDescription& description, std::span<const double> positions,
                                       const ColliderOptions& options, int threads) {
  Result<Scene> scene = Scene::create(description);
  if (!scene) return scene.error();
  SceneDescription plain = description;
  plain.bodies.clear();
  plain.excluded_pairs.clear();
  Result<std::unique_ptr<Stepper>> all = make_local_stepper(plain, positions, options, threads);
  if (!all) return all.error();
  return Explanation(std::move(scene).value(), std::move(all).value());
}

Status Explanation::step(std::span<const double> positions, const StepAnswer& modelled,
                         std::uint64_t frame_bytes, std::uint64_t all_bytes) {
  Result<StepAnswer> result = all_->step(Frame(positions));
  if (!result) return result.error();
  const StepAnswer& all = result.value();
  const auto add_step = [](Sums& sums, const StepAnswer& answer, std::uint64_t bytes) {
    sums.ms += answer.statistics.ms.total;
    add(sums.counts, answer.statistics.counts);
    sums.contacts += answer.contacts.size();
    sums.bytes += bytes;
  };
  add_step(modelled_, modelled, frame_bytes);
  add_step(deformable_, all, all_bytes);
  ++steps_;
  std::vector<ContactRecord> allowed;
  std::ranges::copy_if(all.contacts, std::back_inserter(allowed), [&](const ContactRecord& c) {
    if (scene_.bodies().empty()) return true;
    const std::span<const std::uint32_t> body = scene_.body_of_vertex();
    return model_.may_meet(body[c.vertices[0]], body[c.vertices[3]]);
  });
  const bool same = std::ranges::equal(allowed, modelled.contacts, [](const auto& a, const auto& b) {
    return a.kind == b.kind && a.status == b.status && a.vertices == b.vertices && a.toi == b.toi;
  });
  if (!same)
    return Error{ErrorCode::kInternal,
                 "the model's contacts are not those of the all-deformable scene less the "
                 "pairs that it excludes; please report this"};
  return {};
}

void Explanation::print() const {
  const auto row = [&](const char* what, double modelled, double deformable, const char* format) {
    char a[32], b[32], share[16] = "";
    std::snprintf(a, sizeof a, format, modelled / static_cast<double>(steps_));
    std::snprintf(b, sizeof b, format, deformable / static_cast<double>(steps_));
    if (deformable > 0) std::snprintf(share, sizeof share, "%.1f%%", 100 * modelled / deformable);
    std::printf("%-34s %14s %14s %8s\n", what, a, b, share);
  };
  const auto count = [&](const char* what, std::uint64_t StepCounts::*member) {
    row(what, static_cast<double>(modelled_.counts.*member), static_cast<double>(deformable_.counts.*member),
        "%.0f");
  };
  std::printf("\n%-34s %14s %14s\n", "what a step takes, mean", "as modelled", "all deformable");
  row("time, ms", modelled_.ms, deformable_.ms, "%.3f");
  row("frame, bytes", static_cast<double>(modelled_.bytes), static_cast<double>(deformable_.bytes), "%.0f");
  row("contacts", static_cast<double>(modelled_.contacts), static_cast<double>(deformable_.contacts), "%.1f");
  count("vertices moved", &StepCounts::vertices_moved);
  count("hierarchy nodes refit", &StepCounts::nodes_refit);
  count("front pairs", &StepCounts::front_pairs);
  count("front, bytes", &StepCounts::front_bytes);
  count("front pairs at rest, not looked at", &StepCounts::front_rested);
  count("bounding volume tests", &StepCounts::bv_tests);
  count("primitive tests", &StepCounts::primitive_tests);
  count("orphan tests", &StepCounts::orphan_tests);
  count("elementary tests", &StepCounts::elementary_tests);
  count("contacts kept from before", &StepCounts::contacts_kept);
  std::printf("pairs of bodies left out: %" PRIu64
              "; contacts: those of the all-deformable scene less theirs\n",
              modelled_.counts.part_pairs_excluded / std::max<std::uint64_t>(steps_, 1));
}

}  // namespace warmfront::client
