// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/fill_blocks.h"

#include <utility>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

constexpr std::uint32_t kNone = 0xffffffff;

// Newcomers and gaps are matched as Kuhn (The Hungarian method, 1955) and Berge (1957) have it: where none is
// left around one, others make room along a chain of blocks, each of which is around who comes to it. Who
// finds no chain marks the blocks that it looked at for good, since no later chain leads out of them: all who
// find none are linear together, and who finds one costs the blocks between it and the gap, most often a few.
class Filling {
 public:
  Filling(std::span<const Newcomer> newcomers, std::vector<BlockRoom> rooms, StopSignal stop)
      : newcomers_(newcomers), rooms_(std::move(rooms)), paced_(stop, 64) {
    lengthen(block_of_, newcomers.size(), kNone, stop);
    lengthen(next_, newcomers.size(), kNone, stop);
    lengthen(first_, rooms_.size(), kNone, stop);
    lengthen(reached_by_, rooms_.size(), kNone, stop);
  }

  // False where there is no room for one.
  bool run() {
    for (std::uint32_t i = 0; i < newcomers_.size(); ++i) {
      paced_.check();
      const std::uint32_t gap = most_apt(i, [](const BlockRoom& room) { return room.gaps > 0; });
      if (gap != kNone) put(i, gap);
    }
    for (std::uint32_t i = 0; i < newcomers_.size(); ++i) {
      if (block_of_[i] == kNone) make_way_for(i);
    }
    for (std::uint32_t i = 0; i < newcomers_.size(); ++i) {
      paced_.check();
      if (block_of_[i] == kNone && !put_anywhere(i)) return false;
    }
    return true;
  }
  std::vector<std::uint32_t> take_blocks() { return std::move(block_of_); }

 private:
  template <class Visit>
  void for_blocks(std::uint32_t newcomer, Visit&& visit) const {
    for (const BlocksAround* around : newcomers_[newcomer]) {
      for (const std::uint32_t block : around->blocks()) visit(block);
    }
  }
  // The block around one that held most of its vertices, and then has the most room, of those that will do.
  template <class WillDo>
  std::uint32_t most_apt(std::uint32_t newcomer, WillDo&& will_do) const {
    std::uint32_t best = kNone;
    std::pair<std::ptrdiff_t, std::uint32_t> by_best;
    for_blocks(newcomer, [&](std::uint32_t block) {
      if (!will_do(rooms_[block])) return;
      const std::pair by(std::ranges::count_if(newcomers_[newcomer],
                                               [block](const auto* around) { return around->holds(block); }),
                         rooms_[block].all);
      if (best != kNone && by <= by_best) return;
      best = block;
      by_best = by;
    });
    return best;
  }

  void put(std::uint32_t newcomer, std::uint32_t block) {
    --rooms_[block].gaps;
    --rooms_[block].all;
    enter(newcomer, block);
  }
  void enter(std::uint32_t newcomer, std::uint32_t block) {
    block_of_[newcomer] = block;
    next_[newcomer] = std::exchange(first_[block], newcomer);
  }
  void leave(std::uint32_t newcomer) {
    std::uint32_t* link = &first_[block_of_[newcomer]];
    while (*link != newcomer) link = &next_[*link];
    *link = next_[newcomer];
  }

  // Breadth first, from who has no gap over those that are in the blocks around.
  void make_way_for(std::uint32_t newcomer) {
    searching_.assign(1, newcomer);
    looked_at_.clear();
    for (std::size_t at = 0; at < searching_.size(); ++at) {
      paced_.check();
      std::uint32_t gap = kNone;
      for_blocks(searching_[at], [&](std::uint32_t block) {
        if (gap != kNone || reached_by_[block] != kNone) return;
        reached_by_[block] = searching_[at];
        looked_at_.push_back(block);
        if (rooms_[block].gaps > 0) gap = block;
        for (std::uint32_t i = first_[block]; i != kNone; i = next_[i]) searching_.push_back(i);
      });
      if (gap == kNone) continue;
      move_along_to(gap);
      for (const std::uint32_t block : looked_at_) reached_by_[block] = kNone;
      return;
    }
  }
  void move_along_to(std::uint32_t block) {
    --rooms_[block].gaps;
    --rooms_[block].all;
    while (block != kNone) {
      const std::uint32_t newcomer = reached_by_[block];
      const std::uint32_t from = block_of_[newcomer];
      if (from != kNone) leave(newcomer);
      enter(newcomer, block);
      block = from;
    }
  }

  bool put_anywhere(std::uint32_t newcomer) {
    const auto has_room = [](const BlockRoom& room) { return room.all > 0; };
    std::uint32_t block = most_apt(newcomer, has_room);
    if (block == kNone) {
      std::uint32_t any = 0;
      for_blocks(newcomer, [&](std::uint32_t around) { any = around; });
      const auto count = static_cast<std::uint32_t>(rooms_.size());
      block = nearest_block(any, count, [&](std::uint32_t b) { return has_room(rooms_[b]); });
      if (block == count) return false;
    }
    --rooms_[block].all;
    block_of_[newcomer] = block;
    return true;
  }

  std::span<const Newcomer> newcomers_;
  std::vector<BlockRoom> rooms_;  // what is left
  PacedStop paced_;
  std::vector<std::uint32_t> block_of_;    // by newcomer
  std::vector<std::uint32_t> next_;        // by newcomer: the next one in a gap of the same block
  std::vector<std::uint32_t> first_;       // by block: of those in its gaps
  std::vector<std::uint32_t> reached_by_;  // by block: who would take a place in it
  std::vector<std::uint32_t> searching_;
  std::vector<std::uint32_t> looked_at_;
};

}  // namespace

std::vector<std::uint32_t> fill_blocks(std::span<const Newcomer> newcomers, std::vector<BlockRoom> rooms,
                                       StopSignal stop) {
  Filling filling(newcomers, std::move(rooms), stop);
  return filling.run() ? filling.take_blocks() : std::vector<std::uint32_t>{};
}

}  // namespace warmfront
