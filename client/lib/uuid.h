// SPDX-License-Identifier: Apache-2.0
// Session ids. Thread-safe.
#pragma once

#include <string>

namespace warmfront::client {

/// A random UUID (version 4).
std::string random_uuid();

}  // namespace warmfront::client
