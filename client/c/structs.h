// SPDX-License-Identifier: Apache-2.0
// The structs of the interface, which grow at their end: each is given with its size, which an older or a
// newer header may have made.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>

#include "client/c/warmfront.h"
#include "engine/result.h"

namespace warmfront::c {

wf_body initial_body();
wf_options initial_options();
wf_question initial_question();

/// A struct that claims to be larger was not initialized.
inline constexpr std::size_t kLargestStruct = 4096;

/// What a caller gave: the rest is as it is initially, where the caller's struct ends before this library's.
/// Where it goes on behind it a newer header made it, and it may ask for nothing that is not known here: all
/// bytes are 0, as initialize() leaves them (the rule of Linux' copy_struct_from_user()).
template <class T>
Result<T> read(const T* given, T initial, const char* what) {
  if (given == nullptr) return initial;
  std::size_t size = 0;
  std::memcpy(&size, given, sizeof size);
  const auto initialize_it = [&] {
    return std::to_string(size) + "; initialize the struct with wf_" + what + "_init(&it, sizeof it)";
  };
  if (size < sizeof size || size > kLargestStruct)
    return invalid_argument(std::string(what) + ".size: is " + initialize_it());
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  if (size > sizeof initial &&
      !std::all_of(bytes + sizeof initial, bytes + size, [](auto b) { return b == 0; }))
    return Error{ErrorCode::kUnimplemented,
                 std::string(what) + ": what is behind the " + std::to_string(sizeof initial) +
                     " bytes that this library, version " WARMFRONT_VERSION
                     ", knows is not 0: use a newer library, or, where size should not be " +
                     initialize_it()};
  std::memcpy(static_cast<void*>(&initial), given, std::min(size, sizeof initial));
  return initial;
}

/// Sets what a caller's struct has room for: to the value, and what is behind it, which a newer header has,
/// to 0.
template <class T>
void write(T* to, std::size_t size, const T& value) {
  const std::size_t known = std::min(size, sizeof value);
  std::memcpy(static_cast<void*>(to), &value, known);
  std::memset(reinterpret_cast<unsigned char*>(to) + known, 0, size - known);
}

/// Where the numbers of a column are, or null where it has none.
template <class T, class Column>
const T* column(const Column& values) {
  return values.empty() ? nullptr : reinterpret_cast<const T*>(values.data());
}

}  // namespace warmfront::c
