// SPDX-License-Identifier: Apache-2.0
// Nothing else may be defined here: see StopSignal::look().
#include "engine/stop.h"

#include "engine/parallel/give_way.h"

namespace warmfront {

void StopSignal::look() const {
  if (flag_->load(std::memory_order_relaxed)) throw Stopped{};
  give_way();
}

}  // namespace warmfront
