// SPDX-License-Identifier: Apache-2.0
// Memory of a child process that fails: words of it are found by what stands there, and changed from outside
// while it runs, so that a daemon needs no door for it. Used by one thread at a time, on a process that does
// not work on that memory meanwhile.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace warmfront::test {

/// Wherever `words` stand in the process' heap, flips `bits` in word `at` of them; in how many places it did.
/// -1 when its memory cannot be written.
int flip_bits(pid_t process, std::span<const std::uint32_t> words, std::size_t at, std::uint32_t bits);

}  // namespace warmfront::test
