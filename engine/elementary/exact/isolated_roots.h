// SPDX-License-Identifier: Apache-2.0
// Roots of polynomials of any degree, multiple ones or not, and signs at them. Pure functions; they allocate,
// and throw std::bad_alloc.
#pragma once

#include <functional>

#include "engine/elementary/exact/big_polynomial.h"
#include "engine/elementary/exact/exact_roots.h"

namespace warmfront::roots {

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
