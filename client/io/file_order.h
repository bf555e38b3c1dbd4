// SPDX-License-Identifier: Apache-2.0
// Are files that are frames given in the order of their numbers? A pure function.
#pragma once

#include <optional>
#include <span>
#include <string>

namespace warmfront::client {

/// Where names that are alike but for the last number in them do not ascend, a sentence that says so: a shell
/// that lists t*.obj puts t10.obj before t2.obj.
std::optional<std::string> numbers_out_of_order(std::span<const std::string> paths);

}  // namespace warmfront::client
