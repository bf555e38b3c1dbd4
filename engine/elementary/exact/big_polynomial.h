// SPDX-License-Identifier: Apache-2.0
// Polynomials of any degree over Big, with multiple roots or without: common divisors, isolated roots, and
// signs at them. For the few pairs that nothing cheaper decides. Pure functions; they allocate, and throw
// std::bad_alloc.
#pragma once

#include <functional>
#include <vector>

#include "engine/elementary/exact/big.h"
#include "engine/elementary/exact/exact_polynomial.h"
#include "engine/elementary/exact/exact_roots.h"

namespace warmfront::roots {

/// In ascending powers of t; the last one is not 0. None: the polynomial 0.
using Coefficients = std::vector<Big>;

template <int kDegree>
Coefficients coefficients(const Polynomial<Big, kDegree>& p) {
  Coefficients all(p.c.begin(), p.c.end());
  while (!all.empty() && all.back().sign() == 0) all.pop_back();
  return all;
}

/// The greatest common divisor of two polynomials of which one is not 0, times some number. By subresultants
/// (Brown, Traub 1971), whose coefficients grow linearly; most pairs are shown coprime modulo one prime.
Coefficients common_divisor(const Coefficients& a, const Coefficients& b);

/// With the same roots, each once; p is not 0.
Coefficients squarefree(const Coefficients& p);

/// A root of a squarefree f: the only one in (begin, end), neither of which is one; or begin = end, the root.
struct IsolatedRoot {
  BigDyadic begin;
  BigDyadic end;
  bool is_dyadic;
};

/// Calls visit(root) for the roots in [begin, end], within [0, 1], in ascending order until it returns false.
/// f is squarefree. By Descartes' rule for Bernstein coefficients and bisection (Collins, Akritas 1976); two
/// roots that stay together are separated at the derivative's root between them.
void isolate_roots(const Coefficients& f, const BigDyadic& begin, const BigDyadic& end,
                   const std::function<bool(const IsolatedRoot&)>& visit);

/// The largest double not above the root of f.
double floor_of_root(const Coefficients& f, const IsolatedRoot& root);

/// The sign of g at the root of f.
int sign_at_root(const Coefficients& f, const IsolatedRoot& root, const Coefficients& g);

}  // namespace warmfront::roots
