// SPDX-License-Identifier: Apache-2.0
// Polynomials of any degree over Big, for the few pairs that nothing cheaper decides. Pure functions; they
// allocate, and throw std::bad_alloc.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/elementary/exact/big.h"
#include "engine/elementary/exact/exact_polynomial.h"

namespace warmfront::roots {

/// In ascending powers of t; the last one is not 0. None: the polynomial 0.
using Coefficients = std::vector<Big>;

template <int kDegree>
Coefficients coefficients(const Polynomial<Big, kDegree>& p) {
  Coefficients all(p.c.begin(), p.c.end());
  while (!all.empty() && all.back().sign() == 0) all.pop_back();
  return all;
}

/// -1 for the polynomial 0.
inline int degree(const Coefficients& p) {
  return static_cast<int>(p.size()) - 1;
}

inline Coefficients derivative(const Coefficients& p) {
  Coefficients result;
  for (std::size_t i = 1; i < p.size(); ++i) result.push_back(p[i] * static_cast<std::uint64_t>(i));
  return result;
}

}  // namespace warmfront::roots
