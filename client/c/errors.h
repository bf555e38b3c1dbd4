// SPDX-License-Identifier: Apache-2.0
// Errors as codes, whose words are kept for wf_last_error(). Each thread has its own.
#pragma once

#include <exception>
#include <new>

#include "client/c/warmfront.h"
#include "engine/result.h"

namespace warmfront::c {

/// Keeps the words, and returns the code.
wf_code fail(wf_code code, const char* text) noexcept;
wf_code fail(const Error& error) noexcept;

/// f(), which returns a code, and what it throws as one.
template <class F>
wf_code guarded(F f) noexcept {
  try {
    return f();
  } catch (const std::bad_alloc&) {
    return fail(WF_RESOURCE_EXHAUSTED, "there is no memory for it now; everything is as before");
  } catch (const std::exception& error) {
    return fail(WF_INTERNAL, error.what());
  } catch (...) {
    return fail(WF_INTERNAL, "an exception without words");
  }
}

}  // namespace warmfront::c
