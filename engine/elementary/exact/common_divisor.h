// SPDX-License-Identifier: Apache-2.0
// Common divisors of polynomials of any degree. Pure functions; they allocate, and throw std::bad_alloc.
#pragma once

#include "engine/elementary/exact/big_polynomial.h"

namespace warmfront::roots {

/// The greatest common divisor of two polynomials of which one is not 0, times some number. By subresultants
/// (Brown, Traub 1971), whose coefficients grow linearly; most pairs are shown coprime modulo one prime.
Coefficients common_divisor(const Coefficients& a, const Coefficients& b);

/// With the same roots, each once; p is not 0.
Coefficients squarefree(const Coefficients& p);

}  // namespace warmfront::roots
