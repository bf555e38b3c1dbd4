// SPDX-License-Identifier: Apache-2.0
// How much memory this process may use. Thread-safe.
#pragma once

#include <cstddef>

namespace warmfront::server {

/// The machine's memory, or the limit of the process's control group where that is lower, in bytes and whole
/// MiB. Read once.
std::size_t usable_memory_bytes();

}  // namespace warmfront::server
