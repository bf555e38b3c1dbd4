// SPDX-License-Identifier: Apache-2.0
#include "engine/step/reduced_rows.h"

#include <algorithm>
#include <array>
#include <span>
#include <tuple>
#include <utility>

#include "engine/elementary/contact_geometry.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {
namespace {

// Lists are of some rows each, fewer than this on average.
constexpr std::size_t kListsAtOnce = 512;

std::uint8_t stencil_of(const ClosestPlace& place) {
  if (place.parallel) return 0b1111;
  std::uint8_t stencil = 0;
  for (int k = 0; k < 4; ++k)
    if (place.weights[k] != 0) stencil |= static_cast<std::uint8_t>(1 << k);
  return stencil;
}

}  // namespace

void ReducedRows::run(Core& core, StopSignal stop) {
  FoundPairs& found = core.found();
  found.closest_pairs.clear();
  if (!core.options.reduced || found.contacts.empty()) return;
  find_closest(core, stop);
  list_shared(core.scene->vertex_count(), stop);
  count(found.closest_pairs, stop);
  keep_first(found, stop);
}

void ReducedRows::find_closest(Core& core, StopSignal stop) {
  FoundPairs& found = core.found();
  const std::span<const Contact> contacts = found.contacts;
  const std::span<const VertexMotion> vertices = core.motion.vertices().vertices();
  const Renumbering& numbering = core.topology->numbering;
  shared_.clear();
  lengthen(shared_, contacts.size(), Shared(), stop);
  lengthen(found.closest_pairs, contacts.size(), ClosestPair(), stop);
  for_each_index(0, contacts.size(), stop, [&](std::size_t i) {
    const Contact& contact = contacts[i];
    if (contact.kind == ContactKind::kVertexHalfSpace) {
      found.closest_pairs[i].stencil = 0b0001;  // no other row has the same
      return;
    }
    std::array<const VertexMotion*, 4> four;
    const auto ids = core.scene->vertices_of(contact);
    for (int k = 0; k < 4; ++k) four[k] = &vertices[number_of(numbering.renumbered(GivenVertex{ids[k]}))];
    const std::uint8_t stencil = stencil_of(closest_place(contact.kind, four, contact.toi));
    found.closest_pairs[i].stencil = stencil;
    shared_[i] = shared_by(*core.scene, contact, stencil);
  });
}

ReducedRows::Shared ReducedRows::shared_by(const Scene& scene, const Contact& contact, std::uint8_t stencil) {
  if (stencil == 0b1111) return {};
  const std::array<std::uint32_t, 4> v = scene.vertices_of(contact);
  std::array<std::uint32_t, 4> of{};  // the stencil's vertices
  int size = 0;
  for (int k = 0; k < 4; ++k)
    if ((stencil >> k & 1) != 0) of[size++] = v[k];
  if (size == 2) {
    const auto [lesser, greater] = std::minmax(of[0], of[1]);
    return {2 * lesser, greater};
  }
  if (contact.kind == ContactKind::kVertexFace) {
    // The side opposite the corner k that is left out: sides go from corners 0, 1 and 2 to the next.
    const int corner = (stencil & 0b0010) == 0 ? 0 : (stencil & 0b0100) == 0 ? 1 : 2;
    return {2 * v[0] + 1, scene.face_edges()[contact.b][(corner + 1) % 3]};
  }
  const bool edge_a = (stencil & 0b0011) == 0b0011;
  return {2 * (edge_a ? of[2] : of[0]) + 1, edge_a ? contact.a : contact.b};
}

// A counting sort, in which the rows of each list stay in order.
void ReducedRows::list_shared(std::uint32_t vertices, StopSignal stop) {
  begin_.clear();
  lengthen(begin_, std::size_t{2} * vertices + 2, std::uint32_t{0}, stop);
  std::size_t listed = 0;
  in_pieces(0, shared_.size(), stop, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      if (shared_[i].list == kNone) continue;
      ++begin_[std::size_t{shared_[i].list} + 2];
      ++listed;
    }
  });
  in_pieces(1, begin_.size(), stop, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) begin_[i] += begin_[i - 1];
  });
  listed_.clear();
  lengthen(listed_, listed, Listed{0, 0}, stop);
  in_pieces(0, shared_.size(), stop, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const Shared& shared = shared_[i];
      if (shared.list == kNone) continue;
      listed_[begin_[std::size_t{shared.list} + 1]++] = {shared.other, static_cast<std::uint32_t>(i)};
    }
  });
}

// Of rows with the same closest pair the first gets their number, the others 0.
void ReducedRows::count(std::vector<ClosestPair>& pairs, StopSignal stop) {
  const auto in_order = [](const Listed& x, const Listed& y) {
    return std::tie(x.other, x.row) < std::tie(y.other, y.row);
  };
  constexpr std::size_t kMany = PacedStop::kEvery;
  const auto count_list = [&](std::span<Listed> rows) {
    if (rows.size() < kMany)
      std::ranges::sort(rows, in_order);
    else
      sort_in_parallel(rows, stop, in_order);
    for (std::size_t first = 0; first < rows.size();) {
      std::size_t end = first + 1;
      for (; end < rows.size() && rows[end].other == rows[first].other; ++end)
        pairs[rows[end].row].multiplicity = 0;
      pairs[rows[first].row].multiplicity = static_cast<std::uint32_t>(end - first);
      first = end;
    }
  };
  for_pieces(0, begin_.size() - 2, kListsAtOnce, stop, [&](std::size_t from, std::size_t to) {
    std::size_t since_check = 0;
    for (std::size_t list = from; list < to; ++list) {
      const std::span<Listed> rows(listed_.data() + begin_[list], listed_.data() + begin_[list + 1]);
      if (rows.size() < 2) continue;
      count_list(rows);
      since_check += rows.size();
      if (since_check < kMany) continue;
      since_check = 0;
      stop.check();
    }
  });
}

void ReducedRows::keep_first(FoundPairs& found, StopSignal stop) {
  UnwrittenList<Contact>& contacts = found.contacts;
  std::vector<ClosestPair>& pairs = found.closest_pairs;
  std::size_t kept = 0;
  in_pieces(0, contacts.size(), stop, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      if (pairs[i].multiplicity == 0) continue;
      contacts[kept] = contacts[i];
      pairs[kept++] = pairs[i];
    }
  });
  contacts.erase(contacts.begin() + static_cast<std::ptrdiff_t>(kept), contacts.end());
  pairs.erase(pairs.begin() + static_cast<std::ptrdiff_t>(kept), pairs.end());
}

std::size_t ReducedRows::memory_bytes() const {
  return held_bytes(shared_, begin_, listed_);
}

}  // namespace warmfront
