// SPDX-License-Identifier: Apache-2.0
// Checks the pairs of one segment of a front: a part of the self-check (self_check.h). Pure functions.
#pragma once

#include <string>

#include "engine/front/descend.h"
#include "engine/front/segment.h"

namespace warmfront {

/// The first fault, or an empty string: the pairs of `segment` must be a cut through the test tree of
/// `trees`, in depth-first order. O(pairs).
template <class Bounds>
std::string broken_cut(const FrontSegment& segment, const TreePair<Bounds>& trees);

/// The same of one of its chunks: pairs must be apart by more than the width of `trees`, or leaves, and
/// cached answers belong to its pairs.
template <class Bounds>
std::string broken_chunk(const FrontChunk& chunk, const TreePair<Bounds>& trees);

}  // namespace warmfront
