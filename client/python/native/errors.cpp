// SPDX-License-Identifier: Apache-2.0
#include "client/python/native/errors.h"

#include <pybind11/pybind11.h>

#include <exception>
#include <new>

#include "proto/wire/codes.h"

namespace warmfront::python {
namespace py = pybind11;
namespace {

void set_exception(const Raised& raised) {
  const py::object make = py::module_::import("warmfront.errors").attr("class_of");
  const py::object kind = make(wire::canonical_code(raised.error.code));
  const py::object error =
      kind(py::str(raised.error.message), py::arg("reason") = raised.reason, py::arg("limit") = raised.limit);
  PyErr_SetObject(kind.ptr(), error.ptr());
}

}  // namespace

Raised raised(Error error, const char* limit) {
  std::string reason = "INVALID_INPUT";
  std::string met;
  if (error.code == ErrorCode::kResourceExhausted) {
    reason = "LIMIT";
    met = limit;
  } else if (error.code == ErrorCode::kInternal) {
    reason = "ENGINE";
  } else if (error.code == ErrorCode::kCancelled) {
    reason = "CANCELLED";
  }
  return {std::move(error), std::move(reason), std::move(met)};
}

Raised no_memory() {
  return {{ErrorCode::kResourceExhausted,
           "there is no memory for it now; everything is as before, try a smaller scene or fewer sessions"},
          "LIMIT",
          "memory"};
}

void translate_errors() {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Raised& raised) {
      set_exception(raised);
    } catch (const std::bad_alloc&) {
      set_exception(no_memory());
    }
  });
}

}  // namespace warmfront::python
