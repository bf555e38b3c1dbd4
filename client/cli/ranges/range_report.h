// SPDX-License-Identifier: Apache-2.0
// Which frames of which input a report of `detect` is of: by that `merge` knows the parts of one sequence.
// Plain values and pure functions.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/frames/frame_steps.h"
#include "engine/contact_hash.h"
#include "engine/result.h"

namespace warmfront::client {

/// The contacts that a run wrote to a file or a series.
struct WrittenContacts {
  std::string file;        ///< relative to the report's folder, unless it is absolute
  std::uint64_t rows = 0;  ///< with those that ended
};

struct RangeReport {
  std::string version;  ///< of the program
  std::string input;    ///< its name, as it was given
  std::string digest;   ///< of the input's first frame, and of the options that decide what a contact is
  FrameRange frames;    ///< steps end in frames.first + 1 to frames.last
  std::uint32_t last_of_input = 0;
  std::uint32_t substeps = 1;
  std::vector<std::uint32_t> topology_changes;  ///< of the whole input: the frames at which it does
  /// Digests of the positions in frames.first and frames.last, which two ranges share where one follows the
  /// other; but where the topology changes there, it is that of the mesh before and of the mesh after.
  std::string starts_at;
  std::string ends_at;
  std::optional<WrittenContacts> contacts;
  /// What the steps make of a hash; of a range that begins with frame 0 it is not needed.
  std::optional<ContactHashPart> hash;
};

/// Objects of the field "range". from_json() fails with what is missing or wrong.
nlohmann::ordered_json to_json(const RangeReport& range);
Result<RangeReport> range_from_json(const nlohmann::ordered_json& json);

/// How `report` ("-": stdout) names `file`: as it is found from the report's folder.
std::string beside_report(const std::string& file, const std::string& report);

/// "10:20", as --frames takes it.
std::string to_text(FrameRange range);

}  // namespace warmfront::client
