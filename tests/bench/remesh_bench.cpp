// SPDX-License-Identifier: Apache-2.0
// What a frame costs of which a part of a cloth is remeshed, beside the same frame without: a rippling cloth
// over a ball, in tiles that are a body each, of which one gets another mesh in every frame; and the same
// cloth as one body, of which one face in a hundred is another one, with the ball and without. Prints ratios
// of medians within one run, what a session made anew takes, and what memory_bytes() becomes over many
// changes; passes no verdict.
//   remesh_bench [SIDE [TILES [FRAMES [THREADS [CHANGES]]]]]   a cloth of SIDE x SIDE quads in TILES x TILES
//   tiles; 210 quads, 10 tiles, 30 frames, 1 thread and 10,000 changes unless given
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/bench/remesh_scenes.h"
#include "tests/bench/timing.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

Collider make(SceneDescription scene, const std::vector<double>& positions,
              const std::shared_ptr<Workers>& workers) {
  return Collider::create(std::make_shared<const Scene>(Scene::create(std::move(scene)).value()),
                          doubles(positions), {}, workers)
      .value();
}

void print(const char* what, const std::vector<double>& without, const std::vector<double>& change,
           const std::vector<double>& with, const std::vector<double>& anew) {
  const double base = median(without);
  std::vector<double> sums(change.size());
  std::ranges::transform(change, with, sums.begin(), std::plus<>());
  std::printf(
      "%-34s step %.2f ms; change %.2f + step %.2f ms: %.2f of it; a session made anew %.1f ms: %.1f\n", what,
      base, median(change), median(with), median(sums) / base, median(anew), median(anew) / base);
}

bool remesh_tiles(const Cloth& cloth, const RemeshSettings& settings,
                  const std::shared_ptr<Workers>& workers) {
  Tiles still(cloth, settings), remeshed(cloth, settings);
  Collider without = make(still.scene(), still.positions(0), workers);
  Collider with = make(remeshed.scene(), remeshed.positions(0), workers);
  std::printf("%u faces in %u bodies\n", with.scene().face_count(), with.scene().body_count());
  std::vector<double> base, change, step, anew;
  bool same = true;
  for (int f = 1; f < settings.frames; ++f) {
    const std::vector<double> to = still.positions(f);
    timed(base, [&] { return without.step(doubles(to)).value(); });
    const auto tile = static_cast<std::uint32_t>(37 * f) % remeshed.count();
    remeshed.remesh(tile);
    BodyAddition body = remeshed.body(tile);
    const std::vector<double> at = remeshed.positions_of(f - 1, tile);
    same &= timed(change, [&] { return with.replace_body(tile, std::move(body), doubles(at)).ok(); });
    const std::vector<double> other = remeshed.positions(f);
    const StepResult found = timed(step, [&] { return with.step(doubles(other)).value(); });
    if (f % 5 != 0) continue;
    const std::vector<double> before = remeshed.positions(f - 1);
    std::vector<Contact> fresh_found;
    timed(anew, [&] {
      Collider fresh = make(remeshed.scene(), before, workers);
      const StepResult result = fresh.step(doubles(other)).value();
      fresh_found.assign(result.contacts.begin(), result.contacts.end());
      return 0;
    });
    same &= std::ranges::equal(found.contacts, fresh_found);
  }
  print("one tile of them remeshed:", base, change, step, anew);
  return same;
}

// Which faces of the cloth, as one body, are others in a frame.
enum class Where { kOnePatch, kFourPatches, kEverywhere };

// The other diagonal for the quads of square patches, together a hundredth of all, which are elsewhere in
// every frame; or every hundredth face turned over.
void remesh(Faces& faces, int side, int frame, Where where) {
  if (where == Where::kEverywhere) {
    for (std::size_t face = static_cast<std::size_t>(frame) % 100; face < faces.size(); face += 100)
      std::swap(faces[face][1], faces[face][2]);
    return;
  }
  const int patches = where == Where::kOnePatch ? 1 : 4;
  const int width = std::max(1, static_cast<int>(std::lround(0.1 * side / std::sqrt(patches))));
  for (int patch = 0; patch < patches; ++patch) {
    const int at = 37 * frame + 101 * patch;
    const int first_row = at % (side - width), first_column = (7 * at) % (side - width);
    for (int i = first_row; i < first_row + width; ++i) {
      for (int j = first_column; j < first_column + width; ++j) {
        auto* const two = faces.data() + 2 * (static_cast<std::size_t>(i) * side + j);
        const auto corner = [&](int a, int b) {
          return static_cast<std::int32_t>((i + a) * (side + 1) + j + b);
        };
        const bool other = std::ranges::find(two[0], corner(0, 0)) != two[0].end() &&
                           std::ranges::find(two[0], corner(1, 1)) != two[0].end();
        if (other) {
          two[0] = {corner(0, 0), corner(1, 0), corner(0, 1)};
          two[1] = {corner(1, 0), corner(1, 1), corner(0, 1)};
        } else {
          two[0] = {corner(0, 0), corner(1, 0), corner(1, 1)};
          two[1] = {corner(0, 0), corner(1, 1), corner(0, 1)};
        }
      }
    }
  }
}

bool remesh_one_body(const char* what, const Cloth& cloth, const RemeshSettings& settings, bool with_ball,
                     Where where, const std::shared_ptr<Workers>& workers) {
  const auto cloth_vertices = static_cast<std::uint32_t>(cloth.cloth_vertices());
  const auto scene = [&](const Faces& faces) {
    SceneDescription scene{cloth_vertices, faces, {{"", 0, cloth_vertices}}};
    if (!with_ball) return scene;
    const SceneDescription& whole = cloth.over_ball().description;
    for (const auto& face : whole.faces) {
      if (face[0] >= static_cast<std::int32_t>(cloth_vertices)) scene.faces.push_back(face);
    }
    scene.bodies.push_back({"", cloth_vertices, whole.vertex_count - cloth_vertices});
    scene.vertex_count = whole.vertex_count;
    return scene;
  };
  std::vector<std::vector<double>> frames = cloth.over_ball().frames;
  Faces faces = grid(settings.side);
  for (auto& frame : frames) frame.resize(std::size_t{3} * scene(faces).vertex_count);
  Collider without = make(scene(faces), frames[0], workers), with = make(scene(faces), frames[0], workers);
  std::vector<double> base, change, step, anew;
  bool same = true;
  for (int f = 1; f < settings.frames; ++f) {
    const std::vector<double>& to = frames[static_cast<std::size_t>(f)];
    timed(base, [&] { return without.step(doubles(to)).value(); });
    remesh(faces, settings.side, f, where);
    Faces other = faces;
    same &= timed(change, [&] { return with.replace_elements(0, std::move(other)).ok(); });
    const StepResult found = timed(step, [&] { return with.step(doubles(to)).value(); });
    if (f % 10 != 0) continue;
    std::vector<Contact> fresh_found;
    timed(anew, [&] {
      Collider fresh = make(scene(faces), frames[static_cast<std::size_t>(f - 1)], workers);
      const StepResult result = fresh.step(doubles(to)).value();
      fresh_found.assign(result.contacts.begin(), result.contacts.end());
      return 0;
    });
    same &= std::ranges::equal(found.contacts, fresh_found);
  }
  print(what, base, change, step, anew);
  return same;
}

// A small body beside another one, whose mesh is replaced repeatedly.
bool memory(const RemeshSettings& settings, const std::shared_ptr<Workers>& workers) {
  const auto sheet = [](int quads, double height) {
    std::vector<double> positions;
    for (int i = 0; i <= quads; ++i) {
      for (int j = 0; j <= quads; ++j) {
        positions.push_back(static_cast<double>(i) / quads);
        positions.push_back(static_cast<double>(j) / quads);
        positions.push_back(height);
      }
    }
    return positions;
  };
  SceneDescription scene{98, grid(6), {{"", 0, 49}, {"", 49, 49}}};
  for (const auto& face : grid(6)) scene.faces.push_back({face[0] + 49, face[1] + 49, face[2] + 49});
  std::vector<double> positions = sheet(6, 0);
  const std::vector<double> above = sheet(6, 0.02);
  positions.insert(positions.end(), above.begin(), above.end());
  Collider collider = make(scene, positions, workers);
  std::size_t after_ten = 0;
  bool done = true;
  for (int i = 1; i <= settings.changes; ++i) {
    const int quads = 5 + i % 3;
    BodyAddition body = sheet_of(quads);
    const std::vector<double> at = sheet(quads, 0.01 * (1 + i % 2));
    done &= collider.replace_body(1, std::move(body), doubles(at)).ok();
    std::vector<double> to = collider.positions();
    for (std::size_t z = 2; z < to.size(); z += 3) to[z] += z < 147 ? 0.001 : -0.001;
    done &= collider.step(doubles(to)).ok();
    if (i == 10) after_ten = collider.memory_bytes();
    if (i == 10 || i == settings.changes)
      std::printf("%d changes of a body of about 49 vertices: %u vertices, %zu bytes\n", i,
                  collider.scene().vertex_count(), collider.memory_bytes());
  }
  return done && after_ten > 0;
}

// The same of a body of which a few faces are others each time.
bool memory_of_local_changes(const RemeshSettings& settings, const std::shared_ptr<Workers>& workers) {
  constexpr int kQuads = 20;
  const Faces whole = grid(kQuads);
  const SceneDescription scene{(kQuads + 1) * (kQuads + 1), whole, {{"", 0, (kQuads + 1) * (kQuads + 1)}}};
  std::vector<double> positions;
  for (int i = 0; i <= kQuads; ++i) {
    for (int j = 0; j <= kQuads; ++j) positions.insert(positions.end(), {1.0 * i, 1.0 * j, 0.0});
  }
  Collider collider = make(scene, positions, workers);
  bool done = true;
  for (int i = 1; i <= settings.changes; ++i) {
    Faces faces = whole;
    const auto at = static_cast<std::ptrdiff_t>(i * 7 % 780);
    faces.erase(faces.begin() + at, faces.begin() + at + i % 4);
    for (int more = i % 3; more > 0; --more) faces.push_back(whole[static_cast<std::size_t>(at + more)]);
    done &= collider.replace_elements(0, std::move(faces)).ok();
    for (std::size_t z = 2; z < positions.size(); z += 3) positions[z] += i % 2 == 0 ? 0.01 : -0.01;
    done &= collider.step(doubles(positions)).ok();
    if (i == 10 || i == settings.changes)
      std::printf("%d local changes of a body of 800 faces: %zu bytes\n", i, collider.memory_bytes());
  }
  return done;
}

int run(const RemeshSettings& settings) {
  const auto workers = std::make_shared<Workers>(settings.threads);
  const Cloth cloth(settings.side, settings.frames);
  const bool tiles = remesh_tiles(cloth, settings, workers);
  const auto one_body = [&](const char* what, bool with_ball, Where where) {
    return remesh_one_body(what, cloth, settings, with_ball, where, workers);
  };
  bool one = one_body("as one body, 1% in one patch:", true, Where::kOnePatch);
  one &= one_body("as one body, 1% in four patches:", true, Where::kFourPatches);
  one &= one_body("as one body, 1% all over it turned:", true, Where::kEverywhere);
  one &= one_body("no ball, 1% in one patch:", false, Where::kOnePatch);
  one &= one_body("no ball, 1% in four patches:", false, Where::kFourPatches);
  const bool kept = memory(settings, workers) && memory_of_local_changes(settings, workers);
  if (!tiles || !one || !kept) std::printf("a change failed, or a step found other contacts than one anew\n");
  return tiles && one && kept ? 0 : 1;
}

}  // namespace
}  // namespace warmfront::testing

int main(int count, char** values) {
  warmfront::testing::RemeshSettings settings;
  int* const fields[] = {&settings.side, &settings.tiles, &settings.frames, &settings.threads,
                         &settings.changes};
  for (int i = 1; i < count && i <= 5; ++i) *fields[i - 1] = std::atoi(values[i]);
  if (settings.frames <= 10) {
    std::fprintf(stderr, "remesh_bench: FRAMES: 11 at least, every tenth is compared with a session made anew\n");
    return 3;
  }
  return warmfront::testing::run(settings);
}
