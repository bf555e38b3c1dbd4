// SPDX-License-Identifier: Apache-2.0
// The families of torture.h, by what is hard about them.
#pragma once

#include "tests/support/feature_case.h"
#include "tests/support/torture_ends.h"

namespace warmfront::testing::torture {

/// torture_times.cpp
FeatureCase made(Random& random, ContactKind kind);
FeatureCase made_and_pushed(Random& random, ContactKind kind);
FeatureCase lattice(Random& random, ContactKind kind);
FeatureCase grazing_rim(Random& random, ContactKind kind);
FeatureCase grazing_rim_pushed(Random& random, ContactKind kind);
FeatureCase touching_in_time(Random& random, ContactKind kind);
FeatureCase touching_in_time_pushed(Random& random, ContactKind kind);
FeatureCase at_an_end(Random& random, ContactKind kind);
FeatureCase at_an_end_pushed(Random& random, ContactKind kind);
FeatureCase several_roots(Random& random, ContactKind kind);

/// torture_degenerate.cpp
FeatureCase within_a_plane(Random& random, ContactKind kind);
FeatureCase nearly_within_a_plane(Random& random, ContactKind kind);
FeatureCase on_a_line(Random& random, ContactKind kind);
FeatureCase zero_length(Random& random, ContactKind kind);
FeatureCase zero_area(Random& random, ContactKind kind);
FeatureCase duplicate_vertices(Random& random, ContactKind kind);
FeatureCase parallel_edges(Random& random, ContactKind kind);
FeatureCase no_motion(Random& random, ContactKind kind);
FeatureCase common_motion(Random& random, ContactKind kind);

/// torture_scales.cpp
FeatureCase general(Random& random, ContactKind kind);
FeatureCase large_offset(Random& random, ContactKind kind);
FeatureCase extreme_scale(Random& random, ContactKind kind);
FeatureCase uneven_axes(Random& random, ContactKind kind);
FeatureCase needle(Random& random, ContactKind kind);
FeatureCase huge_displacement(Random& random, ContactKind kind);
FeatureCase tiny_displacement(Random& random, ContactKind kind);
FeatureCase denormals(Random& random, ContactKind kind);
FeatureCase tiny_beside_huge(Random& random, ContactKind kind);
FeatureCase chaos(Random& random, ContactKind kind);
FeatureCase largest_doubles(Random& random, ContactKind kind);

}  // namespace warmfront::testing::torture
