// SPDX-License-Identifier: Apache-2.0
#include "client/python/native/contact_hash.h"

#include <array>
#include <vector>

#include "client/python/native/errors.h"
#include "client/python/native/reading.h"
#include "engine/contact_hash.h"

namespace warmfront::python {
namespace py = pybind11;

std::uint64_t hash_after(std::uint64_t before, const py::buffer& kind, const py::buffer& status,
                         const py::buffer& vertices, const py::buffer& toi, const py::object& multiplicity,
                         const py::object& stencil) {
  // Copies: what a message brought may be unaligned.
  const auto kinds = rows_of<std::uint8_t>(kind), statuses = rows_of<std::uint8_t>(status);
  const auto corners = rows_of<std::array<std::uint32_t, 4>>(vertices);
  const auto times = rows_of<double>(toi);
  std::vector<std::uint32_t> merged;
  std::vector<std::uint8_t> closest;
  if (!multiplicity.is_none()) {
    merged = rows_of<std::uint32_t>(multiplicity.cast<py::buffer>());
    closest = rows_of<std::uint8_t>(stencil.cast<py::buffer>());
  }
  const std::size_t rows = kinds.size();
  if (statuses.size() != rows || corners.size() != rows || times.size() != rows ||
      (!multiplicity.is_none() && (merged.size() != rows || closest.size() != rows)))
    throw raised(invalid_argument("answers: columns of unequal length"));
  const py::gil_scoped_release unlocked;
  ContactHash hash(before);
  hash.begin_step(rows);
  for (std::size_t i = 0; i < rows; ++i)
    hash.add(static_cast<ContactKind>(kinds[i]), static_cast<ContactStatus>(statuses[i]), corners[i],
             times[i]);
  for (std::size_t i = 0; i < merged.size(); ++i) hash.add_closest_pair({merged[i], closest[i]});
  return hash.value();
}

}  // namespace warmfront::python
