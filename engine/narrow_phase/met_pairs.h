// SPDX-License-Identifier: Apache-2.0
// What a trial met: a trial that goes part of the same way can meet nothing else. Plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/contact.h"
#include "engine/front/rest_answer.h"
#include "engine/scene.h"
#include "engine/scene/primitives.h"

namespace warmfront {

/// Of one thread.
struct MetPairs {
  std::vector<std::array<Primitive, 2>> pairs;  ///< of primitives whose moving bounds overlap
  RestAnswer kept;                              ///< between what rests, found by an earlier question
  bool rested = false;                          ///< was something kept, be it that nothing was found?
  std::size_t count = 0;                        ///< of both, also of those for which there was no room

  void clear() {
    pairs.clear();
    kept.clear();
    rested = false;
    count = 0;
  }
  std::size_t memory_bytes() const {
    return pairs.capacity() * sizeof pairs[0] + kept.contacts.capacity() * sizeof(Contact);
  }
};

}  // namespace warmfront
