// SPDX-License-Identifier: Apache-2.0
// A list of changes of a scene, carried out one after the other. Used by one thread; throws Stopped when told
// to stop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/result.h"
#include "engine/scene.h"
#include "engine/scene/replaced_bodies.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// A list of changes in progress, one after the other; nothing of it is seen before finish().
class SceneEdit {
 public:
  SceneEdit(const Scene& before, StopSignal stop)
      : before_(before), scene_(before), stop_(stop), sizes_(sizes_of(before)) {}

  Status carry_out(AddBody& change, std::size_t at);
  Status carry_out(ChangeBody& change, std::size_t at);
  Status carry_out(ChangeFilters& change, std::size_t at);
  Status carry_out(ChangeExcludedPairs& change, std::size_t at);
  Status carry_out(ReplaceElements& change, std::size_t at);
  Status carry_out(ReplaceBody& change, std::size_t at);

  /// What is said of all bodies together.
  Status check_bodies() const;
  Scene finish(ReplacedBodies& replaced);

 private:
  struct Sizes {
    std::uint64_t vertices = 0, faces = 0, lone_edges = 0;

    void add(const Sizes& more) {
      vertices += more.vertices;
      faces += more.faces;
      lone_edges += more.lone_edges;
    }
    void subtract(const Sizes& less) {
      vertices -= less.vertices;
      faces -= less.faces;
      lone_edges -= less.lone_edges;
    }
  };
  static Sizes sizes_of(const Scene& scene) {
    return {scene.vertex_count(), scene.face_count(), scene.lone_edges().size()};
  }
  Sizes sizes_of(std::uint32_t index) const;
  MeshRange range_before(std::uint32_t first, std::uint32_t end) const;
  std::span<const double> thickness_of(std::uint32_t index) const;
  Status check_index(std::uint32_t index) const;
  static SceneDescription description_of(Body body, BodyAddition addition);
  Result<Scene> alone(Body body, BodyAddition addition) const;
  Result<ReplacedBodies::Piece> with_elements(std::uint32_t index, BodyAddition elements) const;
  Status take_piece(ReplacedBodies::Piece piece);
  Status replace_whole(ReplaceElements& change);
  Status replace_filtered(const Body& old, const Body& body, std::span<const double> positions,
                          const std::string& where);
  const PairFilters& filters() const { return filters_ ? *filters_ : before_.filters(); }
  PairFilters& changed_filters() { return filters_ ? *filters_ : filters_.emplace(before_.filters()); }
  void order_faces();
  std::vector<SceneSlice> slices() const;

  const Scene& before_;
  std::optional<Scene> ordered_;  // the same with its faces by body, once something is replaced
  std::vector<std::uint32_t> face_rank_;
  Scene scene_;  // so far, but for its mesh and filters
  const StopSignal stop_;
  Sizes sizes_;  // so far
  std::map<std::uint32_t, ReplacedBodies::Piece> pieces_;
  std::optional<PairFilters> filters_;  // where they change
  bool whole_scene_ = false;
};

}  // namespace warmfront
