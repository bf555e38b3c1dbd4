// SPDX-License-Identifier: Apache-2.0
// Many contacts, found by several threads, in their order. Parallel, inside Workers::run().
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "engine/contact.h"
#include "engine/parallel/unwritten_list.h"
#include "engine/stop.h"

namespace warmfront {

/// The order of contacts: by kind, then by the ids of their primitives. No two of a step are equal in it.
inline bool in_order(const Contact& x, const Contact& y) {
  return std::tie(x.kind, x.a, x.b) < std::tie(y.kind, y.a, y.b);
}

/// What a contact's first vertex may be, besides one that meets a face.
struct FirstFeatures {
  bool points = false;       ///< any may be of no face and no edge
  bool half_spaces = false;  ///< or meet a half-space
};

/// Replaces `to` by the contacts of all `lists`, in order, of a scene with so many vertices and edges.
/// O(contacts), plus the sorting of those of one vertex or edge; a task for each list: some thousands in each
/// are best. `room`: kept from call to call, a number for
/// 16 contacts. Throws Stopped when told to stop; `to` is unspecified then.
void gather_sorted(std::span<const std::span<const Contact>> lists, std::size_t vertices,
                   const FirstFeatures& of, std::size_t edges, UnwrittenList<Contact>& to,
                   std::vector<std::size_t>& room, StopSignal stop);

}  // namespace warmfront
