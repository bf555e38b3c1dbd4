// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/fast.h"

#include <algorithm>

#include "engine/elementary/cubic.h"
#include "engine/elementary/distance_below.h"
#include "engine/elementary/float_roots.h"

namespace warmfront {
namespace {

// Nearly parallel sides span no plane to be inside of, and count as apart.
bool spans(const Vec3& n, const Vec3& p, const Vec3& q) {
  return dot(n, n) > 0x1p-70 * dot(p, p) * dot(q, q);
}

bool inside_at(const Query& query, double t) {
  const Vec3 a = query.from0[0].at(t);
  const Vec3 b = query.from0[1].at(t);
  const Vec3 c = query.from0[2].at(t);
  if (query.kind == ContactKind::kVertexFace) {
    const Vec3 n = cross(b - a, c - a);
    return spans(n, b - a, c - a) && dot(cross(b, c), n) >= 0 && dot(cross(c, a), n) >= 0 &&
           dot(cross(a, b), n) >= 0;
  }
  const Vec3 h = c - b;
  const Vec3 n = cross(a, h);
  const double nn = dot(n, n);
  const double along_e = dot(cross(b, h), n);
  const double along_h = dot(cross(b, a), n);
  return spans(n, a, h) && along_e >= 0 && along_e <= nn && along_h >= 0 && along_h <= nn;
}

// A root at which the points seem to be inside, as a contact; unless bounds or distances certainly exclude
// it: culls drop such pairs in some frames and not in others.
Verdict contact_at(const Query& query, double root, double latest) {
  Window window;
  if (!trim_by_kdop(query, window)) return {};
  const double toi = std::clamp(root, window.begin, window.end);
  constexpr double kClose = 0x1p-20;  // well below certified_reach() of the least size, 1/2
  if (toi > latest || distance_below(query, root) > kClose) return {};
  return Verdict::at(toi, ContactStatus::kHit);
}

}  // namespace

Verdict fast_test(const FeatureVertices& features, double latest) {
  const Query query = Query::prepare(features, 0);
  if (query.size == 0) return Verdict::at(0, ContactStatus::kHit);
  const PowerCubic f(Cubic(query).coefficient);
  const Turns turns(f);
  double before = f.c0;
  for (int i = 1; i < turns.count; ++i) {
    const double after = f.at(turns.time[i]);
    if ((before <= 0 && after >= 0) || (before >= 0 && after <= 0)) {
      const double root = root_between(f, turns.time[i - 1], turns.time[i], before);
      if (inside_at(query, root)) {
        if (const Verdict verdict = contact_at(query, root, latest); verdict.contact) return verdict;
      }
    }
    before = after;
  }
  return {};
}

}  // namespace warmfront
