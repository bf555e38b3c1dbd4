// SPDX-License-Identifier: Apache-2.0
// Checksums of data that must not change between steps, for the self-check. Thread-safe.
#pragma once

#include <cstdint>

#include "engine/bvh/topology.h"
#include "engine/scene.h"
#include "engine/scene/pair_filter.h"
#include "engine/scene/thickness.h"
#include "engine/stop.h"

namespace warmfront {

/// Of the scene in both numberings and the order of each part's primitives. O(scene). Throws Stopped when
/// told to stop, as orphans_checksum() does.
std::uint64_t topology_checksum(const Scene& given, const Topology& topology, StopSignal stop);
/// Of what filters leave out; 0 where that is nothing.
std::uint64_t filter_checksum(const PairFilter& filter, StopSignal stop);
/// Of how thick everything is; 0 where nothing is.
std::uint64_t thickness_checksum(const Thickness& thickness, StopSignal stop);
/// Of the orphan sets of the part with this index, in numbers that count from the part's first: where parts
/// before it get other sizes, the sum stays.
std::uint64_t orphans_checksum(const PartTopology& part, std::size_t index, StopSignal stop);

}  // namespace warmfront
