// SPDX-License-Identifier: Apache-2.0
// The fast tier: an elementary test in plain floating point. A pure function, safe to call from any thread.
// Source: Provot 1997, as the collision libraries of 2009 had it (reference/algorithms 3.3).
#pragma once

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

/// The roots of the coplanarity cubic, and at each the inside test, with rounding as it comes: the first root
/// at which the four points are inside is a contact, unless the swept 18-DOP or the distance then says
/// otherwise for certain. The filters in front (swept 18-DOP, signs of the cubic) are the certified ones. It
/// may miss contacts and invent them, most of all where primitives graze, are
/// degenerate or move within a plane; its toi may be late by rounding. It is there to be measured against. No
/// allocation.
Verdict fast_test(const FeatureVertices& features, double latest);

}  // namespace warmfront
