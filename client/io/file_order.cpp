// SPDX-License-Identifier: Apache-2.0
#include "client/io/file_order.h"

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace warmfront::client {
namespace {

constexpr std::string_view kDigits = "0123456789";

struct Numbered {
  std::string_view before, number, after;
};

Numbered parts_of(std::string_view path) {
  const std::size_t last = path.find_last_of(kDigits);
  if (last == std::string_view::npos) return {path, {}, {}};
  const std::size_t other = path.find_last_not_of(kDigits, last);
  const std::size_t first = other == std::string_view::npos ? 0 : other + 1;
  const std::size_t begin = std::min(path.find_first_not_of('0', first), last);
  return {path.substr(0, first), path.substr(begin, last + 1 - begin), path.substr(last + 1)};
}

bool is_less(std::string_view a, std::string_view b) {
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

}  // namespace

std::optional<std::string> numbers_out_of_order(std::span<const std::string> paths) {
  for (std::size_t i = 1; i < paths.size(); ++i) {
    const Numbered a = parts_of(paths[i - 1]), b = parts_of(paths[i]);
    if (a.number.empty() || a.before != b.before || a.after != b.after || !is_less(b.number, a.number))
      continue;
    return "frames are the files in the order given, in which " + paths[i - 1] + " comes before " + paths[i] +
           "; `ls -v` lists them by their numbers";
  }
  return std::nullopt;
}

}  // namespace warmfront::client
