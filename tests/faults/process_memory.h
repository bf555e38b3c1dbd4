// SPDX-License-Identifier: Apache-2.0
// Corrupts the memory of a child process: finds words by their content and changes them from outside while it
// runs, so that a daemon needs no interface for this. Used by one thread at a time, on a process that does
// not use that memory meanwhile.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace warmfront::test {

/// Flips `bits` in word `at` of each occurrence of `words` in the process's heap; returns the number of
/// occurrences, -1 when its memory cannot be written.
int flip_bits(pid_t process, std::span<const std::uint32_t> words, std::size_t at, std::uint32_t bits);

}  // namespace warmfront::test
