// SPDX-License-Identifier: Apache-2.0
#include "engine/instructions.h"

#include <string_view>

#include "engine/simd/target_clones.h"

#define WARMFRONT_AS_TEXT(...) #__VA_ARGS__
#define WARMFRONT_EXPANDED_AS_TEXT(...) WARMFRONT_AS_TEXT(__VA_ARGS__)

namespace warmfront {
namespace {

/// The attribute that hot loops carry, as text: every name in quotes is an instruction set.
constexpr std::string_view kDispatch = WARMFRONT_EXPANDED_AS_TEXT(WARMFRONT_TARGET_CLONES);

}  // namespace

std::string instruction_sets() {
  std::string names;
  for (std::size_t at = kDispatch.find('"'); at != std::string_view::npos;) {
    const std::size_t end = kDispatch.find('"', at + 1);
    if (end == std::string_view::npos) break;
    if (!names.empty()) names += ' ';
    names += kDispatch.substr(at + 1, end - at - 1);
    at = kDispatch.find('"', end + 1);
  }
  if (names.empty()) return "baseline";
  return names;
}

bool baseline_is_faster() noexcept {
#if defined(__x86_64__)
  // The default clone computes with vectors of 32 bytes in registers of 16 (simd/halves.h says what that costs).
  return kDispatch.find("\"avx2\"") != std::string_view::npos && !__builtin_cpu_supports("avx2");
#else
  return false;
#endif
}

std::string why_instructions_are_slow() {
  if (!baseline_is_faster()) return {};
  return "this machine has no AVX2, and this program's loops for such machines take some ten times as long; "
         "one configured with -DWARMFRONT_NO_TARGET_CLONES=ON takes less than twice, as do warmfrontd and "
         "warmfront where ../libexec/warmfront is beside their folder, and Python's package where it has a "
         "folder _baseline";
}

}  // namespace warmfront
