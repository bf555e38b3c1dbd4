// SPDX-License-Identifier: Apache-2.0
// Two threads for all cases of a test program: starting some for each would be most of the time.
#pragma once

#include <memory>

#include "engine/workers.h"

namespace warmfront::testing {

inline const std::shared_ptr<Workers>& workers() {
  static const auto shared = std::make_shared<Workers>(2);
  return shared;
}

}  // namespace warmfront::testing
