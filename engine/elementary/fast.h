// SPDX-License-Identifier: Apache-2.0
// The fast tier: an elementary test in plain floating point. A pure function, safe to call from any thread.
// Source: Provot 1997, as implemented in the collision libraries of 2009 (reference/algorithms 3.3).
#pragma once

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

/// Finds the roots of the coplanarity cubic and applies the inside test at each, without error bounds: the
/// first root at which the four points are inside is a contact, unless the swept 18-DOP or the distance
/// certainly excludes it. The filters in front (swept 18-DOP, signs of the cubic) are the certified ones. It
/// may miss contacts and invent them, most often where primitives graze, are degenerate or move within a
/// plane; rounding may make its toi late. It is a baseline for measurements. No allocation.
Verdict fast_test(const FeatureVertices& features, double latest);

}  // namespace warmfront
