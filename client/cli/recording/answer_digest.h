// SPDX-License-Identifier: Apache-2.0
// A summary of an answer, to compare answers to one frame from different places. Plain values and pure
// functions.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/detect/stepper.h"
#include "client/lib/answer.h"

namespace warmfront::client {

/// Equal digests mean the same contacts in the same order, bit for bit, as far as a ContactHash tells.
struct AnswerDigest {
  std::uint64_t vf = 0;
  std::uint64_t ee = 0;
  std::uint64_t possible = 0;
  std::optional<double> earliest_toi;
  std::uint64_t contacts_hash = 0;  ///< ContactHash of the one step
  std::uint64_t vh = 0;
  friend bool operator==(const AnswerDigest&, const AnswerDigest&) = default;
};

AnswerDigest digest_of(const Answer& answer);
AnswerDigest digest_of(const StepAnswer& answer);

/// "12 vf, 3 ee, 0 vh, 0 possible, earliest toi 0.25, contacts 0123456789abcdef".
std::string describe(const AnswerDigest& digest);

}  // namespace warmfront::client
