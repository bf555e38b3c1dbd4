// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>

#include "engine/scene.h"

namespace warmfront {
namespace {

// Of the character that `text` begins with; 0 where that is none (RFC 3629, section 4).
std::size_t bytes_of_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  if (lead < 0xc2 || lead > 0xf4) return 0;
  const std::size_t bytes = lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  // The second byte's range leaves out what fewer bytes say, surrogates, and what is beyond U+10FFFF.
  const unsigned least = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;
  const unsigned most = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;
  if (byte(1) < least || byte(1) > most) return 0;
  for (std::size_t i = 2; i < bytes; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  return bytes;
}

}  // namespace

Status check_name(std::string_view name, const std::string& where) {
  if (name.size() > kMaxNameBytes)
    return invalid_argument(where + ".name: is " + std::to_string(name.size()) + " bytes long, and may be " +
                            std::to_string(kMaxNameBytes));
  for (std::size_t i = 0; i < name.size();) {
    const std::size_t bytes = bytes_of_character(name.substr(i));
    if (bytes == 0)
      return invalid_argument(where + ".name: is no UTF-8 from byte " + std::to_string(i) +
                              " on; give text in UTF-8");
    i += bytes;
  }
  return {};
}

}  // namespace warmfront
