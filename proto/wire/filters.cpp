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
using VertexPair = std::array<std::uint32_t, 2>;
static_assert(sizeof(VertexPair) == 8);

template <class T>
std::string_view as_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

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
  upload.filters_ = {.within_edges = header.within_edges(), .near_at_rest = header.near_at_rest()};
  if (Status numbers = upload.filters_.check_numbers(); !numbers) return numbers.error();
  const std::size_t vertices = vertex_count;
  if (header.near_at_rest() > 0) upload.rest_positions_.expected = 3 * sizeof(double) * vertices;
  upload.excluded_vertex_pairs_.expected = sizeof(VertexPair) * header.excluded_vertex_pair_count();
  if (header.patches()) upload.patches_.expected = sizeof(std::uint32_t) * vertices;
  return upload;
}

template <class T>
Status FiltersUpload::append(Part& part, std::vector<T>& values, std::string_view bytes, const char* field) {
  if (bytes.size() > part.expected - part.received)
    return invalid_argument("filters." + std::string(field) + ": " +
                            std::to_string(part.received + bytes.size()) + " bytes, but " +
                            std::to_string(part.expected) + " are announced");
  if (bytes.empty()) return {};
  const std::size_t end = part.received + bytes.size();
  values.resize((end + sizeof(T) - 1) / sizeof(T));
  std::memcpy(reinterpret_cast<char*>(values.data()) + part.received, bytes.data(), bytes.size());
  part.received = end;
  return {};
}

Status FiltersUpload::add(const v1::CreateSessionRequest& request) {
  using Request = v1::CreateSessionRequest;
  switch (request.part_case()) {
    case Request::kRestPositions:
      return append(rest_positions_, filters_.rest_positions, request.rest_positions(), "rest_positions");
    case Request::kExcludedVertexPairs:
      return append(excluded_vertex_pairs_, filters_.excluded_vertex_pairs, request.excluded_vertex_pairs(),
                    "excluded_vertex_pairs");
    case Request::kPatches:
      return append(patches_, filters_.patches, request.patches(), "patches");
    default:
      return {};
  }
}

Status FiltersUpload::check(const Part& part, const char* field) const {
  if (part.received == part.expected) return {};
  return invalid_argument("filters." + std::string(field) + ": the upload ended after " +
                          std::to_string(part.received) + " of " + std::to_string(part.expected) + " bytes");
}

Status FiltersUpload::complete() const {
  if (Status status = check(rest_positions_, "rest_positions"); !status) return status;
  if (Status status = check(excluded_vertex_pairs_, "excluded_vertex_pairs"); !status) return status;
  return check(patches_, "patches");
}

PairFilters FiltersUpload::take() {
  PairFilters filters = std::exchange(filters_, {});
  *this = {};
  return filters;
}

}  // namespace warmfront::wire
