// SPDX-License-Identifier: Apache-2.0
#include "tests/support/polynomial.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace warmfront::testing {
namespace {

mpz_class shifted(const mpz_class& x, unsigned long by) {
  mpz_class result;
  mpz_mul_2exp(result.get_mpz_t(), x.get_mpz_t(), by);
  return result;
}

// p, p', and the negated remainders of each by the next.
std::vector<Polynomial> sturm_chain(const Polynomial& p) {
  std::vector<Polynomial> chain{p, p.derivative()};
  while (!chain.back().is_zero()) {
    chain.push_back(Polynomial() - remainder(chain[chain.size() - 2], chain.back()).primitive());
  }
  chain.pop_back();
  return chain;
}

int sign_changes(const std::vector<Polynomial>& chain, const Dyadic& x) {
  int changes = 0;
  int last = 0;
  for (const Polynomial& p : chain) {
    const int sign = p.sign_at(x);
    if (sign == 0) continue;
    changes += last != 0 && sign != last;
    last = sign;
  }
  return changes;
}

// The roots in (lo, hi], of which there are `count`.
void isolate(const Polynomial& p, const std::vector<Polynomial>& chain, const Dyadic& lo, int changes_lo,
             const Dyadic& hi, int changes_hi, std::vector<Root>& roots) {
  const int count = changes_lo - changes_hi;
  if (count == 0) return;
  if (count == 1) {
    if (p.sign_at(hi) == 0) {
      roots.push_back({p, hi, hi});
      return;
    }
    if (p.sign_at(lo) != 0) {
      roots.push_back({p, lo, hi});
      return;
    }
  }
  const Dyadic middle = midpoint(lo, hi);
  const int changes = sign_changes(chain, middle);
  isolate(p, chain, lo, changes_lo, middle, changes, roots);
  isolate(p, chain, middle, changes, hi, changes_hi, roots);
}

}  // namespace

Dyadic dyadic(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);
  Dyadic result{mpz_class(std::ldexp(mantissa, 53)), 0};
  exponent -= 53;
  if (exponent >= 0) {
    result.numerator = shifted(result.numerator, static_cast<unsigned long>(exponent));
  } else {
    result.exponent = static_cast<unsigned long>(-exponent);
  }
  return result;
}

int compare(const Dyadic& a, const Dyadic& b) {
  const unsigned long exponent = std::max(a.exponent, b.exponent);
  return cmp(shifted(a.numerator, exponent - a.exponent), shifted(b.numerator, exponent - b.exponent));
}

Dyadic midpoint(const Dyadic& a, const Dyadic& b) {
  const unsigned long exponent = std::max(a.exponent, b.exponent);
  return {shifted(a.numerator, exponent - a.exponent) + shifted(b.numerator, exponent - b.exponent),
          exponent + 1};
}

Polynomial::Polynomial(std::vector<mpz_class> coefficients) : coefficients_(std::move(coefficients)) {
  trim();
}

void Polynomial::trim() {
  while (!coefficients_.empty() && coefficients_.back() == 0) coefficients_.pop_back();
}

Polynomial Polynomial::derivative() const {
  std::vector<mpz_class> result;
  for (std::size_t k = 1; k < coefficients_.size(); ++k) result.push_back(coefficients_[k] * mpz_class(k));
  return Polynomial(std::move(result));
}

int Polynomial::sign_at(const Dyadic& x) const {
  // Horner's rule, every step scaled by 2^exponent: sum c_k n^k 2^(e (degree - k)).
  mpz_class value = 0;
  unsigned long scale = 0;
  for (auto c = coefficients_.rbegin(); c != coefficients_.rend(); ++c) {
    value = value * x.numerator + shifted(*c, scale);
    scale += x.exponent;
  }
  return sgn(value);
}

Polynomial Polynomial::primitive() const {
  mpz_class content = 0;
  for (const mpz_class& c : coefficients_) content = gcd(content, c);
  Polynomial result = *this;
  for (mpz_class& c : result.coefficients_) {
    mpz_divexact(c.get_mpz_t(), c.get_mpz_t(), content.get_mpz_t());
  }
  return result;
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  std::vector<mpz_class> sum(std::max(a.coefficients_.size(), b.coefficients_.size()));
  for (std::size_t k = 0; k < a.coefficients_.size(); ++k) sum[k] += a.coefficients_[k];
  for (std::size_t k = 0; k < b.coefficients_.size(); ++k) sum[k] += b.coefficients_[k];
  return Polynomial(std::move(sum));
}

Polynomial operator-(const Polynomial& a, const Polynomial& b) {
  std::vector<mpz_class> difference(std::max(a.coefficients_.size(), b.coefficients_.size()));
  for (std::size_t k = 0; k < a.coefficients_.size(); ++k) difference[k] += a.coefficients_[k];
  for (std::size_t k = 0; k < b.coefficients_.size(); ++k) difference[k] -= b.coefficients_[k];
  return Polynomial(std::move(difference));
}

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  if (a.is_zero() || b.is_zero()) return {};
  std::vector<mpz_class> product(a.coefficients_.size() + b.coefficients_.size() - 1);
  for (std::size_t i = 0; i < a.coefficients_.size(); ++i) {
    for (std::size_t j = 0; j < b.coefficients_.size(); ++j) {
      product[i + j] += a.coefficients_[i] * b.coefficients_[j];
    }
  }
  return Polynomial(std::move(product));
}

Polynomial remainder(Polynomial a, const Polynomial& b) {
  const mpz_class scale = abs(b.leading());
  while (a.degree() >= b.degree()) {
    const mpz_class factor = sgn(b.leading()) * a.leading();
    const std::size_t shift = a.coefficients_.size() - b.coefficients_.size();
    for (mpz_class& c : a.coefficients_) c *= scale;
    for (std::size_t k = 0; k < b.coefficients_.size(); ++k)
      a.coefficients_[k + shift] -= factor * b.coefficients_[k];
    a.trim();
  }
  return a;
}

Polynomial quotient(Polynomial a, const Polynomial& b) {
  if (a.degree() < b.degree()) return {};
  std::vector<mpz_class> result(static_cast<std::size_t>(a.degree() - b.degree() + 1));
  while (a.degree() >= b.degree()) {
    const mpz_class factor = a.leading();
    const std::size_t shift = a.coefficients_.size() - b.coefficients_.size();
    for (mpz_class& c : a.coefficients_) c *= b.leading();
    for (mpz_class& c : result) c *= b.leading();
    result[shift] += factor;
    for (std::size_t k = 0; k < b.coefficients_.size(); ++k)
      a.coefficients_[k + shift] -= factor * b.coefficients_[k];
    a.trim();
  }
  return Polynomial(std::move(result)).primitive();
}

Polynomial gcd(Polynomial a, Polynomial b) {
  while (!b.is_zero()) {
    Polynomial r = remainder(std::move(a), b).primitive();
    a = std::move(b);
    b = std::move(r);
  }
  return a.primitive();
}

Polynomial squarefree(const Polynomial& p) {
  if (p.degree() < 1) return p;
  const Polynomial common = gcd(p, p.derivative());
  return common.degree() < 1 ? p.primitive() : quotient(p, common);
}

int count_roots(const Polynomial& p, const Dyadic& a, const Dyadic& b) {
  // Sturm's theorem in this form holds at ends that are roots, too, if all roots are simple.
  const std::vector<Polynomial> chain = sturm_chain(squarefree(p));
  return sign_changes(chain, a) - sign_changes(chain, b);
}

void Root::refine() {
  if (is_dyadic()) return;
  const Dyadic middle = midpoint(lo, hi);
  const int sign = of.sign_at(middle);
  if (sign == 0) {
    lo = hi = middle;
  } else {
    (sign == of.sign_at(lo) ? lo : hi) = middle;
  }
}

std::vector<Root> roots_in_unit_interval(const Polynomial& p) {
  std::vector<Root> roots;
  if (p.degree() < 1) return roots;
  const Polynomial simple = squarefree(p);
  const std::vector<Polynomial> chain = sturm_chain(simple);
  const Dyadic zero{0, 0};
  const Dyadic one{1, 0};
  isolate(simple, chain, zero, sign_changes(chain, zero), one, sign_changes(chain, one), roots);
  return roots;
}

int sign_at(const Polynomial& p, Root& root) {
  if (p.is_zero()) return 0;
  if (root.is_dyadic()) return p.sign_at(root.lo);
  // A common divisor's roots are roots of root.of: at most one in the interval, a simple one.
  const Polynomial common = gcd(p, root.of);
  if (common.degree() >= 1 && common.sign_at(root.lo) != common.sign_at(root.hi)) return 0;
  const std::vector<Polynomial> chain = sturm_chain(squarefree(p));
  while (!root.is_dyadic()) {
    const int sign = p.sign_at(root.lo);
    if (sign != 0 && sign_changes(chain, root.lo) == sign_changes(chain, root.hi)) return sign;
    root.refine();
  }
  return p.sign_at(root.lo);
}

int compare(const Dyadic& x, Root& root) {
  if (root.is_dyadic()) return compare(x, root.lo);
  if (compare(x, root.lo) <= 0) return -1;
  if (compare(x, root.hi) >= 0) return 1;
  const int sign = root.of.sign_at(x);
  if (sign == 0) {
    root.lo = root.hi = x;
    return 0;
  }
  const bool below = sign == root.of.sign_at(root.lo);
  (below ? root.lo : root.hi) = x;
  return below ? -1 : 1;
}

int compare(Root& a, Root& b) {
  if (a.is_dyadic()) return compare(a.lo, b);
  if (b.is_dyadic()) return -compare(b.lo, a);
  // Equal if, and only if, a root that both polynomials have lies in both intervals.
  const Polynomial common = gcd(a.of, b.of);
  for (;;) {
    if (a.is_dyadic() || b.is_dyadic()) return compare(a, b);
    if (compare(a.hi, b.lo) <= 0) return -1;
    if (compare(b.hi, a.lo) <= 0) return 1;
    if (common.degree() >= 1) {
      const Dyadic& lo = compare(a.lo, b.lo) > 0 ? a.lo : b.lo;
      const Dyadic& hi = compare(a.hi, b.hi) < 0 ? a.hi : b.hi;
      if (common.sign_at(lo) * common.sign_at(hi) < 0) return 0;
    }
    a.refine();
    b.refine();
  }
}

}  // namespace warmfront::testing
