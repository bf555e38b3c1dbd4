// SPDX-License-Identifier: Apache-2.0
#include "tests/support/torture.h"

#include <cmath>
#include <cstdio>
#include <iterator>
#include <string>

#include "tests/support/draws.h"
#include "tests/support/torture_families.h"

namespace warmfront::testing {
namespace {

using namespace torture;

using Made = FeatureCase (*)(Random&, ContactKind);

// Another family's query at another place and scale, with another rounding or two.
FeatureCase composed(Random& random, ContactKind kind) {
  constexpr Made kBase[] = {
      made_and_pushed, lattice,        grazing_rim, touching_in_time, at_an_end,
      within_a_plane,  on_a_line,      zero_area,   needle,           duplicate_vertices,
      several_roots,   parallel_edges, no_motion,   tiny_displacement};
  const FeatureCase base = kBase[below(random, std::ssize(kBase))](random, kind);
  Ends ends;
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      ends.t0[k][axis] = base.vertices[k].t0[axis];
      ends.t1[k][axis] = base.vertices[k].t1[axis];
    }
  }
  if (one_in(random, 2)) scale(ends, between(random, -60, 60));
  if (one_in(random, 2)) {
    Point offset;
    for (double& x : offset) x = std::ldexp(uniform(random), between(random, -10, 50));
    ends.each([&](double& x, int, int axis) { x += offset[axis]; });
  }
  if (one_in(random, 3)) ends.each([](double& x, int, int) { x = static_cast<float>(x); });
  if (one_in(random, 3)) push(random, ends);
  if (one_in(random, 3)) scale(ends, between(random, -900, 900));
  return query_of(kind, ends);
}

constexpr TortureFamily kFamilies[] = {
    {"general", general},
    {"made", made},
    {"made, pushed", made_and_pushed},
    {"lattice", lattice},
    {"large offset", large_offset},
    {"extreme scale", extreme_scale},
    {"uneven axes", uneven_axes},
    {"needle", needle},
    {"grazing rim", grazing_rim},
    {"grazing rim, pushed", grazing_rim_pushed},
    {"touching in time", touching_in_time},
    {"touching in time, pushed", touching_in_time_pushed},
    {"at an end", at_an_end},
    {"at an end, pushed", at_an_end_pushed},
    {"within a plane", within_a_plane},
    {"nearly within a plane", nearly_within_a_plane},
    {"on a line", on_a_line},
    {"zero length", zero_length},
    {"zero area", zero_area},
    {"duplicate vertices", duplicate_vertices},
    {"no motion", no_motion},
    {"common motion", common_motion},
    {"huge displacement", huge_displacement},
    {"tiny displacement", tiny_displacement},
    {"several roots", several_roots},
    {"parallel edges", parallel_edges},
    {"denormals", denormals},
    {"tiny beside huge", tiny_beside_huge},
    {"chaos", chaos},
    {"largest doubles", largest_doubles},
    {"composed", composed},
};

}  // namespace

std::span<const TortureFamily> torture_families() {
  return kFamilies;
}

std::string to_text(const FeatureCase& query) {
  std::string text = query.kind == ContactKind::kVertexFace ? "vf" : "ee";
  for (const auto end : {&VertexMotion::t0, &VertexMotion::t1}) {
    text += " {{";
    for (int k = 0; k < 4; ++k) {
      const auto& p = query.vertices[k].*end;
      char point[96];
      std::snprintf(point, sizeof point, "%s{%a, %a, %a}", k == 0 ? "" : ", ", p[0], p[1], p[2]);
      text += point;
    }
    text += "}}";
  }
  return text;
}

}  // namespace warmfront::testing
