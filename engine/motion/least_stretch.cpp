// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/least_stretch.h"

#include <cstddef>

namespace warmfront {
namespace {

/// More than kLeastStretch by what rounding takes, and what the rotation that is compared with is off.
constexpr double kAlong = 0.705;
/// How far that is off: of Q^T Q, in each entry. |Q v|^2 < 1 + 3 * 2^-10 then, and kAlong / |Q v| > 0.7039.
constexpr double kOrthonormal = 0x1p-10;
/// Of determinants of entries below 16, which are off by less than 2^-36.
constexpr double kPositive = 0x1p-30;
/// From a least stretch of a half to kOrthonormal.
constexpr int kIterations = 4;

// a^T b.
LinearMap transposed_times(const LinearMap& a, const LinearMap& b) {
  LinearMap product{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      for (std::size_t k = 0; k < 3; ++k) product[3 * row + column] += a[3 * k + row] * b[3 * k + column];
    }
  }
  return product;
}

// The matrix of cofactors: the inverse's transpose, times the determinant.
LinearMap cofactors(const LinearMap& m) {
  return {m[4] * m[8] - m[5] * m[7], m[5] * m[6] - m[3] * m[8], m[3] * m[7] - m[4] * m[6],
          m[7] * m[2] - m[8] * m[1], m[8] * m[0] - m[6] * m[2], m[6] * m[1] - m[7] * m[0],
          m[1] * m[5] - m[2] * m[4], m[2] * m[3] - m[0] * m[5], m[0] * m[4] - m[1] * m[3]};
}

double determinant(const LinearMap& m, const LinearMap& cofactor) {
  return m[0] * cofactor[0] + m[1] * cofactor[1] + m[2] * cofactor[2];
}

// Is v . m v > 0 for all v other than 0? By the leading minors of the symmetric part (Sylvester).
bool positive(const LinearMap& m) {
  LinearMap s;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column)
      s[3 * row + column] = 0.5 * (m[3 * row + column] + m[3 * column + row]);
  }
  return s[0] > kPositive && s[0] * s[4] - s[1] * s[3] > kPositive &&
         determinant(s, cofactors(s)) > kPositive;
}

LinearMap less(LinearMap m, double diagonal) {
  for (std::size_t k = 0; k < 9; k += 4) m[k] -= diagonal;
  return m;
}

// Newton's iteration for the rotation nearest to m. False where that takes longer, or there is none.
bool nearest_rotation(LinearMap& m) {
  for (int i = 0; i < kIterations; ++i) {
    const LinearMap cofactor = cofactors(m);
    const double volume = determinant(m, cofactor);
    if (!(volume > 0.0625)) return false;
    for (std::size_t k = 0; k < 9; ++k) m[k] = 0.5 * (m[k] + cofactor[k] / volume);
  }
  const LinearMap off = less(transposed_times(m, m), 1);
  for (const double x : off) {
    if (!(x > -kOrthonormal && x < kOrthonormal)) return false;
  }
  return true;
}

}  // namespace

// With a rotation Q near the middle: v . Q^T A v is at least a |v|^2 for all v where that is positive for
// Q^T A - a. It is linear in A, so it is at least that between two A, too, and |A v| >= v . Q^T A v / |Q v|.
bool remains_spread(const LinearMap& from, const LinearMap& to) {
  LinearMap middle;
  for (std::size_t k = 0; k < 9; ++k) {
    if (!(from[k] > -2 && from[k] < 2 && to[k] > -2 && to[k] < 2)) return false;
    middle[k] = 0.5 * (from[k] + to[k]);
  }
  if (!nearest_rotation(middle)) return false;
  for (const LinearMap& end : {from, to}) {
    if (!positive(less(transposed_times(middle, end), kAlong))) return false;
    LinearMap room = less(transposed_times(end, end), kMostStretch * kMostStretch);
    for (double& x : room) x = -x;
    if (!positive(room)) return false;
  }
  return true;
}

}  // namespace warmfront
