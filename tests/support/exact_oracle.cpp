// SPDX-License-Identifier: Apache-2.0
#include "tests/support/exact_oracle.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "tests/support/moving_vectors.h"

namespace warmfront::testing {
namespace {

using Vector = MovingVector;

// Signs of polynomials at one time.
using SignAt = std::function<int(const Polynomial&)>;

// The moving points p_i (differences between the primitives' vertices: three for vertex and face, the four
// corners of a parallelogram for edge and edge) and the question whether 0 lies in their convex hull. By
// Caratheodory, 0 is then in the hull of an affinely independent subset, in its relative interior for the
// smallest one; the points span a plane at most, so that subset has
//   one or two points: they are linearly dependent (their cross product vanishes) and do not point the same
//   way (their dot product is not positive); three: they are dependent (their determinant vanishes) and, seen
//   along some axis, 0 lies strictly within their triangle (the three minors' signs are equal and not 0).
class Hull {
 public:
  explicit Hull(const std::vector<Vector>& points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t j = i + 1; j < points.size(); ++j) {
        pairs_.push_back({cross(points[i], points[j]), dot(points[i], points[j])});
        for (std::size_t k = j + 1; k < points.size(); ++k) {
          triples_.push_back(
              {dot(cross(points[i], points[j]), points[k]),
               {cross(points[i], points[j]), cross(points[j], points[k]), cross(points[k], points[i])}});
        }
      }
    }
  }

  bool holds_zero(const SignAt& sign) const {
    return std::ranges::any_of(triples_, [&](const Triple& t) { return t.holds_zero(sign); }) ||
           std::ranges::any_of(pairs_, [&](const Pair& p) { return p.holds_zero(sign); });
  }

  // Polynomials at whose roots alone holds_zero() can become true. When 0 is in the hull all determinants
  // vanish: one that is not zero throughout suffices.
  std::vector<Polynomial> events() const {
    for (const Triple& triple : triples_) {
      if (!triple.determinant.is_zero()) return {triple.determinant};
    }
    std::vector<Polynomial> events;
    const auto add = [&](const Polynomial& p) {
      if (p.degree() < 1) return;
      const Polynomial event = p.primitive();
      if (std::ranges::find(events, event) == events.end()) events.push_back(event);
    };
    for (const Pair& pair : pairs_) {
      std::ranges::for_each(pair.cross_product, add);
      add(pair.dot_product);
    }
    return events;
  }

 private:
  struct Pair {
    Vector cross_product;
    Polynomial dot_product;
    bool holds_zero(const SignAt& sign) const {
      return std::ranges::all_of(cross_product, [&](const Polynomial& p) { return sign(p) == 0; }) &&
             sign(dot_product) <= 0;
    }
  };
  struct Triple {
    Polynomial determinant;
    std::array<Vector, 3> minors;
    bool holds_zero(const SignAt& sign) const {
      if (sign(determinant) != 0) return false;
      for (int axis = 0; axis < 3; ++axis) {
        const int first = sign(minors[0][axis]);
        if (first != 0 && sign(minors[1][axis]) == first && sign(minors[2][axis]) == first) return true;
      }
      return false;
    }
  };
  std::vector<Pair> pairs_;
  std::vector<Triple> triples_;
};

std::vector<Vector> differences(const FeatureVertices& features) {
  const auto p = integer_query(features, 0).vertex;
  if (features.kind == ContactKind::kVertexFace) return {p[1] - p[0], p[2] - p[0], p[3] - p[0]};
  return {p[2] - p[0], p[3] - p[0], p[2] - p[1], p[3] - p[1]};
}

}  // namespace

ExactTruth exact_truth(const FeatureVertices& features) {
  const Hull hull(differences(features));
  const Dyadic start{0, 0};
  if (hull.holds_zero([&](const Polynomial& p) { return p.sign_at(start); })) return {true, true, true, 0};
  // The times of contact are a closed set: its first one is a root of an event.
  std::optional<Root> first;
  for (const Polynomial& event : hull.events()) {
    for (Root& root : roots_in_unit_interval(event)) {
      if (first && compare(root, *first) >= 0) break;
      if (hull.holds_zero([&](const Polynomial& p) { return sign_at(p, root); })) {
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
