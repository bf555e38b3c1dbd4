// SPDX-License-Identifier: Apache-2.0
// Pair filters on the wire: as one message, and as what an upload announces and then brings in chunks.
// Functions are thread-safe; a FiltersUpload is used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/pair_filters.h"
#include "engine/result.h"
#include "proto/wire/chunked_array.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::wire {

using VertexPair = std::array<std::uint32_t, 2>;
static_assert(sizeof(VertexPair) == 8);

v1::PairFilters to_proto(const PairFilters& filters);
/// Values are checked by Scene. kInvalidArgument, with a message that begins with `where`, for bytes that are
/// no whole number of rows.
Result<PairFilters> filters_from(const v1::PairFilters& message, const std::string& where);

/// What an upload announces of them.
v1::PairFiltersHeader header_of(const PairFilters& filters);

/// Bytes of the filters' arrays, as they travel.
struct FilterBytes {
  std::string_view rest_positions;
  std::string_view excluded_vertex_pairs;
  std::string_view patches;
};
/// Valid as long as the filters, unchanged.
FilterBytes bytes_of(const PairFilters& filters);

/// Calls `send` with each message of an upload that brings arrays of the filters, `chunk` bytes at most in
/// each; stops, and returns false, where `send` does.
template <class Send>
bool upload(const PairFilters& filters, std::size_t chunk, Send send) {
  using Request = v1::CreateSessionRequest;
  const FilterBytes bytes = bytes_of(filters);
  return send_chunks(bytes.rest_positions, chunk, send,
                     [](Request& to, std::string piece) { to.set_rest_positions(std::move(piece)); }) &&
         send_chunks(
             bytes.excluded_vertex_pairs, chunk, send,
             [](Request& to, std::string piece) { to.set_excluded_vertex_pairs(std::move(piece)); }) &&
         send_chunks(bytes.patches, chunk, send,
                     [](Request& to, std::string piece) { to.set_patches(std::move(piece)); });
}

/// Filters as they are uploaded, put together.
class FiltersUpload {
 public:
  FiltersUpload() = default;  ///< none were announced
  /// kInvalidArgument for numbers out of range.
  static Result<FiltersUpload> announced(const v1::PairFiltersHeader& header, std::uint32_t vertex_count);

  /// Takes a chunk, if the message brings one of the filters' arrays. kInvalidArgument for bytes beyond what
  /// was announced, of which nothing is taken. Memory grows with what arrives, never with what was announced.
  Status add(const v1::CreateSessionRequest& request);
  /// kInvalidArgument unless everything announced is there.
  Status complete() const;
  /// Once complete; leaves none.
  PairFilters take();

  /// Announced.
  const v1::PairFiltersHeader& header() const { return header_; }

 private:
  v1::PairFiltersHeader header_;
  PairFilters numbers_;
  ChunkedArray<double> rest_positions_{"filters.rest_positions"};
  ChunkedArray<VertexPair> excluded_vertex_pairs_{"filters.excluded_vertex_pairs"};
  ChunkedArray<std::uint32_t> patches_{"filters.patches"};
};

}  // namespace warmfront::wire
