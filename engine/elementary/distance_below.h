// SPDX-License-Identifier: Apache-2.0
// A lower bound of the distance between a query's primitives, within 2^-23 of the true distance: it decides
// the pairs that the search in certified.cpp leaves open. Pure functions.
#pragma once

#include "engine/elementary/query.h"

namespace warmfront {

/// A lower bound d of the distance D between the primitives at time t, for a query of size 1; negative where
/// no bound is known. Where D >= 2^-20, d >= D - 2^-23, however thin or parallel the primitives are. Proof:
/// README.md, "Distance from below".
double distance_below(const Query& query, double t);

/// The same for all times of a window: D is the distance of 0 from the convex hull of the gaps at both ends,
/// which contains the gaps in between. So one direction proves it for the whole window: a plane that only
/// translates keeps the primitives D apart.
double distance_below(const Query& query, const Window& window);

}  // namespace warmfront
