// SPDX-License-Identifier: Apache-2.0
#include "client/lib/features.h"

namespace warmfront::client {
namespace {

// What a daemon without the feature would make of input that needs it.
const char* words_for(v1::Feature feature) {
  switch (feature) {
    case v1::FEATURE_EDGES:
      return "edges: the daemon is older than they are, and would miss contacts; update it, or leave them "
             "out";
    case v1::FEATURE_WORLDS:
      return "worlds: the daemon is older than they are, and would count contacts between them; update it, "
             "or "
             "give each world a session of its own";
    case v1::FEATURE_SCREW:
      return "screw: the daemon is older than it is, and would move the body along lines; update it, or give "
             "several poses for each turn";
    case v1::FEATURE_HALF_SPACES:
      return "half_space: the daemon is older than half-spaces; update it, or give a mesh instead";
    case v1::FEATURE_REPLACE:
      return "the daemon is older than replacing elements and bodies, and thickness of vertices that are "
             "added; "
             "update it, or create the session again with the other scene";
    case v1::FEATURE_OPTION_CHANGES:
      return "the daemon is older than changes of options and excluded pairs; update it, or create the "
             "session "
             "again with the others";
    case v1::FEATURE_THICKNESS:
      return "thickness: the daemon is older than it is, and would miss contacts; update it, or leave it out";
    default:
      return "filters: the daemon is older than they are, and would count what they leave out; update it, or "
             "leave them out";
  }
}

}  // namespace

RemoteError too_old_for(v1::Feature feature) {
  return {{ErrorCode::kUnimplemented, words_for(feature)}};
}

std::vector<v1::Feature> features_in(const v1::SessionHeader& header) {
  std::vector<v1::Feature> features;
  if (header.has_filters()) features.push_back(v1::FEATURE_PAIR_FILTERS);
  if (wire::is_thick(header)) features.push_back(v1::FEATURE_THICKNESS);
  if (wire::has_screws(header)) features.push_back(v1::FEATURE_SCREW);
  if (wire::has_worlds(header)) features.push_back(v1::FEATURE_WORLDS);
  if (header.edge_count() > 0) features.push_back(v1::FEATURE_EDGES);
  if (wire::has_half_spaces(header)) features.push_back(v1::FEATURE_HALF_SPACES);
  return features;
}

bool took(const v1::SessionInfo& info, v1::Feature feature) {
  // One that does not know these refuses their bytes, or a body without vertices.
  if (feature == v1::FEATURE_EDGES || feature == v1::FEATURE_HALF_SPACES) return true;
  if (feature == v1::FEATURE_WORLDS) return info.world_count() > 0;
  if (feature == v1::FEATURE_SCREW) return info.screw_count() > 0;
  return feature == v1::FEATURE_THICKNESS ? info.most_thickness() > 0 : info.has_filters();
}

}  // namespace warmfront::client
