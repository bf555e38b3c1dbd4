// SPDX-License-Identifier: Apache-2.0
// Random UUIDs: see uuid.h.
#include "client/lib/uuid.h"

#include <random>

namespace warmfront::client {

std::string random_uuid() {
  std::random_device device;
  std::uniform_int_distribution<int> digit(0, 15);
  std::string uuid = "xxxxxxxx-xxxx-4xxx-yxxx-xxxxxxxxxxxx";
  for (char& c : uuid) {
    if (c != 'x' && c != 'y') continue;
    const int value = c == 'x' ? digit(device) : 8 + digit(device) % 4;
    c = "0123456789abcdef"[value];
  }
  return uuid;
}

}  // namespace warmfront::client
