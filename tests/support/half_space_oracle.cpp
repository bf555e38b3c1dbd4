// SPDX-License-Identifier: Apache-2.0
#include "tests/support/half_space_oracle.h"

#include <algorithm>
#include <array>
#include <initializer_list>

#include "tests/support/moving_vectors.h"
#include "tests/support/polynomial.h"

namespace warmfront::testing {
namespace {

/// Doubles times one power of two that makes them integers.
class Integers {
 public:
  void add(double x) { exponent_ = std::max(exponent_, dyadic(x).exponent); }
  mpz_class of(double x) const {
    const Dyadic d = dyadic(x);
    mpz_class result;
    mpz_mul_2exp(result.get_mpz_t(), d.numerator.get_mpz_t(), exponent_ - d.exponent);
    return result;
  }

 private:
  unsigned long exponent_ = 0;
};

}  // namespace

ExactTruth half_space_truth(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                            double separation) {
  Integers lengths;
  Integers normals;
  lengths.add(separation);
  for (std::size_t k = 0; k < 3; ++k) {
    for (const double x : {vertex.t0[k], vertex.t1[k], half_space.point[0][k], half_space.point[1][k]})
      lengths.add(x);
    for (const auto& n : half_space.normal) normals.add(n[k]);
  }
  MovingVector n;
  MovingVector d;
  const auto moving = [](const mpz_class& from, const mpz_class& to) {
    return Polynomial({from, to - from});
  };
  for (std::size_t k = 0; k < 3; ++k) {
    n[k] = moving(normals.of(half_space.normal[0][k]), normals.of(half_space.normal[1][k]));
    d[k] = moving(lengths.of(vertex.t0[k]) - lengths.of(half_space.point[0][k]),
                  lengths.of(vertex.t1[k]) - lengths.of(half_space.point[1][k]));
  }
  const mpz_class s = lengths.of(separation);
  const Polynomial height = dot(n, d);
  const Polynomial excess = height * height - Polynomial({s * s}) * dot(n, n);

  ExactTruth truth;
  const Dyadic zero;
  if (height.sign_at(zero) <= 0 || excess.sign_at(zero) <= 0) return {true, true, true, 0};
  // What begins to hold does so at a root of either, of which neither is 0 everywhere.
  for (Root& root : roots_in_unit_interval(squarefree(height * excess))) {
    if (sign_at(height, root) > 0 && sign_at(excess, root) > 0) continue;
    truth.contact = true;
    truth.toi = double_below(root);
    truth.toi_exact = compare(dyadic(truth.toi), root) == 0;
    return truth;
  }
  return truth;
}

}  // namespace warmfront::testing
