// SPDX-License-Identifier: Apache-2.0
// Filters to messages and back. Thread safety as stated in the header.
#include "proto/wire/filters.h"

#include <bit>
#include <cstring>
#include <utility>

namespace warmfront::wire {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian and bytes are copied as they are");

template <class T>
Status read(const std::string& bytes, std::vector<T>& values, const std::string& where, const char* rows,
            std::size_t row_bytes) {
  if (bytes.size() % row_bytes != 0)
    return invalid_argument(where + ": " + std::to_string(bytes.size()) + " bytes are no whole number of " +
                            rows + " of " + std::to_string(row_bytes) + " bytes");
  values.resize(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return {};
}

}  // namespace

FilterBytes bytes_of(const PairFilters& filters) {
  return {as_bytes(filters.rest_positions), as_bytes(filters.excluded_vertex_pairs),
          as_bytes(filters.patches)};
}

v1::PairFilters to_proto(const PairFilters& filters) {
  const FilterBytes bytes = bytes_of(filters);
  v1::PairFilters message;
  message.set_within_edges(filters.within_edges);
  message.set_near_at_rest(filters.near_at_rest);
  message.set_rest_positions(std::string(bytes.rest_positions));
  message.set_excluded_vertex_pairs(std::string(bytes.excluded_vertex_pairs));
  message.set_patches(std::string(bytes.patches));
  return message;
}

Result<PairFilters> filters_from(const v1::PairFilters& message, const std::string& where) {
  PairFilters filters{.within_edges = message.within_edges(), .near_at_rest = message.near_at_rest()};
  if (Status status = read(message.rest_positions(), filters.rest_positions, where + ".rest_positions",
                           "rows of 3 x float64", 3 * sizeof(double));
      !status)
    return status.error();
  if (Status status = read(message.excluded_vertex_pairs(), filters.excluded_vertex_pairs,
                           where + ".excluded_vertex_pairs", "rows of 2 x uint32", sizeof(VertexPair));
      !status)
    return status.error();
  if (Status status = read(message.patches(), filters.patches, where + ".patches", "numbers, uint32",
                           sizeof(std::uint32_t));
      !status)
    return status.error();
  return filters;
}

v1::PairFiltersHeader header_of(const PairFilters& filters) {
  v1::PairFiltersHeader header;
  header.set_within_edges(filters.within_edges);
  header.set_near_at_rest(filters.near_at_rest);
  header.set_excluded_vertex_pair_count(static_cast<std::uint32_t>(filters.excluded_vertex_pairs.size()));
  header.set_patches(!filters.patches.empty());
  return header;
}

Result<FiltersUpload> FiltersUpload::announced(const v1::PairFiltersHeader& header,
                                               std::uint32_t vertex_count) {
  FiltersUpload upload;
  upload.header_ = header;
  upload.numbers_ = {.within_edges = header.within_edges(), .near_at_rest = header.near_at_rest()};
  if (Status numbers = upload.numbers_.check_numbers(); !numbers) return numbers.error();
  const std::size_t vertices = vertex_count;
  if (header.near_at_rest() > 0)
    upload.rest_positions_ = ChunkedArray<double>("filters.rest_positions", 3 * vertices);
  upload.excluded_vertex_pairs_ =
      ChunkedArray<VertexPair>("filters.excluded_vertex_pairs", header.excluded_vertex_pair_count());
  if (header.patches()) upload.patches_ = ChunkedArray<std::uint32_t>("filters.patches", vertices);
  return upload;
}

Status FiltersUpload::add(const v1::CreateSessionRequest& request) {
  using Request = v1::CreateSessionRequest;
  switch (request.part_case()) {
    case Request::kRestPositions:
      return rest_positions_.append(request.rest_positions());
    case Request::kExcludedVertexPairs:
      return excluded_vertex_pairs_.append(request.excluded_vertex_pairs());
    case Request::kPatches:
      return patches_.append(request.patches());
    default:
      return {};
  }
}

Status FiltersUpload::complete() const {
  if (Status status = rest_positions_.complete(); !status) return status;
  if (Status status = excluded_vertex_pairs_.complete(); !status) return status;
  return patches_.complete();
}

PairFilters FiltersUpload::take() {
  PairFilters filters = std::exchange(numbers_, {});
  filters.rest_positions = rest_positions_.take();
  filters.excluded_vertex_pairs = excluded_vertex_pairs_.take();
  filters.patches = patches_.take();
  *this = {};
  return filters;
}

}  // namespace warmfront::wire
