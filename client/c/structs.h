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

/// What a caller gave, where its struct ends before this library's: the rest as it is initially.
template <class T>
Result<T> read(const T* given, T initial, const char* what) {
  if (given == nullptr) return initial;
  std::size_t size = 0;
  std::memcpy(&size, given, sizeof size);
  if (size < sizeof size)
    return invalid_argument(std::string(what) + ".size: is " + std::to_string(size) +
                            "; initialize the struct with wf_" + what + "_init(&it, sizeof it)");
  std::memcpy(static_cast<void*>(&initial), given, std::min(size, sizeof initial));
  return initial;
}

/// Where the numbers of a column are, or null where it has none.
template <class T, class Column>
const T* column(const Column& values) {
  return values.empty() ? nullptr : reinterpret_cast<const T*>(values.data());
}

}  // namespace warmfront::c
