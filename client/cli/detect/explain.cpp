// SPDX-License-Identifier: Apache-2.0
#include "client/cli/detect/explain.h"

#include <algorithm>
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
  ColliderOptions nothing_found = options;
  nothing_found.explain = nothing_found.find_bodies = nothing_found.find_rigid = false;
  Result<std::unique_ptr<Stepper>> all = make_local_stepper(plain, positions, nothing_found, threads);
  if (!all) return all.error();
  return Explanation(std::move(scene).value(), std::move(all).value());
}

Status Explanation::step(std::span<const double> positions, const StepAnswer& modelled,
                         std::uint64_t frame_bytes, std::uint64_t all_bytes) {
  const auto add_step = [](Sums& sums, const StepStatistics& statistics, std::size_t contacts,
                           std::uint64_t bytes) {
    sums.ms += statistics.ms.total;
    add(sums.counts, statistics.counts);
    sums.contacts += contacts;
    sums.bytes += bytes;
  };
  add_step(modelled_, modelled.statistics, modelled.contacts.size(), frame_bytes);
  ++steps_;
  if (all_ == nullptr) {
    if (!modelled.all_deformable)
      return Error{ErrorCode::kInternal, "the daemon could not step the all-deformable scene beside"};
    add_step(deformable_, *modelled.all_deformable, 0, all_bytes);
    return {};
  }
  const Result<StepAnswer> all = all_->step(Frame(positions));
  if (!all) return all.error();
  add_step(deformable_, all.value().statistics, all.value().contacts.size(), all_bytes);
  return compare(modelled, all.value());
}

Status Explanation::compare(const StepAnswer& modelled, const StepAnswer& all) const {
  std::vector<ContactRecord> allowed;
  std::ranges::copy_if(all.contacts, std::back_inserter(allowed), [&](const ContactRecord& c) {
    if (scene_.bodies().empty()) return true;
    const std::span<const std::uint32_t> body = scene_.body_of_vertex();
    return model_.may_meet(part_of_body(body[c.vertices[0]]), part_of_body(body[c.vertices[3]]));
  });
  // That one has no half-spaces, whose rows come last.
  const auto others =
      std::ranges::find(modelled.contacts, ContactKind::kVertexHalfSpace, &ContactRecord::kind);
  if (std::equal(allowed.begin(), allowed.end(), modelled.contacts.begin(), others)) return {};
  return Error{ErrorCode::kInternal,
               "the model's contacts are not those of the all-deformable scene less the pairs that it "
               "excludes; please report this"};
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
  if (all_ != nullptr)
    row("contacts", static_cast<double>(modelled_.contacts), static_cast<double>(deformable_.contacts),
        "%.1f");
  count("vertices moved", &StepCounts::vertices_moved);
  count("hierarchy nodes refit", &StepCounts::nodes_refit);
  count("front pairs", &StepCounts::front_pairs);
  count("front, bytes", &StepCounts::front_bytes);
  count("front pairs skipped as stationary", &StepCounts::front_rested);
  count("bounding volume tests", &StepCounts::bv_tests);
  count("primitive tests", &StepCounts::primitive_tests);
  count("orphan tests", &StepCounts::orphan_tests);
  count("elementary tests", &StepCounts::elementary_tests);
  count("cached contacts", &StepCounts::contacts_kept);
  const auto mean = [&](std::uint64_t StepCounts::*member) {
    return static_cast<double>(modelled_.counts.*member) /
           static_cast<double>(std::max<std::uint64_t>(steps_, 1));
  };
  std::printf(
      "bodies: %.0f, of which %.1f are found to move rigidly; pairs near each other: %.1f tested, %.1f kept "
      "apart by a plane; pairs left out: %.0f%s\n",
      mean(&StepCounts::parts), mean(&StepCounts::parts_rigid), mean(&StepCounts::near_parts),
      mean(&StepCounts::parts_apart), mean(&StepCounts::part_pairs_excluded),
      all_ != nullptr ? "; contacts: those of the all-deformable scene less theirs" : "");
}

}  // namespace warmfront::client
