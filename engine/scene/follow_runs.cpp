// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/follow_runs.h"

#include <algorithm>

namespace warmfront {

bool in_place(std::span<const Run> runs) {
  return std::ranges::all_of(runs, [](const Run& run) { return run.from == run.to; });
}

std::vector<Run> without(std::span<const Run> runs, std::span<const std::uint32_t> rows) {
  std::vector<Run> left;
  left.reserve(runs.size() + rows.size());
  auto row = rows.begin();
  for (Run run : runs) {
    while (row != rows.end() && *row < run.to) ++row;
    for (; row != rows.end() && *row < run.to + run.count; ++row) {
      const std::size_t count = *row - run.to;
      if (count > 0) left.push_back({run.from, count, run.to});
      run = {run.from + count + 1, run.count - count - 1, run.to + count + 1};
    }
    if (run.count > 0) left.push_back(run);
  }
  return left;
}

void follow_rows(Csr& csr, const Csr& before, std::size_t first_row, std::span<const Run> runs,
                 const ChangedRows& changed, const ItemNumbers& numbers, std::size_t rows, StopSignal stop) {
  std::size_t items = changed.items.size();
  for (const Run& run : runs)
    items += before.begin[first_row + run.from + run.count] - before.begin[first_row + run.from];
  reserve(csr.begin, rows + 1, stop);
  reserve(csr.items, items, stop);
  csr.begin.push_back(0);
  PacedStop paced(stop, 256);
  std::size_t next = 0;  // of the changed ones
  const auto take_changed = [&](std::size_t until) {
    for (; next < changed.rows.size() && changed.rows[next] < until; ++next) {
      paced.check();
      const auto first = changed.items.begin() + (next == 0 ? 0 : changed.end[next - 1]);
      csr.items.insert(csr.items.end(), first, changed.items.begin() + changed.end[next]);
      csr.begin.push_back(static_cast<std::uint32_t>(csr.items.size()));
    }
  };
  for (const Run& run : runs) {
    take_changed(run.to);
    const std::size_t from = first_row + run.from;
    const auto offset = static_cast<std::uint32_t>(csr.items.size()) - before.begin[from];
    in_pieces(from + 1, from + run.count + 1, stop, [&](std::size_t first, std::size_t end) {
      const std::size_t at = csr.begin.size();
      csr.begin.resize(at + end - first);
      for (std::size_t i = 0; i < end - first; ++i) csr.begin[at + i] = before.begin[first + i] + offset;
    });
    in_pieces(before.begin[from], before.begin[from + run.count], stop,
              [&](std::size_t first, std::size_t end) {
                if (numbers.same && numbers.first == 0) {
                  csr.items.insert(csr.items.end(), before.items.begin() + static_cast<std::ptrdiff_t>(first),
                                   before.items.begin() + static_cast<std::ptrdiff_t>(end));
                  return;
                }
                const std::size_t at = csr.items.size();
                csr.items.resize(at + end - first);
                const std::uint32_t* const read = before.items.data() + first;
                std::uint32_t* const write = csr.items.data() + at;
                if (numbers.same) {
                  for (std::size_t i = 0; i < end - first; ++i) write[i] = read[i] - numbers.first;
                } else {
                  for (std::size_t i = 0; i < end - first; ++i)
                    write[i] = numbers.now[read[i] - numbers.first];
                }
              });
  }
  take_changed(rows);
}

}  // namespace warmfront
