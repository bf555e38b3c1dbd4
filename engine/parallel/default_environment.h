// SPDX-License-Identifier: Apache-2.0
// The floating-point environment that error bounds are derived for: round to nearest, nothing flushed to zero, no
// traps. A linked library may have changed a thread's own.
#pragma once

#include <fenv.h>

#include <limits>

namespace warmfront {

/// Sets the default environment for the calling thread, and restores its own at the end.
class DefaultEnvironment {
 public:
  enum class Set {
    kAlways,
    kWhereItIsNot,  ///< looks first: cheap beside setting it, and for work that is short
  };
  explicit DefaultEnvironment(Set set = Set::kAlways) : changed_(set == Set::kAlways || !is_default()) {
    if (!changed_) return;
    fegetenv(&saved_);
    fesetenv(FE_DFL_ENV);
  }
  ~DefaultEnvironment() {
    if (changed_) fesetenv(&saved_);
  }
  DefaultEnvironment(const DefaultEnvironment&) = delete;
  DefaultEnvironment& operator=(const DefaultEnvironment&) = delete;

 private:
  // A denormal result would be flushed, a denormal operand read as zero, and a sum rounded one way or the
  // other. The sums are inexact: a trap must be looked for before.
  static bool is_default() {
    if (fegetexcept() != 0) return false;
    const volatile double least = std::numeric_limits<double>::min();
    const volatile double denormal = std::numeric_limits<double>::denorm_min();
    const volatile double one = 1;
    const volatile double little = 0x1p-60;
    return least / 2 != 0 && denormal * 0x1p53 != 0 && one + little == one && one - little == one;
  }

  const bool changed_;
  fenv_t saved_{};
};

}  // namespace warmfront
