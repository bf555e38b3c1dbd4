// SPDX-License-Identifier: Apache-2.0
// Which rows are new, kept and ended: against sets of rows, on random lists and on the answers of a
// collider, by features and by vertices, with bodies that change in between, reduced and not.
#include "engine/continuity.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "engine/collider.h"
#include "engine/stencil.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

std::mt19937_64 draw_random() {
  return std::mt19937_64(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
}

// By keys, each of which a list has once.
template <class Key>
Continuity by_sets(const std::vector<Key>& earlier, const std::vector<Key>& now) {
  std::map<Key, std::size_t> places;
  for (std::size_t i = 0; i < earlier.size(); ++i) RC_ASSERT(places.emplace(earlier[i], i).second);
  Continuity expected;
  std::set<std::size_t> kept;
  for (const Key& key : now) {
    const auto found = places.find(key);
    expected.earlier.push_back(found == places.end() ? Continuity::kNew : found->second);
    if (found != places.end()) kept.insert(found->second);
  }
  for (std::size_t i = 0; i < earlier.size(); ++i)
    if (!kept.contains(i)) expected.ended.push_back(i);
  return expected;
}

std::vector<Contact> draw_rows(std::mt19937_64& random) {
  std::set<std::tuple<ContactKind, std::uint32_t, std::uint32_t>> rows;
  for (std::size_t k = random() % 40; k > 0; --k)
    rows.insert({static_cast<ContactKind>(random() % 2), static_cast<std::uint32_t>(random() % 6),
                 static_cast<std::uint32_t>(random() % 6)});
  std::vector<Contact> contacts;
  for (const auto& [kind, a, b] : rows)
    contacts.push_back({kind, static_cast<ContactStatus>(1 + random() % 4), a, b, 0.25 * (random() % 5)});
  return contacts;
}

using ById = std::tuple<ContactKind, std::uint32_t, std::uint32_t>;
std::vector<ById> ids_of(std::span<const Contact> contacts) {
  std::vector<ById> ids;
  for (const Contact& c : contacts) ids.emplace_back(c.kind, c.a, c.b);
  return ids;
}

RC_GTEST_PROP(ContinuityOfRows, IsWhatSetsSay, ()) {
  std::mt19937_64 random = draw_random();
  const std::vector<Contact> earlier = draw_rows(random), now = draw_rows(random);
  RC_ASSERT(continuity(earlier, now) == by_sets(ids_of(earlier), ids_of(now)));
}

/// An answer that is kept.
struct Rows {
  std::vector<Contact> contacts;
  std::vector<ContactKind> kind;
  std::vector<std::array<std::uint32_t, 4>> vertices;
  std::vector<std::uint8_t> stencil;

  Rows() = default;
  Rows(const StepResult& answer, const Scene& scene)
      : contacts(answer.contacts.begin(), answer.contacts.end()) {
    for (const Contact& contact : contacts) {
      kind.push_back(contact.kind);
      vertices.push_back(scene.vertices_of(contact));
    }
    for (const ClosestPair& pair : answer.closest_pairs) stencil.push_back(pair.stencil);
  }
  RowVertices view() const { return {kind, vertices, stencil}; }

  /// Of a reduced answer: the closest pairs by their vertices, two vertices and edges in any order.
  std::vector<std::vector<std::uint32_t>> pairs() const {
    std::vector<std::vector<std::uint32_t>> all;
    for (std::size_t i = 0; i < kind.size(); ++i) {
      const Stencil of = stencil_of(kind[i], vertices[i], stencil[i]);
      std::vector<std::uint32_t> key(of.vertices.begin(), of.vertices.begin() + of.size);
      if (of.size < 4) std::sort(key.begin(), key.begin() + 2);
      key.push_back(of.size < 4 ? 2 : static_cast<std::uint32_t>(kind[i]));
      all.push_back(std::move(key));
    }
    return all;
  }
};

// Duplicates are rows that are the same by their vertices: by ids they are told apart.
bool has_twice(const Rows& rows) {
  std::set<std::pair<ContactKind, std::array<std::uint32_t, 4>>> seen;
  for (std::size_t i = 0; i < rows.kind.size(); ++i)
    if (!seen.emplace(rows.kind[i], rows.vertices[i]).second) return true;
  return false;
}

RC_GTEST_PROP(ContinuityOfRows, OfAnswersIsTheSameByIdsAndByVerticesAlsoWhereBodiesChange, ()) {
  std::mt19937_64 random = draw_random();
  const testing::RandomScene made = testing::random_scene(random);
  Body all;
  all.vertex_count = made.scene->vertex_count();
  SceneDescription description{all.vertex_count, {}, {all}};
  for (const Face& face : made.scene->faces())
    description.faces.push_back({static_cast<std::int32_t>(face[0]), static_cast<std::int32_t>(face[1]),
                                 static_cast<std::int32_t>(face[2])});
  std::vector<double> x = made.positions;
  Collider collider =
      Collider::create(std::make_shared<const Scene>(Scene::create(description).value()),
                       std::span<const double>(x), {.min_separation = 0.05}, testing::workers())
          .value();
  Rows steps, near;
  for (int k = 0; k < 4; ++k) {
    if (k == 2) {
      Body triangle;
      triangle.vertex_count = 3;
      const std::vector<double> corners(x.begin(), x.begin() + 9);
      const std::uint32_t added =
          collider.add_body({triangle, {{0, 1, 2}}}, std::span<const double>(corners)).value();
      x.insert(x.end(), corners.begin(), corners.end());
      if (random() % 2 == 0) {
        Body changed = collider.scene().bodies()[added];
        changed.kind = BodyKind::kRemoved;
        RC_ASSERT(collider.change_body(added, changed).ok());
      }
    }
    std::vector<double> y = x;
    for (double& coordinate : y) coordinate += 0.01 * (static_cast<double>(random() % 201) / 100 - 1);
    if (collider.scene().body_count() > 1 && collider.scene().bodies()[1].kind == BodyKind::kRemoved)
      std::copy(x.end() - 9, x.end(), y.end() - 9);
    const auto stepped = collider.step(std::span<const double>(y));
    RC_ASSERT(stepped.ok());
    x = y;
    const Rows step(stepped.value(), collider.scene());
    const Continuity by_ids = continuity(steps.contacts, step.contacts);
    RC_ASSERT(by_ids == by_sets(ids_of(steps.contacts), ids_of(step.contacts)));
    const Continuity by_vertices = continuity(steps.view(), step.view());
    if (!has_twice(steps) && !has_twice(step)) RC_ASSERT(by_vertices == by_ids);
    RC_ASSERT(by_vertices.earlier.size() == step.kind.size());

    const auto reduced = collider.proximity(0.1, Where::kBase, {.reduced = true});
    RC_ASSERT(reduced.ok());
    const Rows pairs(reduced.value(), collider.scene());
    if (!has_twice(near) && !has_twice(pairs))
      RC_ASSERT(continuity(near.view(), pairs.view()) == by_sets(near.pairs(), pairs.pairs()));
    steps = step;
    near = pairs;
  }
}

TEST(ContinuityOfRows, RowsOfAFaceThatIsGivenTwiceAreKeptInTheirOrder) {
  const std::vector<ContactKind> kind(3, ContactKind::kVertexFace);
  const std::vector<std::array<std::uint32_t, 4>> three{{0, 1, 2, 3}, {0, 1, 2, 3}, {0, 4, 5, 6}};
  const std::vector<std::array<std::uint32_t, 4>> other{{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 1, 2, 3}};
  const Continuity made = continuity({kind, three}, {kind, other});
  EXPECT_EQ(made.earlier, (std::vector<std::size_t>{0, Continuity::kNew, 1}));
  EXPECT_EQ(made.ended, (std::vector<std::size_t>{2}));
  // A vertex and a face are no edges, whatever their numbers.
  const std::vector<ContactKind> edges(3, ContactKind::kEdgeEdge);
  EXPECT_EQ(continuity({kind, three}, {edges, three}).ended.size(), 3u);
}

// The closest pair stays, and another row stands for it.
TEST(ContinuityOfRows, OfReducedAnswersGoesByTheClosestPair) {
  const std::vector<ContactKind> vf{ContactKind::kVertexFace}, ee{ContactKind::kEdgeEdge};
  const std::vector<std::array<std::uint32_t, 4>> face{{9, 1, 2, 3}}, edge{{1, 8, 9, 7}}, same{{3, 2, 9, 7}};
  const std::vector<std::uint8_t> corner{0b0011}, ends{0b0101}, side{0b1101}, along{0b0111};
  EXPECT_EQ(continuity({vf, face, corner}, {ee, edge, ends}).earlier, std::vector<std::size_t>{0})
      << "9 and 1";
  EXPECT_EQ(continuity({vf, face, side}, {ee, same, along}).earlier, std::vector<std::size_t>{0})
      << "edge 2 3 and 9";
  EXPECT_EQ(continuity({vf, face, corner}, {ee, same, along}).ended, std::vector<std::size_t>{0});
}

}  // namespace
}  // namespace warmfront
