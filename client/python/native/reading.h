// SPDX-License-Identifier: Apache-2.0
// The wire's messages, as Python has them, to the engine's values: what proto/wire does for C++. Python has
// checked types and names by then; so this module needs no Protocol Buffers, of which a process with two
// copies may not be fond. With the interpreter's lock held.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstdint>
#include <vector>

#include "engine/frame.h"
#include "engine/options.h"
#include "engine/pair_filters.h"
#include "engine/question.h"
#include "engine/scene.h"

namespace warmfront::python {

/// Of a v1.ColliderOptions.
ColliderOptions options_of(pybind11::handle message);
/// Of a v1.Question.
Question question_of(pybind11::handle message);
/// Of a v1.Body, which errors call `where`. Throws Raised for a name that is too long.
Body body_of(pybind11::handle message, const std::string& where);
/// Of repeated v1.BodyPair.
std::vector<std::array<std::uint32_t, 2>> body_pairs_of(pybind11::handle pairs);
/// Of a v1.PairFilters.
PairFilters filters_of(pybind11::handle message);
/// Of a v1.SceneChange whose positions are float32 or float64.
SceneChange change_of(pybind11::handle message, bool float32);

/// Values in force, into a v1.ColliderOptions and a v1.SessionInfo.Filters.
void tell(const ColliderOptions& options, pybind11::handle message);
void tell(const PairFilters& filters, pybind11::handle message);

/// The numbers of a C-contiguous buffer of float32 or float64, where they are.
Positions positions_of(const pybind11::buffer_info& info);

/// A copy of a buffer, as rows of such.
template <class Row>
std::vector<Row> rows_of(const pybind11::buffer& buffer) {
  const pybind11::buffer_info info = buffer.request();
  std::vector<Row> rows(static_cast<std::size_t>(info.size * info.itemsize) / sizeof(Row));
  const auto* first = static_cast<const char*>(info.ptr);
  std::copy(first, first + rows.size() * sizeof(Row), reinterpret_cast<char*>(rows.data()));
  return rows;
}

}  // namespace warmfront::python
