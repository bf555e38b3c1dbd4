// SPDX-License-Identifier: Apache-2.0
// What the parts of one run tell together: for people and as JSON. Pure functions, but for print().
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/cli/merge/part.h"

namespace warmfront::client {

/// Some number of one step, by the step's end frame.
struct OfFrame {
  std::uint64_t frame;
  double value;
};

struct Merged {
  std::size_t reports = 0;
  FrameRange frames;  ///< of which the steps were asked for
  std::vector<FrameRange> missing;
  std::uint64_t vf = 0;
  std::uint64_t ee = 0;
  std::uint64_t vh = 0;
  std::uint64_t possible = 0;
  double ms = 0;                        ///< of all steps
  std::string contacts_hash;            ///< empty where steps are missing, and of reports without contacts
  std::optional<ContactHashPart> hash;  ///< as RangeReport::hash
  /// Of the steps, at most kWorst each, the worst first, of equal ones the earlier.
  std::vector<OfFrame> most_contacts;  ///< those that have any
  std::vector<OfFrame> earliest;
  std::vector<OfFrame> slowest;  ///< by ms
};

inline constexpr std::size_t kWorst = 3;

/// Of parts in order.
Merged merge_parts(std::span<const Part> parts, FrameRange frames, std::vector<FrameRange> missing);

/// The fields of `detect --json` with those of the merged run: what is said of threads, front and bounds
/// where the parts agree, else null; and "worst" and "missing". `contacts`: of the merged file. Moves the
/// frames out of the parts.
std::string format_json(const Merged& merged, std::span<Part> parts,
                        const std::optional<WrittenContacts>& contacts);

/// Which steps have a line of their own.
enum class Steps { kNone, kWorst, kAll };

/// So many at most with Steps::kWorst: those with the most contacts, of equal ones the earlier.
inline constexpr std::size_t kWorstLines = 10;

/// The totals, then lines for the steps: the worst first, all in order.
void print(const Merged& merged, std::span<const Part> parts, Steps steps);

}  // namespace warmfront::client
