// SPDX-License-Identifier: Apache-2.0
// Lists of which most is as it was: the runs of it are copied, and what came is put between them. Pure
// functions; all that take a StopSignal throw Stopped when told to stop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/parallel/move_runs.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene.h"

namespace warmfront {

/// Does everything that stays keep its number?
bool in_place(std::span<const Run> runs);

/// Runs without some of what they lead to, which ascends.
std::vector<Run> without(std::span<const Run> runs, std::span<const std::uint32_t> rows);

/// Rows that are not as they were.
struct ChangedRows {
  std::vector<std::uint32_t> rows;  ///< ascending
  std::vector<std::uint32_t> end;   ///< by row: where its items end
  std::vector<std::uint32_t> items;

  void end_row(std::uint32_t row) {
    rows.push_back(row);
    end.push_back(static_cast<std::uint32_t>(items.size()));
  }
};

/// How the numbers of what rows hold change: what was `first` + i is `now[i]`, or i with `same`.
struct ItemNumbers {
  std::span<const std::uint32_t> now;
  std::uint32_t first;
  bool same;
};

/// Fills `csr`, which is empty and may have room, with `rows` rows: these runs of what was, from `first_row`
/// on, but for the numbers of their items, and those that are `changed`.
void follow_rows(Csr& csr, const Csr& before, std::size_t first_row, std::span<const Run> runs,
                 const ChangedRows& changed, const ItemNumbers& numbers, std::size_t rows, StopSignal stop);

/// Brings an empty list to `count` items: those of runs, as `append_piece` does with pieces of them, and
/// between them those that are in none, as `came` makes them.
template <class T, class Came, class Append>
void append_pieces(std::vector<T>& to, std::span<const T> from, std::span<const Run> runs, std::size_t count,
                   StopSignal stop, Came&& came, Append&& append_piece) {
  reserve(to, count, stop);
  PacedStop paced(stop, 256);
  const auto those_that_came = [&](std::size_t until) {
    for (; to.size() < until; to.push_back(came(to.size()))) paced.check();
  };
  for (const Run& run : runs) {
    those_that_came(run.to);
    in_pieces(run.from, run.from + run.count, stop,
              [&](std::size_t first, std::size_t end) { append_piece(from.subspan(first, end - first)); });
  }
  those_that_came(count);
}

/// The same, each number in them as `now` says.
template <class T, class Came, class Now>
void append_runs(std::vector<T>& to, std::span<const T> from, std::span<const Run> runs, std::size_t count,
                 StopSignal stop, Came&& came, Now&& now) {
  append_pieces(to, from, runs, count, stop, came, [&](std::span<const T> piece) {
    const std::size_t at = to.size();
    to.resize(at + piece.size());
    const T* const read = piece.data();
    T* const write = to.data() + at;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      for (std::size_t k = 0; k < read[i].size(); ++k) write[i][k] = now(read[i][k]);
    }
  });
}

/// The same, each number less `by`: most often 0, of what is first in its scene.
template <class T, class Came>
void append_runs_less(std::vector<T>& to, std::span<const T> from, std::span<const Run> runs,
                      std::size_t count, StopSignal stop, Came&& came, std::uint32_t by) {
  if (by != 0)
    append_runs(to, from, runs, count, stop, came, [=](std::uint32_t number) { return number - by; });
  else
    append_pieces(to, from, runs, count, stop, came,
                  [&](std::span<const T> piece) { to.insert(to.end(), piece.begin(), piece.end()); });
}

}  // namespace warmfront
