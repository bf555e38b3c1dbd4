// SPDX-License-Identifier: Apache-2.0
// Joins the files of contacts that the parts of one run wrote. One thread at a time.
#pragma once

#include <span>
#include <string>

#include "client/cli/merge/part.h"
#include "engine/result.h"

namespace warmfront::client {

/// Writes the contacts of the parts, in order, to `to`, which is to become `path`: what one run over all
/// frames would have written there, byte for byte. The parts' files are in the format that `path` names
/// (.csv, .jsonl, .vtp; "-": .csv to stdout), and are copied block by block. Gives what was written, named
/// `path`. Fails when a part names no file, or one that is missing, in another format, or not as long as its
/// report says; then something of it may be at `to`.
Result<WrittenContacts> merge_contacts(std::span<const Part> parts, const std::string& path,
                                       const std::string& to);

}  // namespace warmfront::client
