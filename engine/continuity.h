// SPDX-License-Identifier: Apache-2.0
// Which rows of an answer were there in an earlier one: what friction and warm-started multipliers are
// carried over by. Pure functions of two answers, with no state of a collider or a daemon behind them, so
// that neither warmth nor a resume changes them. Thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/contact.h"

namespace warmfront {

/// Of the rows of a present answer and an earlier one.
struct Continuity {
  static constexpr std::size_t kNew = ~std::size_t{0};

  /// Of each present row: where the same row is in the earlier answer, or kNew.
  std::vector<std::size_t> earlier;
  /// The earlier rows that are not there any more, ascending.
  std::vector<std::size_t> ended;

  friend bool operator==(const Continuity&, const Continuity&) = default;
};

/// A row is the same where its kind and features are; status, time and fields do not count. Contacts as an
/// answer has them, sorted: one merge, O(rows). Bodies that are added or described otherwise leave the
/// numbers of what was there, so that rows are compared as ever; where elements or bodies are replaced
/// (ReplaceBody) numbers are others, and no answer from before can be compared with one after. Of reduced
/// answers use the other form: the first row of a closest pair may be another one, though the pair stays.
Continuity continuity(std::span<const Contact> earlier, std::span<const Contact> now);

/// The rows of an answer by their vertices, as the columns of a client, and Scene::vertices_of(), tell them.
struct RowVertices {
  std::span<const ContactKind> kind;
  std::span<const std::array<std::uint32_t, 4>> vertices;
  std::span<const std::uint8_t> stencil = {};  ///< of a reduced answer
};

/// The same by vertices: rows are the same where kind and vertices are, in their order (of several such rows,
/// as of faces that are given twice, the first and the first, and so on). Of reduced answers, both, where the
/// vertices of their closest pairs are, whichever row stands for these. O(rows log rows). The columns of an
/// answer have equal length.
Continuity continuity(const RowVertices& earlier, const RowVertices& now);

}  // namespace warmfront
