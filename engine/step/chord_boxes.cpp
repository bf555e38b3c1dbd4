// SPDX-License-Identifier: Apache-2.0
#include "engine/step/chord_boxes.h"

#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

struct Box {
  Double4 low;
  Double4 high;
};

WARMFRONT_INLINE Box load_box(const ChordBox& from) {
  return {load<Double4>(from.low.data()), load<Double4>(from.high.data())};
}

WARMFRONT_INLINE void store(const Box& box, ChordBox& to) {
  std::memcpy(to.low.data(), &box.low, sizeof box.low);
  std::memcpy(to.high.data(), &box.high, sizeof box.high);
}

WARMFRONT_INLINE Box between(Double4 a, Double4 b) {
  return {lesser(a, b), greater(a, b)};
}

WARMFRONT_INLINE Box both(const Box& a, const Box& b) {
  return {lesser(a.low, b.low), greater(a.high, b.high)};
}

WARMFRONT_INLINE bool are_near(const Box& a, const Box& b, Double4 room) {
  return !any((Int8)((a.low - b.high > room) | (b.low - a.high > room)));
}

// As an 18-DOP's: along the three axes, and the six between two of them.
struct ChordDop {
  Box straight;
  Box sums;
  Box differences;
};

WARMFRONT_INLINE Double4 next_axes(Double4 x) {
  return shuffle<1, 2, 0, 3>(x, x);
}

WARMFRONT_INLINE ChordDop dop_between(Double4 a, Double4 b) {
  const Double4 c = next_axes(a);
  const Double4 d = next_axes(b);
  return {between(a, b), between(a + c, b + d), between(a - c, b - d)};
}

WARMFRONT_INLINE ChordDop both(const ChordDop& a, const ChordDop& b) {
  return {both(a.straight, b.straight), both(a.sums, b.sums), both(a.differences, b.differences)};
}

struct Rooms {
  Double4 straight;
  Double4 diagonal;
};

WARMFRONT_INLINE bool are_near(const ChordDop& a, const ChordDop& b, const Rooms& room) {
  return are_near(a.straight, b.straight, room.straight) && are_near(a.sums, b.sums, room.diagonal) &&
         are_near(a.differences, b.differences, room.diagonal);
}

}  // namespace

WARMFRONT_TARGET_CLONES
void along_arc(const ArcPath& path, std::span<const ArcTime> times, Corner* to, std::size_t stride) {
  const auto start = load<Double4>(path.start.data());
  const auto way = load<Double4>(path.way.data());
  const auto bend = load<Double4>(path.bend.data());
  const auto turn = load<Double4>(path.turn.data());
  for (std::size_t k = 0; k < times.size(); ++k) {
    const auto& [time, shares] = times[k];
    const Double4 at = (start + time * way) + (shares.of_bend * bend + shares.of_turn * turn);
    std::memcpy(to[k * stride].data(), &at, sizeof at);
  }
}

WARMFRONT_TARGET_CLONES
ChordBox around_points(std::span<const Corner> points) {
  const auto first = load<Double4>(points[0].data());
  Box all{first, first};
  for (const Corner& point : points.subspan(1)) {
    const auto x = load<Double4>(point.data());
    all = both(all, {x, x});
  }
  ChordBox box;
  store(all, box);
  return box;
}

WARMFRONT_TARGET_CLONES
void around_chords(std::span<const Corner> from, std::span<const Corner> to, ChordBox* boxes) {
  for (std::size_t i = 0; i < from.size(); ++i)
    store(between(load<Double4>(from[i].data()), load<Double4>(to[i].data())), boxes[i]);
}

WARMFRONT_TARGET_CLONES
void around_primitives(std::span<const ChordBox> vertices,
                       std::span<const std::array<std::uint32_t, 3>> corners, ChordBox* boxes) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto [a, b, c] = corners[i];
    store(both(both(load_box(vertices[a]), load_box(vertices[b])), load_box(vertices[c])), boxes[i]);
  }
}

WARMFRONT_TARGET_CLONES
std::uint32_t near_features(FaceTimes f, FaceTimes g, double room) {
  constexpr std::uint32_t kAll = (1U << 15) - 1;
  const double diagonal = kDiagonal * room;
  const Rooms rooms{{room, room, room, room}, {diagonal, diagonal, diagonal, diagonal}};
  std::uint32_t near = 0;
  for (std::size_t k = 0; k + 1 < f.size() && near != kAll; ++k) {
    ChordDop of_f[3];
    ChordDop of_g[3];
    for (int i = 0; i < 3; ++i) {
      of_f[i] = dop_between(load<Double4>(f[k][i].data()), load<Double4>(f[k + 1][i].data()));
      of_g[i] = dop_between(load<Double4>(g[k][i].data()), load<Double4>(g[k + 1][i].data()));
    }
    const ChordDop face_f = both(both(of_f[0], of_f[1]), of_f[2]);
    const ChordDop face_g = both(both(of_g[0], of_g[1]), of_g[2]);
    if (!are_near(face_f, face_g, rooms)) continue;
    ChordDop sides_g[3];
    for (int j = 0; j < 3; ++j) sides_g[j] = both(of_g[j], of_g[(j + 1) % 3]);
    for (int i = 0; i < 3; ++i) {
      near |= std::uint32_t{are_near(of_f[i], face_g, rooms)} << i;
      near |= std::uint32_t{are_near(of_g[i], face_f, rooms)} << (3 + i);
      const ChordDop side_f = both(of_f[i], of_f[(i + 1) % 3]);
      if (!are_near(side_f, face_g, rooms)) continue;
      for (int j = 0; j < 3; ++j)
        near |= std::uint32_t{are_near(side_f, sides_g[j], rooms)} << (6 + 3 * i + j);
    }
  }
  return near;
}

}  // namespace warmfront
