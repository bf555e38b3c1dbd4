// SPDX-License-Identifier: Apache-2.0
// Code shared by the contact writers: see contact_writer.h.
#include "client/io/contact_writer.h"

#include <array>
#include <charconv>

namespace warmfront::client {
namespace {

using Opener = Result<std::unique_ptr<ContactWriter>> (*)(const std::string&, const WrittenFields&);

Opener opener_for(std::string_view path) {
  if (path.ends_with(".csv") || path == "-") return open_csv_contact_writer;
  if (path.ends_with(".jsonl")) return open_jsonl_contact_writer;
  if (path.ends_with(".vtp")) return open_vtp_contact_writer;
  return nullptr;
}

}  // namespace

std::string_view short_name(ContactKind kind) {
  constexpr std::array<std::string_view, kContactKinds> kNames{"vf", "ee", "ef", "ve", "vv", "vh"};
  return kNames.at(static_cast<std::size_t>(kind));
}

std::string_view short_name(ClosestFeatures closest) {
  switch (closest) {
    case ClosestFeatures::kVertexVertex:
      return "vv";
    case ClosestFeatures::kEdgeVertex:
      return "ev";
    case ClosestFeatures::kEdgeEdge:
      return "ee";
    case ClosestFeatures::kFaceVertex:
      return "fv";
  }
  return "unknown";
}

std::string_view to_string(RowContinuity continuity) {
  switch (continuity) {
    case RowContinuity::kNew:
      return "new";
    case RowContinuity::kKept:
      return "kept";
    case RowContinuity::kEnded:
      return "ended";
  }
  return "unknown";
}

std::string_view to_string(ContactStatus status) {
  switch (status) {
    case ContactStatus::kHit:
      return "hit";
    case ContactStatus::kPossible:
      return "possible";
    case ContactStatus::kOverlapAtStart:
      return "overlap_at_start";
    case ContactStatus::kBudget:
      return "budget";
  }
  return "unknown";
}

void append_round_trip(std::string& out, double value) {
  std::array<char, 32> digits;
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 17);
  out.append(digits.data(), end.ptr);
}

bool is_contact_file_name(std::string_view path) {
  return opener_for(path) != nullptr;
}

Result<std::unique_ptr<ContactWriter>> open_contact_writer(const std::string& path,
                                                           const WrittenFields& fields) {
  const Opener open = opener_for(path);
  if (!open)
    return invalid_argument(path + ": contacts are written as .csv, .jsonl or .vtp, or to stdout (-) as CSV");
  return open(path, fields);
}

}  // namespace warmfront::client
