// SPDX-License-Identifier: Apache-2.0
// A counting sort by the first primitive, whose buckets are then sorted: see gather_sorted.h.
#include "engine/narrow_phase/gather_sorted.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

/// Buckets of contacts, in the contacts' order.
class Buckets {
 public:
  // About as many as there are contacts, over 16, at most.
  Buckets(std::size_t contacts, std::size_t vertices, const FirstFeatures& of, std::size_t edges) {
    // In the order of the kinds, what is first in each.
    const std::size_t of_points = of.points ? vertices : 0;
    const std::size_t of_half_spaces = of.half_spaces ? vertices : 0;
    const std::array<std::size_t, kContactKinds> firsts{vertices,  edges,     edges,
                                                        of_points, of_points, of_half_spaces};
    const std::size_t all = std::accumulate(firsts.begin(), firsts.end(), std::size_t{0});
    while (all >> shift_ > contacts / 16) ++shift_;
    for (std::size_t kind = 0; kind < kContactKinds; ++kind) {
      first_of_kind_[kind] = count_;
      count_ += (firsts[kind] >> shift_) + 1;
    }
  }
  std::size_t count() const { return count_; }
  std::size_t of(const Contact& contact) const {
    return first_of_kind_[static_cast<std::size_t>(contact.kind)] + (contact.a >> shift_);
  }

 private:
  int shift_ = 0;
  std::array<std::size_t, kContactKinds> first_of_kind_{};
  std::size_t count_ = 0;
};

std::size_t take_one(std::size_t& from) {
  return std::atomic_ref<std::size_t>(from).fetch_add(1, std::memory_order_relaxed);
}

void sort_bucket(std::span<Contact> bucket, StopSignal stop) {
  if (bucket.size() < PacedStop::kEvery)
    std::ranges::sort(bucket, in_order);
  else
    sort_in_parallel(bucket, stop, in_order);
}

}  // namespace

void gather_sorted(std::span<const std::span<const Contact>> lists, std::size_t vertices,
                   const FirstFeatures& of, std::size_t edges, UnwrittenList<Contact>& to,
                   std::vector<std::size_t>& room, StopSignal stop) {
  std::size_t contacts = 0;
  for (const std::span<const Contact> list : lists) contacts += list.size();
  const Buckets buckets(contacts, vertices, of, edges);
  const auto for_all = [&](auto&& take) {
    for_each_index(
        0, lists.size(), stop,
        [&](std::size_t i) {
          for (const Contact& contact : lists[i]) take(contact);
        },
        1);
  };
  // Where each bucket's next contact goes: at first where it begins, at last where it ends.
  std::vector<std::size_t>& next = room;
  next.clear();
  lengthen(next, buckets.count() + 1, std::size_t{0}, stop);
  for_all([&](const Contact& contact) { take_one(next[buckets.of(contact) + 1]); });
  in_pieces(1, next.size(), stop, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) next[i] += next[i - 1];
  });
  make_room(to, contacts);
  for_all([&](const Contact& contact) { to[take_one(next[buckets.of(contact)])] = contact; });
  constexpr std::size_t kBucketsAtOnce = 16;
  for_pieces(0, buckets.count(), kBucketsAtOnce, stop, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t from = i == 0 ? 0 : next[i - 1];
      sort_bucket(std::span(to).subspan(from, next[i] - from), stop);
    }
  });
}

}  // namespace warmfront
