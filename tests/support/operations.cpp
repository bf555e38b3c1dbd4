// SPDX-License-Identifier: Apache-2.0
#include "tests/support/operations.h"

#include <algorithm>
#include <bit>
namespace warmfront::testing {
namespace {

template <class... Ways>
struct Overloaded : Ways... {
  using Ways::operator()...;
};
template <class... Ways>
Overloaded(Ways...) -> Overloaded<Ways...>;

const char* name_of(BodyKind kind) {
  switch (kind) {
    case BodyKind::kDeformable:
      return "deformable";
    case BodyKind::kRigid:
      return "rigid";
    case BodyKind::kStatic:
      return "static";
    case BodyKind::kRemoved:
      return "removed";
  }
  return "?";
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
bool same(const Contact& a, const Contact& b) {
  return a == b && same_bits(a.toi, b.toi);
}
bool same(const ContactGeometry& a, const ContactGeometry& b) {
  return std::ranges::equal(a.weights, b.weights, same_bits) &&
         std::ranges::equal(a.normal, b.normal, same_bits) &&
         std::ranges::equal(a.points, b.points, same_bits);
}

template <class T>
std::string difference(const char* what, const std::vector<T>& was, const std::vector<T>& expected) {
  if (was.size() != expected.size())
    return std::to_string(was.size()) + " " + what + " where " + std::to_string(expected.size()) +
           " are expected";
  for (std::size_t i = 0; i < was.size(); ++i) {
    if (!same(was[i], expected[i])) return std::string(what) + "[" + std::to_string(i) + "] differs";
  }
  return "";
}

}  // namespace

std::string to_string(const Operation& operation) {
  return std::visit(
      Overloaded{
          [](const StepOperation& step) {
            const std::string as = step.as == StepOperation::As::kStep    ? "step"
                                   : step.as == StepOperation::As::kTrial ? "trial"
                                   : step.as == StepOperation::As::kPlace ? "place"
                                                                          : "max_step";
            if (step.all) return as + "(all positions)";
            std::string text = as + "(";
            for (const auto& rows : step.bodies) text += " body " + std::to_string(rows.body);
            for (const auto& pose : step.poses) text += " pose " + std::to_string(pose.body);
            if (!step.vertices.empty()) text += " " + std::to_string(step.vertices.size()) + " vertices";
            return text + " )";
          },
          [](const PlaceOperation& place) {
            return "place(" + std::to_string(place.poses.size()) + " poses)";
          },
          [](const AddOperation& add) {
            return "add_body(" + std::string(name_of(add.addition.body.kind)) + ", " +
                   std::to_string(add.positions.size() / 3) + " vertices)";
          },
          [](const ChangeOperation& change) {
            return "change_body(" + std::to_string(change.body) + ", " + name_of(change.as.kind) + ")";
          },
          [](const ChangesOperation& several) {
            std::string said = "change(";
            for (const SceneChange& change : several.changes) {
              constexpr const char* kKinds[] = {
                  "add", "describe", "filters", "excluded pairs", "replace elements of ", "replace body "};
              said += (said.back() == '(' ? "" : ", ") + std::string(kKinds[change.index()]);
              if (const auto* elements = std::get_if<ReplaceElements>(&change))
                said += std::to_string(elements->index);
              if (const auto* replaced = std::get_if<ReplaceBody>(&change))
                said += std::to_string(replaced->index);
            }
            if (several.options) said += said.back() == '(' ? "options" : ", options";
            return said + ")";
          },
          [](const CommitOperation& commit) { return "commit(" + std::to_string(commit.fraction) + ")"; },
          [](const NearOperation& near) {
            const bool by_vertex = near.options.report == Report::kVertexDistances;
            const std::string of = near.tangled ? "intersections("
                                                : (by_vertex ? "vertex_distances(" : "proximity(") +
                                                      std::to_string(near.distance);
            return of + (near.options.reduced ? ", reduced" : "") +
                   (near.where == Where::kTrialEnd ? ", at the trial's end)" : ")");
          },
          [](const CheckOperation&) { return std::string("self_check()"); },
          [](const ForgetOperation&) { return std::string("forget_warmth()"); },
      },
      operation);
}

std::string to_string(const Outcome& outcome) {
  if (outcome.kind == Outcome::Kind::kOutOfMemory) return "out of memory";
  if (outcome.kind == Outcome::Kind::kRefused) return "refused: " + outcome.error.message;
  return "done, vf " + std::to_string(outcome.vf) + ", ee " + std::to_string(outcome.ee) + ", ef " +
         std::to_string(outcome.ef) + ", vh " + std::to_string(outcome.vh) + ", possible " +
         std::to_string(outcome.possible) + ", " + std::to_string(outcome.contacts.size()) + " contacts";
}

std::string difference(const Outcome& was, const Outcome& expected) {
  const bool same_kind = was.kind == expected.kind &&
                         (was.kind != Outcome::Kind::kRefused || was.error.code == expected.error.code);
  const bool same_earliest = was.earliest_toi.has_value() == expected.earliest_toi.has_value() &&
                             (!was.earliest_toi || same_bits(*was.earliest_toi, *expected.earliest_toi));
  if (!same_kind || was.vf != expected.vf || was.ee != expected.ee || was.ef != expected.ef ||
      was.vh != expected.vh || was.possible != expected.possible)
    return to_string(was) + " where " + to_string(expected) + " is expected";
  if (!same_earliest) return "another earliest_toi";
  if (std::string text = difference("contacts", was.contacts, expected.contacts); !text.empty()) return text;
  if (!std::ranges::equal(was.vertex_distances, expected.vertex_distances, same_bits))
    return "vertex_distances differ";
  if (was.worlds != expected.worlds) return "other worlds";
  if (!std::ranges::equal(was.world_tois, expected.world_tois, same_bits)) return "another toi of a world";
  if (was.closest_pairs != expected.closest_pairs) return "closest pairs differ";
  return difference("geometry", was.geometry, expected.geometry);
}

}  // namespace warmfront::testing
