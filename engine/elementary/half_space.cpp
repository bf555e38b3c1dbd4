// SPDX-License-Identifier: Apache-2.0
// The bounds of rounding are derived in README.md, "Half-spaces".
#include "engine/elementary/half_space.h"

#include "engine/elementary/exact_half_space.h"
#include "engine/elementary/vec3.h"

namespace warmfront {
namespace {

/// Of the largest coordinates of n and of x - p (plus the separation): no number below is farther from its
/// true value, the halving of time included.
constexpr double kError = 0x1p-43;
/// The margin by which HalfSpaceFilter leaves out: more than twice as much, and what the least window adds.
constexpr double kFilter = 0x1p-41;
/// So many halvings of time.
constexpr int kHalvings = 46;
/// Within these the largest coordinates of n and of x - p leave room for products and squares.
constexpr double kLeast = 0x1p-300;
constexpr double kMost = 0x1p300;

using Vector = std::array<double, 3>;

double largest(const Vector& v) {
  return std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])});
}
double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
double length(const Vector& v) {
  return std::sqrt(dot(v, v));
}
Vector difference(const std::array<double, 4>& x, const Vector& p) {
  return {x[0] - p[0], x[1] - p[1], x[2] - p[2]};
}
bool comfortable(double value) {
  return value >= kLeast && value <= kMost;
}

// The half-space as it is at an instant, and the vertex.
HalfSpaceMotion resting(const HalfSpaceMotion& half_space, Instant at) {
  const std::size_t end = at == Instant::kStart ? 0 : 1;
  return {{half_space.point[end], half_space.point[end]}, {half_space.normal[end], half_space.normal[end]}};
}
VertexMotion resting(const VertexMotion& vertex, Instant at) {
  const auto& x = at == Instant::kStart ? vertex.t0 : vertex.t1;
  return {x, x};
}

/// f(t) and |n(t)| on a piece of the step.
struct Piece {
  std::array<double, 3> f;  // Bernstein coefficients
  Vector n0;                // n at both ends
  Vector n1;

  Piece first_half() const {
    const double a = 0.5 * (f[0] + f[1]);
    const double b = 0.5 * (f[1] + f[2]);
    return {{f[0], a, 0.5 * (a + b)}, n0, middle()};
  }
  Piece second_half() const {
    const double a = 0.5 * (f[0] + f[1]);
    const double b = 0.5 * (f[1] + f[2]);
    return {{0.5 * (a + b), b, f[2]}, middle(), n1};
  }
  Vector middle() const { return {0.5 * (n0[0] + n1[0]), 0.5 * (n0[1] + n1[1]), 0.5 * (n0[2] + n1[2])}; }
};

/// A pair in doubles.
class InDoubles {
 public:
  InDoubles(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation, bool certified)
      : separation_(separation) {
    const auto& [n0, n1] = half_space.normal;
    const Vector d0 = difference(vertex.t0, half_space.point[0]);
    const Vector d1 = difference(vertex.t1, half_space.point[1]);
    const double n = std::max(largest(n0), largest(n1));
    const double d = std::max(largest(d0), largest(d1));
    turns_ = half_space.turns();
    serves_ = comfortable(n) && (d == 0 || comfortable(d)) && (separation == 0 || comfortable(separation));
    whole_ = {{dot(n0, d0), 0, dot(n1, d1)}, n0, n1};
    whole_.f[1] = turns_ ? 0.5 * (dot(n0, d1) + dot(n1, d0)) : 0.5 * (whole_.f[0] + whole_.f[2]);
    error_ = certified ? kError * n * (d + separation) : 0;
  }

  /// Are the numbers of a size that the error bounds hold for?
  bool serves() const { return serves_; }
  double error() const { return error_; }
  /// f - s |n| at t = 0 and t = 1.
  double at_start() const { return whole_.f[0] - separation_ * length(whole_.n0); }
  double at_end() const { return whole_.f[2] - separation_ * length(whole_.n1); }
  double distance_at_start() const { return whole_.f[0] / length(whole_.n0); }

  /// The first time that is not excluded, and whether a contact is proved; none: excluded.
  Verdict search() const {
    if (at_start() <= error_) return Verdict::at(0, ContactStatus::kHit);
    if (!turns_) return linear();
    double begin = 0;
    if (!first(whole_, 0, 0, begin)) return {};
    return Verdict::at(begin, proved(begin) ? ContactStatus::kHit : ContactStatus::kPossible);
  }

 private:
  // |n| is constant, so that the whole is linear in time.
  Verdict linear() const {
    const double from = at_start();
    const double to = at_end();
    if (to > error_) return {};
    // Both ends may be less by the error: the root of that line is not later.
    const double root = (from - error_) / (from - to) * (1 - 0x1p-50);
    return Verdict::at(std::min(1.0, std::max(0.0, root)),
                       to <= -error_ ? ContactStatus::kHit : ContactStatus::kPossible);
  }

  // |n| is convex: no longer than what its ends say.
  bool clear(const Piece& piece) const {
    const double s0 = separation_ * length(piece.n0);
    const double s1 = separation_ * length(piece.n1);
    return piece.f[0] - s0 > error_ && piece.f[1] - 0.5 * (s0 + s1) > error_ && piece.f[2] - s1 > error_;
  }

  // The begin of the first least window that is not excluded.
  bool first(const Piece& piece, double begin, int depth, double& found) const {
    if (clear(piece)) return false;
    if (depth == kHalvings) {
      found = begin;
      return true;
    }
    return first(piece.first_half(), begin, depth + 1, found) ||
           first(piece.second_half(), begin + std::ldexp(1.0, -depth - 1), depth + 1, found);
  }

  // Is the vertex certainly within at some time that is looked at, from just after `begin` to the end?
  bool proved(double begin) const {
    const auto within = [&](double t) {
      const double a = lerp(whole_.f[0], whole_.f[1], t);
      const double b = lerp(whole_.f[1], whole_.f[2], t);
      Vector n;
      for (std::size_t k = 0; k < 3; ++k) n[k] = lerp(whole_.n0[k], whole_.n1[k], t);
      return lerp(a, b, t) - separation_ * length(n) <= -error_;
    };
    for (int k = kHalvings - 2; k > 0; k -= 4) {
      const double t = begin + std::ldexp(1.0, -k);
      if (t < 1 && within(t)) return true;
    }
    return at_end() <= -error_;
  }

  Piece whole_;
  double separation_;
  double error_;
  bool turns_;
  bool serves_;
};

Verdict until(const Verdict& verdict, double latest) {
  return verdict.contact && verdict.toi <= latest ? verdict : Verdict{};
}

Verdict exactly(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation,
                ElementaryCounts& counts) {
  return exact_half_space_test(vertex, half_space, separation, counts.exact_tests);
}

}  // namespace

Verdict half_space_test(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                        const ElementaryOptions& options, ElementaryCounts& counts) {
  const InDoubles pair(vertex, half_space, options.min_separation, options.tier != Tier::kFast);
  if (!pair.serves())
    return until(exactly(vertex, half_space, options.min_separation, counts), options.latest);
  const Verdict verdict = until(pair.search(), options.latest);
  if (options.tier == Tier::kFast && verdict.contact) return Verdict::at(verdict.toi, ContactStatus::kHit);
  const bool open = verdict.contact && verdict.status == ContactStatus::kPossible;
  if (!verdict.contact || (options.tier == Tier::kCertified && !open)) return verdict;
  const Verdict exact = exactly(vertex, half_space, options.min_separation, counts);
  if (options.tier == Tier::kExact) return until(exact, options.latest);
  return exact.contact ? Verdict::at(verdict.toi, ContactStatus::kHit) : Verdict{};
}

Verdict half_space_candidate(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                             const ElementaryOptions& options, ElementaryCounts& counts) {
  const InDoubles pair(vertex, half_space, options.min_separation, true);
  Verdict verdict =
      until(pair.serves() ? pair.search() : exactly(vertex, half_space, options.min_separation, counts),
            options.latest);
  verdict.status = ContactStatus::kBudget;
  return verdict;
}

Verdict half_space_proximity(const VertexMotion& vertex, const HalfSpaceMotion& half_space, Instant at,
                             const ElementaryOptions& options, ElementaryCounts& counts) {
  const double toi = at == Instant::kStart ? 0 : 1;
  const VertexMotion x = resting(vertex, at);
  const HalfSpaceMotion then = resting(half_space, at);
  const InDoubles pair(x, then, options.min_separation, true);
  if (pair.serves()) {
    const double excess = pair.at_start();
    if (excess > pair.error()) return {};
    if (excess <= -pair.error()) return {true, ContactStatus::kHit, toi};
  }
  if (!exactly(x, then, options.min_separation, counts).contact) return {};
  return {true, ContactStatus::kHit, toi};
}

double half_space_distance(const VertexMotion& vertex, const HalfSpaceMotion& half_space, Instant at) {
  const std::size_t end = at == Instant::kStart ? 0 : 1;
  const Vector& n = half_space.normal[end];
  const Vector& p = half_space.point[end];
  const auto& x = at == Instant::kStart ? vertex.t0 : vertex.t1;
  if (!(largest(n) > 0)) return 0;
  // By powers of two, n and x - p are brought near 1.
  const auto scaled = [](Vector v, int exponent) {
    for (double& of_axis : v) of_axis = std::ldexp(of_axis, -exponent);
    return v;
  };
  const int of_n = std::ilogb(largest(n));
  const Vector normal = scaled(n, of_n);
  const double reach = std::max(largest({x[0], x[1], x[2]}), largest(p));
  if (!std::isfinite(reach) || !std::isfinite(largest(n))) return 0;
  const int of_x = reach > 0x1p1000 ? 64 : 0;  // so that no difference overflows
  Vector d = scaled({x[0], x[1], x[2]}, of_x);
  const Vector q = scaled(p, of_x);
  for (std::size_t k = 0; k < 3; ++k) d[k] -= q[k];
  if (!(largest(d) > 0)) return 0;
  const int of_d = std::ilogb(largest(d));
  const double beneath = of_x == 0 ? 0 : std::ldexp(1.0, -1070 - of_d);  // what that scaling lost
  const double above = dot(normal, scaled(d, of_d)) - 2 * kError - 4 * beneath;
  if (!(above > 0)) return 0;
  const double least = std::ldexp(above / length(normal) * (1 - 0x1p-50), of_d + of_x);
  // Below that numbers are equally far apart, and it was rounded to one of them.
  return least < 0x1p-1000 ? std::nextafter(least, 0.0) : least * (1 - 0x1p-52);
}

Verdict half_space_keep_distance(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                                 const KeepDistance& keep, double latest, ElementaryCounts& counts) {
  const InDoubles start(vertex, half_space, 0, true);
  const double share = keep.share;
  double distance = half_space_distance(vertex, half_space, Instant::kStart);
  // From above: by twice the bound of what it is short by.
  const Vector d = difference(vertex.t0, half_space.point[0]);
  distance += 8 * kError * largest(d) + std::numeric_limits<double>::min();
  const double own = (share * distance + (1 - share) * keep.beyond) * (1 + 0x1p-48);
  const double separation = std::min(std::max(own, keep.beyond), std::numeric_limits<double>::max());
  const InDoubles pair(vertex, half_space, separation, true);
  // Where what the vertex may approach is less than rounding, only integers tell whether it does.
  const bool fine = pair.serves() && start.serves() && pair.at_start() > 0x1p8 * pair.error();
  return until(fine ? pair.search() : exactly(vertex, half_space, separation, counts), latest);
}

HalfSpaceFilter::HalfSpaceFilter(const HalfSpaceMotion& half_space, double separation,
                                 std::optional<Instant> at)
    : of_(half_space), at_(at), end_(at == Instant::kEnd ? 1 : 0), turns_(half_space.turns()) {
  const double n = std::max(largest(of_.normal[0]), largest(of_.normal[1]));
  const auto length_above = [](const Vector& v) {  // of any size
    const double most = largest(v);
    return most > 0 ? most * length({v[0] / most, v[1] / most, v[2] / most}) * (1 + 0x1p-49) + 0x1p-1073 : 0;
  };
  const double longest = std::max(length_above(of_.normal[0]), length_above(of_.normal[1]));
  beyond_ = separation == 0 ? 0 : separation * longest;
  of_size_ = kFilter * n;
  // What underflows is far less than the last.
  margin_ = kFilter * n * separation + 0x1p-1000;
}

namespace {

Vec3 vector_at(const std::array<Vector, 2>& ends, double t) {
  return lerp({ends[0][0], ends[0][1], ends[0][2]}, {ends[1][0], ends[1][1], ends[1][2]}, t);
}

// Of length 1; 0 for 0.
Vec3 unit(const Vec3& v) {
  const double largest = max_abs(v);
  if (!(largest > 0)) return {0, 0, 0};
  const int exponent = std::ilogb(largest);
  const Vec3 near_one{std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent), std::ldexp(v.z, -exponent)};
  return (1 / norm(near_one)) * near_one;
}

}  // namespace

ContactGeometry half_space_geometry(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                                    double toi) {
  const Vec3 x =
      lerp({vertex.t0[0], vertex.t0[1], vertex.t0[2]}, {vertex.t1[0], vertex.t1[1], vertex.t1[2]}, toi);
  Vec3 normal = unit(vector_at(half_space.normal, toi));
  if (max_abs(normal) == 0) normal = unit(vector_at(half_space.normal, 0));
  const double height = dot(normal, x - vector_at(half_space.point, toi));
  const bool outside = height > 0;
  const Vec3 foot = outside ? x - height * normal : x;
  ContactGeometry geometry;
  geometry.weights = {1, 0, 0, 0};
  geometry.normal = {normal.x, normal.y, normal.z};
  geometry.points = {x.x, x.y, x.z, foot.x, foot.y, foot.z};
  if (outside) {
    geometry.direction = geometry.normal;
    geometry.squared_distance = height * height;
  }
  geometry.closest = ClosestFeatures::kFaceVertex;
  return geometry;
}

}  // namespace warmfront
