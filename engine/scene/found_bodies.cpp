// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/found_bodies.h"

#include <algorithm>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/scene_edges.h"

namespace warmfront {
namespace {

/// Fewest faces and lone edges of a body: a full block; a full leaf where that gives many bodies, all of
/// which may be near all others.
constexpr std::uint32_t kFewest = 8;
constexpr std::uint32_t kFewestOfMany = 64;
constexpr std::size_t kMany = 512;

// By vertex: the end of the vertices that its faces and lone edges reach, and how many of these have it as
// their least vertex.
struct Reach {
  std::vector<std::uint32_t> end;
  std::vector<std::uint32_t> elements;

  Reach(const Scene& scene, StopSignal stop) {
    lengthen(elements, scene.vertex_count(), 0U, stop);
    end.reserve(scene.vertex_count());
    PacedStop paced(stop);
    for (std::uint32_t v = 0; v < scene.vertex_count(); ++v) {
      paced.check();
      end.push_back(v + 1);
    }
    const auto take = [&](std::uint32_t least, std::uint32_t greatest) {
      paced.check();
      end[least] = std::max(end[least], greatest + 1);
      ++elements[least];
    };
    for (const Face& face : scene.faces()) {
      const auto [least, greatest] = std::minmax({face[0], face[1], face[2]});
      take(least, greatest);
    }
    for (const EdgeId e : lone_edges(scene)) take(ends_of(scene, e)[0], ends_of(scene, e)[1]);
  }
};

std::vector<Body> ranges(const Scene& scene, const Reach& reach, std::uint32_t fewest, StopSignal stop) {
  PacedStop paced(stop);
  std::vector<Body> bodies;
  std::uint32_t first = 0;
  std::uint32_t end = 0;
  std::uint32_t elements = 0;
  for (std::uint32_t v = 0; v < scene.vertex_count(); ++v) {
    paced.check();
    end = std::max(end, reach.end[v]);
    elements += reach.elements[v];
    if (end > v + 1 || elements < fewest) continue;
    bodies.push_back({"", first, v + 1 - first});
    first = v + 1;
    elements = 0;
  }
  if (!bodies.empty()) bodies.back().vertex_count += scene.vertex_count() - first;  // remainder too small
  return bodies;
}

}  // namespace

std::vector<Body> found_bodies(const Scene& scene, StopSignal stop) {
  const Reach reach(scene, stop);
  std::vector<Body> bodies = ranges(scene, reach, kFewest, stop);
  if (bodies.size() > kMany) bodies = ranges(scene, reach, kFewestOfMany, stop);
  if (bodies.size() < 2) bodies.clear();
  return bodies;
}

}  // namespace warmfront
