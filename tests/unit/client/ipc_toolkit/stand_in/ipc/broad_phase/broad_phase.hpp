// SPDX-License-Identifier: Apache-2.0
// See stand_in.hpp.
#pragma once

#include <ipc/stand_in.hpp>
