// SPDX-License-Identifier: Apache-2.0
// The constants of the format; see README.md. Constants only.
#pragma once

#include <cstdint>
#include <string_view>

namespace warmfront::recording {

inline constexpr std::string_view kMagic = "WFREC\r\n\x1a";
inline constexpr std::uint32_t kVersion = 1;
/// Largest message: 1 GiB, the greatest limit of a daemon, plus its framing.
inline constexpr std::uint64_t kMostRecordBytes = (std::uint64_t{1} << 30) + (64 << 10);
inline constexpr std::size_t kMostLengthBytes = 5;

}  // namespace warmfront::recording
