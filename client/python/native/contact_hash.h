// SPDX-License-Identifier: Apache-2.0
// engine/contact_hash.h of answers that Python holds. With the interpreter's lock held.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>

namespace warmfront::python {

/// The value of a hash that was at `before`, after an answer of these columns: of uint8, uint8, (k, 4) uint32
/// and float64, and of a reduced one uint32 and uint8, else None. Throws Raised where they have unequal
/// numbers of rows.
std::uint64_t hash_after(std::uint64_t before, const pybind11::buffer& kind, const pybind11::buffer& status,
                         const pybind11::buffer& vertices, const pybind11::buffer& toi,
                         const pybind11::object& multiplicity, const pybind11::object& stencil);

}  // namespace warmfront::python
