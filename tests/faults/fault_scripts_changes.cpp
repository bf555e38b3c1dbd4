// SPDX-License-Identifier: Apache-2.0
// Scripts that change the scene between frames.
#include "tests/faults/fault_scripts_changes.h"

#include <utility>

#include "tests/faults/small_sheets.h"
#include "tests/support/scenes.h"

namespace warmfront::testing::scripts {

Script changes() {
  Script script{"changes",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.5))},
                {},
                {}};
  script.operations.emplace_back(posed(1, shifted(0, 0, -0.2)));
  script.operations.emplace_back(ChangeOperation{0, {"", 0, 9, BodyKind::kRigid}});
  script.operations.emplace_back(posed(0, shifted(0.02, 0.03, 0.35)));
  script.operations.emplace_back(ChangeOperation{1, {"", 9, 9, BodyKind::kDeformable}});
  Body body{"a", 0, 9, BodyKind::kDeformable};
  script.operations.emplace_back(AddOperation{{body, grid(2)}, sheet(2, 0.4)});
  StepOperation rows;
  rows.bodies.push_back({2, sheet(2, 0.2)});
  script.operations.emplace_back(rows);
  body.kind = BodyKind::kRigid;
  script.operations.emplace_back(AddOperation{{body, grid(2)}, sheet(2, 0.1)});
  script.operations.emplace_back(posed(3, shifted(0.01, 0.02, 0.3)));
  script.operations.emplace_back(ChangeOperation{0, {"", 0, 9, BodyKind::kStatic}});
  script.operations.emplace_back(posed(3, shifted(0.01, 0.02, -0.3)));
  script.operations.emplace_back(ChangeOperation{2, {"", 18, 9, BodyKind::kRemoved}});
  script.operations.emplace_back(posed(3, shifted(0.01, 0.02, 0.3)));
  return script;
}

// Several changes at once: bodies that are added, changed at once and taken out again, one that is rigid
// before and after but was not in between, and names alone.
Script changes_together() {
  Script script{"changes together",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.5))},
                {},
                {}};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  const Body hard{"hard", 0, 9, BodyKind::kRigid};
  script.operations.emplace_back(posed(1, shifted(0.1, 0, -0.2)));
  script.operations.emplace_back(ChangesOperation{
      {AddBody{{soft, grid(2)}, sheet(2, 0.4)}, ChangeBody{1, {"", 9, 9, BodyKind::kDeformable}},
       AddBody{{hard, grid(2)}, sheet(2, -0.2)}, ChangeBody{2, {"", 18, 9, BodyKind::kRigid}},
       ChangeBody{1, {"", 9, 9, BodyKind::kRigid}}}});
  StepOperation all = posed(1, shifted(0.01, 0.02, -0.4));
  all.poses.push_back({2, shifted(0.01, 0.02, -0.5)});
  all.poses.push_back({3, shifted(0.01, 0.02, 0.7)});
  script.operations.emplace_back(all);
  script.operations.emplace_back(ChangesOperation{
      {ChangeBody{0, {"named", 0, 9, BodyKind::kDeformable}}, ChangeBody{3, {"", 27, 9, BodyKind::kRigid}}}});
  script.operations.emplace_back(ChangesOperation{
      {AddBody{{soft, grid(2)}, sheet(2, 0.45)}, ChangeBody{3, {"", 27, 9, BodyKind::kRemoved}},
       ChangeBody{4, {"", 36, 9, BodyKind::kRemoved}}, ChangeBody{0, {"", 0, 9, BodyKind::kStatic}},
       AddBody{{soft, grid(2)}, sheet(2, 0.3)}}});
  StepOperation fall = posed(2, shifted(0, 0, 0.2));
  fall.bodies.push_back({5, sheet(2, -0.3)});
  script.operations.emplace_back(fall);
  return script;
}

// Filters of all kinds, beside a body that is added and alone, and none again.
Script filters() {
  Script script{"filters",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  script.start.scene.filters = {.within_edges = 1, .patches = std::vector<std::uint32_t>(18, 1)};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(AddOperation{{soft, grid(2)}, sheet(2, -0.2)});
  PairFilters other{.within_edges = 2,
                    .near_at_rest = 0.25,
                    .rest_positions = joined(joined(sheet(2, 0), sheet(2, 0.3)), sheet(2, -0.2)),
                    .excluded_vertex_pairs = {{0, 9}, {26, 4}}};
  script.operations.emplace_back(ChangesOperation{{ChangeFilters{other}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  script.operations.emplace_back(NearOperation{0.4, Where::kBase, {}});
  other.rest_positions.insert(other.rest_positions.end(), 27, 0.5);
  script.operations.emplace_back(
      ChangesOperation{{AddBody{{soft, grid(2)}, sheet(2, 0.1)}, ChangeFilters{other}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.3)));
  script.operations.emplace_back(ChangesOperation{{ChangeFilters{}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0)));
  return script;
}

// Options and excluded pairs, alone and with other changes.
Script options() {
  Script script{"options",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(ChangesOperation{{ChangeExcludedPairs{{{0, 1}}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  ColliderOptions other;
  other.min_separation = 0.1;
  other.front = FrontMode::kNone;
  script.operations.emplace_back(ChangesOperation{{ChangeExcludedPairs{}}, other});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.3)));
  other.min_separation = 0;
  other.tier = Tier::kExact;
  script.operations.emplace_back(
      ChangesOperation{{AddBody{{soft, grid(2)}, sheet(2, 0.1)}, ChangeExcludedPairs{{{1, 2}}}}, other});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0)));
  script.operations.emplace_back(ChangesOperation{{}, ColliderOptions{}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.2)));
  return script;
}

// Elements and bodies that are replaced, alone and with other changes, beside bodies at poses.
Script replacements() {
  Script script{"replacements",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  const Body finer{"finer", 0, 16, BodyKind::kDeformable};
  Faces torn = grid(2);
  torn.resize(5);
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{1, torn, {{0, 8}}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  script.operations.emplace_back(ChangesOperation{{ReplaceBody{0, {finer, grid(3)}, sheet(3, -0.2)}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.4)));
  script.operations.emplace_back(
      ChangesOperation{{AddBody{{soft, grid(2)}, sheet(2, 0.1)}, ReplaceElements{0, grid(3), {}},
                        ChangeBody{1, {"", 16, 9, BodyKind::kDeformable}}}});
  StepOperation rows;
  rows.bodies.push_back({2, sheet(2, -0.3)});
  script.operations.emplace_back(rows);
  ReplaceBody gone{1, {{}, {}}, {}};
  gone.addition.body.kind = BodyKind::kRemoved;
  script.operations.emplace_back(ChangesOperation{{gone}});
  rows.bodies.back().positions = sheet(2, 0.1);
  script.operations.emplace_back(rows);
  script.operations.emplace_back(
      ChangesOperation{{ReplaceBody{1, {soft, grid(2)}, sheet(2, 0.2)}, ReplaceElements{1, torn, {}}}});
  rows.bodies.push_back({1, sheet(2, -0.4)});
  script.operations.emplace_back(rows);
  return script;
}

// A few elements of a body are replaced: its hierarchy is kept, also where it has no room for the new ones.
Script replaced_locally() {
  Script script{"replaced locally",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 4), joined(sheet(4, 0), sheet(4, 0.3))},
                {},
                {}};
  Faces torn = grid(4);
  torn.erase(torn.begin() + 6);
  Faces turned = torn;
  std::swap(turned[9][0], turned[9][1]);
  Faces filled = turned;
  filled.insert(filled.end(), {{0, 1, 7}, {3, 8, 12}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, torn, {{0, 24}}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, turned, {}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.4)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, filled, {}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.2)));
  return script;
}

// A scene without declared bodies, as a whole.
Script replaced_whole() {
  Script script{
      "replaced whole",
      {two_bodies(BodyKind::kDeformable, BodyKind::kDeformable, 2), joined(sheet(2, 0), sheet(2, 0.3))},
      {},
      {}};
  script.start = {{script.start.scene.vertex_count, script.start.scene.faces, {}}, script.start.positions};
  script.operations.emplace_back(everything(joined(sheet(2, 0.1), sheet(2, 0.05))));
  Faces torn = script.start.scene.faces;
  torn.resize(13);
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, torn, {{16, 17}}}}});
  script.operations.emplace_back(everything(joined(sheet(2, 0), sheet(2, 0.2))));
  return script;
}

}  // namespace warmfront::testing::scripts
