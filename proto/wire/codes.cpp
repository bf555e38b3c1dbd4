// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/codes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace warmfront::wire {
namespace {

// In the order of ErrorCode.
constexpr std::array<std::pair<ErrorCode, int>, 14> kCodes{{
    {ErrorCode::kInvalidArgument, 3},
    {ErrorCode::kFailedPrecondition, 9},
    {ErrorCode::kResourceExhausted, 8},
    {ErrorCode::kUnimplemented, 12},
    {ErrorCode::kCancelled, 1},
    {ErrorCode::kInternal, 13},
    {ErrorCode::kDataLoss, 15},
    {ErrorCode::kNotFound, 5},
    {ErrorCode::kAlreadyExists, 6},
    {ErrorCode::kAborted, 10},
    {ErrorCode::kDeadlineExceeded, 4},
    {ErrorCode::kUnauthenticated, 16},
    {ErrorCode::kPermissionDenied, 7},
    {ErrorCode::kUnavailable, 14},
}};
static_assert([] {
  for (std::size_t i = 0; i < kCodes.size(); ++i)
    if (kCodes[i].first != static_cast<ErrorCode>(i)) return false;
  return kCodes.size() == static_cast<std::size_t>(ErrorCode::kUnavailable) + 1;
}());

constexpr int kOutOfRange = 11;

}  // namespace

int canonical_code(ErrorCode code) {
  return kCodes[static_cast<std::size_t>(code)].second;
}

ErrorCode error_code(int canonical) {
  if (canonical == kOutOfRange) return ErrorCode::kInvalidArgument;
  const auto found = std::ranges::find(kCodes, canonical, &std::pair<ErrorCode, int>::second);
  return found == kCodes.end() ? ErrorCode::kInternal : found->first;
}

const char* canonical_name(int canonical) {
  constexpr std::array kNames{
      "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
      "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
      "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
      "DATA_LOSS", "UNAUTHENTICATED"};
  const auto index = static_cast<std::size_t>(canonical);
  return index < kNames.size() ? kNames[index] : "UNKNOWN";
}

}  // namespace warmfront::wire
