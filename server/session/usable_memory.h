// SPDX-License-Identifier: Apache-2.0
// How much memory this process may use. Thread-safe.
#pragma once

#include <cstddef>
#include <string>

namespace warmfront::server {

/// The machine's memory, or the limit of the process's control group where that is lower, in bytes and whole
/// MiB. Read once.
std::size_t usable_memory_bytes();

/// The least memory limit in bytes from this process's control group up to the root, of version 2 and of
/// version 1; `most` where none is lower. `root` is put before the paths of the system, for tests.
std::size_t control_group_limit(std::size_t most, const std::string& root = {});

}  // namespace warmfront::server
