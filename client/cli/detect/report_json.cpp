// SPDX-License-Identifier: Apache-2.0
// The JSON report: see report_json.h.
#include "client/cli/detect/report_json.h"

#include <nlohmann/json.hpp>

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

Json format_frame(const FrameReport& frame) {
  const StageTimes& ms = frame.statistics.ms;
  const StepCounts& counts = frame.statistics.counts;
  return {{"frame", frame.frame},
          {"vf", frame.vf},
          {"ee", frame.ee},
          {"vh", frame.vh},
          {"possible", frame.possible},
          {"earliest_toi", frame.earliest_toi ? Json(*frame.earliest_toi) : Json(nullptr)},
          {"ms",
           {{"total", ms.total},
            {"refit", ms.refit},
            {"front", ms.front},
            {"elementary", ms.elementary},
            {"adjacent", ms.adjacent}}},
          {"counts",
           {{"bv_tests", counts.bv_tests},
            {"front_pairs", counts.front_pairs},
            {"front_bytes", counts.front_bytes},
            {"triangle_pairs", counts.triangle_pairs},
            {"elementary_tests", counts.elementary_tests},
            {"exact_tests", counts.exact_tests},
            {"front_skipped", counts.front_skipped},
            {"front_sprouted", counts.front_sprouted},
            {"front_pruned", counts.front_pruned},
            {"adjacent_pairs", counts.adjacent_pairs},
            {"cone_culled_pairs", counts.cone_culled_pairs},
            {"cone_patches", counts.cone_patches},
            {"orphan_tests", counts.orphan_tests},
            {"primitive_tests", counts.primitive_tests},
            {"coplanarity_passed", counts.coplanarity_passed},
            {"front_rested", counts.front_rested},
            {"contacts_kept", counts.contacts_kept},
            {"vertices_moved", counts.vertices_moved},
            {"nodes_refit", counts.nodes_refit},
            {"parts_moved", counts.parts_moved},
            {"near_parts", counts.near_parts},
            {"parts_apart", counts.parts_apart},
            {"part_pairs_excluded", counts.part_pairs_excluded},
            {"parts", counts.parts},
            {"parts_rigid", counts.parts_rigid},
            {"triangle_pairs_filtered", counts.triangle_pairs_filtered},
            {"feature_pairs_filtered", counts.feature_pairs_filtered}}},
          {"bounds", to_string(frame.statistics.bounds)},
          {"front_state", to_string(frame.statistics.front_state)},
          {"frame_bytes", frame.frame_bytes}};
}

}  // namespace

std::string format_json(const DetectReport& report) {
  Json frames = Json::array();
  for (const FrameReport& frame : report.frames) frames.push_back(format_frame(frame));
  Json root{{"vertices", report.vertices},
            {"triangles", report.triangles},
            {"edges", report.edges},
            {"tier", to_string(report.options.tier)},
            {"tolerance", report.options.tolerance},
            {"threads", report.threads},
            {"front", to_string(report.options.front)},
            {"bounds", to_string(report.options.bounds)},
            {"contacts_hash", report.contacts_hash}};
  add_to(root, report.model);
  root["range"] = to_json(report.range);
  root["frames"] = std::move(frames);
  return root.dump(1) + "\n";
}

}  // namespace warmfront::client
