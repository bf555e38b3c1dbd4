// SPDX-License-Identifier: Apache-2.0
// The engine's errors as this package's exceptions. With the interpreter's lock held.
#pragma once

#include <string>
#include <utility>

#include "engine/result.h"

namespace warmfront::python {

/// Becomes the exception of its code (warmfront/errors.py).
struct Raised {
  Error error;
  std::string reason;  ///< as a daemon's ErrorReason
  std::string limit;   ///< which one was met, of kResourceExhausted
};

/// `limit`: the name of what was met, if it is a limit.
Raised raised(Error error, const char* limit = "");
/// There is no memory: everything is as before.
Raised no_memory();

/// Registers the translation.
void translate_errors();

/// Of a result: its value, or its error thrown as Raised.
template <class T>
T value_of(Result<T> result, const char* limit = "") {
  if (!result) throw raised(result.error(), limit);
  return std::move(result).value();
}
inline void check(const Status& status, const char* limit = "") {
  if (!status) throw raised(status.error(), limit);
}

}  // namespace warmfront::python
