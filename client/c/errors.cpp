// SPDX-License-Identifier: Apache-2.0
#include "client/c/errors.h"

#include <cstdio>

#include "proto/wire/codes.h"

namespace warmfront::c {
namespace {

// Of a fixed size, so that there is always room to say that there is no memory.
thread_local char last_error[2048] = "";

}  // namespace

wf_code fail(wf_code code, const char* text) noexcept {
  static_cast<void>(std::snprintf(last_error, sizeof last_error, "%s", text));
  return code;
}
wf_code fail(const Error& error) noexcept {
  return fail(wire::canonical_code(error.code), error.message.c_str());
}

}  // namespace warmfront::c

const char* wf_last_error(void) {
  return warmfront::c::last_error;
}
