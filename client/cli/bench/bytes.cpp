// SPDX-License-Identifier: Apache-2.0
// Bytes that a frame's work reads and writes: see bench_run.h.
#include "client/cli/bench/run.h"
#include "engine/bounds/kdop.h"
#include "engine/bvh/bvh.h"
#include "engine/contact.h"
#include "engine/motion/motion.h"
#include "engine/narrow_phase/feature_block.h"

namespace warmfront::client {

double bytes_touched(const BenchReport& report, const BenchRow& row) {
  const ColliderOptions& options = row.setting.options;
  const bool lazy = options.front == FrontMode::kWarm && options.lazy_front;
  const double bounds = options.bounds == BoundsKind::kAabb ? sizeof(Aabb) : sizeof(KDop18);
  const double in_leaf =
      bounds / sizeof(float) * sizeof(std::int16_t);  // of a primitive: engine/bvh/leaf_grid.h
  const TreeShape shape(static_cast<std::uint32_t>(report.triangles), options.leaf_size);
  const StepCounts& counts = row.counts;
  const auto a_frame = [&](std::uint64_t count) { return row.a_frame(count); };
  // Positions at both times are read, a vertex's motion is written and read, its bounds are written.
  const double vertices = static_cast<double>(report.vertices) *
                          (6 * sizeof(double) + 2 * sizeof(VertexMotion) + sizeof(PointBounds));
  // A node's bounds are written and read by its parent, a triangle's made of three vertices' and kept in its
  // leaf; a lazy front keeps travel, of blocks too where leaves hold several, which is read and written.
  const double travelling = shape.node_count() + (shape.has_wide_leaves() ? shape.block_count() : 0);
  const double nodes = shape.node_count() * 2 * bounds + (lazy ? 2 * sizeof(NodeTravel) * travelling : 0) +
                       static_cast<double>(report.triangles) * (3 * sizeof(PointBounds) + in_leaf);
  // The front is read; a lazy one reads the travel of both nodes, and of about five neighbours of each block,
  // itself included. A test reads two bounds; in leaves one primitive stays in registers while the others are
  // read.
  const double neighbours = shape.has_wide_leaves() ? 5.0 * shape.block_count() : 0.0;
  const double front = a_frame(counts.front_bytes) +
                       (lazy ? 2.0 * sizeof(NodeTravel) * (a_frame(counts.front_pairs) + neighbours) : 0.0) +
                       2 * bounds * a_frame(counts.bv_tests) + in_leaf * a_frame(counts.primitive_tests);
  // A feature pair is written to a block and read from it, with four vertices; as many bounds decide whether
  // an orphan pair overlaps. A contact is written and collected.
  const double tests =
      a_frame(counts.elementary_tests) * (2 * sizeof(FeaturePair) + 4 * sizeof(VertexMotion)) +
      a_frame(counts.orphan_tests) * 4 * sizeof(PointBounds) + a_frame(row.contacts) * 2 * sizeof(Contact);
  return vertices + nodes + front + tests;
}

}  // namespace warmfront::client
