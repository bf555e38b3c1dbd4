// SPDX-License-Identifier: Apache-2.0
// Univariate polynomials with integer coefficients and their real roots, exactly: greatest common divisors,
// Sturm counts, isolating intervals, signs at algebraic numbers. For oracles: plain textbook algorithms, slow
// but simple. Values; no shared state.
#pragma once

#include <gmpxx.h>

#include <vector>

namespace warmfront::testing {

/// The number numerator / 2^exponent.
struct Dyadic {
  mpz_class numerator;
  unsigned long exponent = 0;
};

/// Exact for any finite double.
Dyadic dyadic(double x);
/// Sign of a - b.
int compare(const Dyadic& a, const Dyadic& b);
Dyadic midpoint(const Dyadic& a, const Dyadic& b);

/// Coefficients from the constant upwards, the last one not zero; none at all is the zero polynomial.
class Polynomial {
 public:
  Polynomial() = default;
  explicit Polynomial(std::vector<mpz_class> coefficients);

  bool is_zero() const { return coefficients_.empty(); }
  /// -1 for the zero polynomial.
  int degree() const { return static_cast<int>(coefficients_.size()) - 1; }
  const mpz_class& leading() const { return coefficients_.back(); }
  Polynomial derivative() const;
  /// -1, 0 or 1.
  int sign_at(const Dyadic& x) const;

  /// Divided by the greatest common divisor of the coefficients: the same signs everywhere.
  Polynomial primitive() const;

  friend Polynomial operator+(const Polynomial& a, const Polynomial& b);
  friend Polynomial operator-(const Polynomial& a, const Polynomial& b);
  friend Polynomial operator*(const Polynomial& a, const Polynomial& b);
  friend bool operator==(const Polynomial& a, const Polynomial& b) {
    return a.coefficients_ == b.coefficients_;
  }

  /// A positive multiple of the remainder of a / b; b is not zero.
  friend Polynomial remainder(Polynomial a, const Polynomial& b);
  /// q with a = q b up to a constant factor; b divides a.
  friend Polynomial quotient(Polynomial a, const Polynomial& b);

 private:
  void trim();
  std::vector<mpz_class> coefficients_;
};

/// Up to a constant factor; zero only if both are.
Polynomial gcd(Polynomial a, Polynomial b);
/// The same roots, each once.
Polynomial squarefree(const Polynomial& p);
/// Number of distinct roots in (a, b].
int count_roots(const Polynomial& p, const Dyadic& a, const Dyadic& b);

/// A root of a squarefree polynomial: the only one in (lo, hi), neither end being a root; or lo == hi, the
/// root itself.
struct Root {
  Polynomial of;
  Dyadic lo;
  Dyadic hi;

  bool is_dyadic() const { return compare(lo, hi) == 0; }
  /// Halves the interval.
  void refine();
};

/// All distinct roots in (0, 1], ascending; p is not zero.
std::vector<Root> roots_in_unit_interval(const Polynomial& p);
/// Sign of p at the root. May refine it.
int sign_at(const Polynomial& p, Root& root);
/// Sign of a - b. May refine them.
int compare(Root& a, Root& b);
/// Sign of x - root. May refine it.
int compare(const Dyadic& x, Root& root);

}  // namespace warmfront::testing
