// SPDX-License-Identifier: Apache-2.0
#include "tests/support/near_oracle.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "tests/support/moving_vectors.h"

namespace warmfront::testing {
namespace {

// Signs of polynomials at one time.
using SignAt = std::function<int(const Polynomial&)>;

// Two sub-features (a vertex, the line of an edge, the plane of a face; or the lines of two edges) of which
// the closest points are within the primitives while no polynomial of `within` is negative and `extent` is
// positive (it is 0 where an edge has no length, a face no area, or two edges are parallel); and then the
// square of their distance less that of the separation has the sign of `excess`.
struct SubFeatures {
  Polynomial excess;
  std::vector<Polynomial> within;
  Polynomial extent;

  bool near(const SignAt& sign) const {
    return sign(excess) <= 0 && sign(extent) > 0 &&
           std::ranges::all_of(within, [&](const Polynomial& p) { return sign(p) >= 0; });
  }
};

// The distance between two closed primitives is the least of those between their sub-features whose closest
// points are within: it is attained somewhere, and all of them are distances between points of both.
class Distances {
 public:
  Distances(const FeatureVertices& features, double separation) {
    const IntegerQuery query = integer_query(features, separation);
    square_ = Polynomial({query.length * query.length});
    const auto& [p, a, b, c] = query.vertex;
    if (features.kind == ContactKind::kVertexFace) {
      for (const MovingVector& corner : {a, b, c}) vertices(p, corner);
      vertex_edge(p, a, b);
      vertex_edge(p, b, c);
      vertex_edge(p, c, a);
      vertex_face(p, a, b, c);
    } else {
      for (const MovingVector& one : {p, a}) {
        for (const MovingVector& other : {b, c}) vertices(one, other);
        vertex_edge(one, b, c);
      }
      vertex_edge(b, p, a);
      vertex_edge(c, p, a);
      edges(p, a, b, c);
    }
  }

  bool near(const SignAt& sign) const {
    return std::ranges::any_of(pairs_, [&](const SubFeatures& pair) { return pair.near(sign); });
  }

  // near() can change only at a root of one of these.
  std::vector<Polynomial> events() const {
    std::vector<Polynomial> events;
    const auto add = [&](const Polynomial& p) {
      if (p.degree() < 1) return;
      const Polynomial event = p.primitive();
      if (std::ranges::find(events, event) == events.end()) events.push_back(event);
    };
    for (const SubFeatures& pair : pairs_) {
      add(pair.excess);
      add(pair.extent);
      std::ranges::for_each(pair.within, add);
    }
    return events;
  }

 private:
  void vertices(const MovingVector& p, const MovingVector& q) {
    pairs_.push_back({dot(q - p, q - p) - square_, {}, Polynomial({1})});
  }

  void vertex_edge(const MovingVector& p, const MovingVector& a, const MovingVector& b) {
    const MovingVector e = b - a;
    const MovingVector n = cross(p - a, e);
    const Polynomial length = dot(e, e);
    const Polynomial along = dot(p - a, e);
    pairs_.push_back({dot(n, n) - square_ * length, {along, length - along}, length});
  }

  void vertex_face(const MovingVector& p, const MovingVector& a, const MovingVector& b,
                   const MovingVector& c) {
    const MovingVector n = cross(b - a, c - a);
    const Polynomial area = dot(n, n);
    const Polynomial height = dot(p - a, n);
    pairs_.push_back({height * height - square_ * area,
                      {dot(cross(b - a, p - a), n), dot(cross(c - b, p - b), n), dot(cross(a - c, p - c), n)},
                      area});
  }

  void edges(const MovingVector& a, const MovingVector& b, const MovingVector& c, const MovingVector& d) {
    const MovingVector n = cross(b - a, d - c);
    const Polynomial area = dot(n, n);
    const Polynomial height = dot(c - a, n);
    const Polynomial first = dot(cross(c - a, d - c), n);
    const Polynomial second = dot(cross(c - a, b - a), n);
    pairs_.push_back({height * height - square_ * area, {first, area - first, second, area - second}, area});
  }

  Polynomial square_;
  std::vector<SubFeatures> pairs_;
};

}  // namespace

ExactTruth near_truth(const FeatureVertices& features, double separation) {
  const Distances distances(features, separation);
  const Dyadic start{0, 0};
  if (distances.near([&](const Polynomial& p) { return p.sign_at(start); })) return {true, true, true, 0};
  // The times at which they are near are a closed set: its first one is a root of an event.
  std::optional<Root> first;
  for (const Polynomial& event : distances.events()) {
    for (Root& root : roots_in_unit_interval(event)) {
      if (first && compare(root, *first) >= 0) break;
      if (distances.near([&](const Polynomial& p) { return sign_at(p, root); })) {
        first = root;
        break;
      }
    }
  }
  if (!first) return {};
  const double toi = double_below(*first);
  return {true, false, compare(dyadic(toi), *first) == 0, toi};
}

}  // namespace warmfront::testing
