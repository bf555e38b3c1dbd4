// SPDX-License-Identifier: Apache-2.0
// An answer of a session in this process. Immutable once given out; its columns are its own memory, which
// arrays of numpy look at.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <optional>

#include "client/lib/answer.h"

namespace warmfront::python {

struct Answer : client::Answer {
  ContactFields fields;             ///< asked for
  bool reduced = false;             ///< asked for
  bool edge_faces = false;          ///< of intersections
  std::size_t frame_bytes = 0;      ///< of what the frame gave
  std::size_t positions_bytes = 0;  ///< of all positions
};

/// The columns in the order of warmfront.Contacts' constructor, read-only and without a copy; None for what
/// was not asked for. `owner` is the Python object of the answer, which every array keeps.
pybind11::tuple columns_of(const Answer& answer, pybind11::handle owner);

/// Declares the classes, which read as a v1.StepSummary and what is in it.
void declare_answer(pybind11::module_& module);

}  // namespace warmfront::python
