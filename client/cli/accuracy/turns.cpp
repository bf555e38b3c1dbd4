// SPDX-License-Identifier: Apache-2.0
#include "client/cli/accuracy/turns.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "client/cli/json_rows.h"
#include "client/cli/markdown.h"
#include "client/cli/print.h"
#include "client/cli/queries/query_run.h"
#include "engine/collider.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;
using Vector = std::array<double, 3>;

Vector middle_of(const Body& body, std::span<const double> x) {
  Vector middle{};
  for (std::size_t i = 0; i < 3 * std::size_t{body.vertex_count}; ++i)
    middle[i % 3] += x[3 * std::size_t{body.first_vertex} + i];
  for (double& m : middle) m /= body.vertex_count;
  return middle;
}

// The same for a number on every machine.
Vector axis_of(std::uint32_t number) {
  std::mt19937_64 random(number + 1);
  Vector axis{};
  double square = 0;
  while (square < 0.01 || square > 1) {
    square = 0;
    for (double& a : axis) {
      a = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
      square += a * a;
    }
  }
  for (double& a : axis) a /= std::sqrt(square);
  return axis;
}

// By Rodrigues' formula, about an axis through a point.
Pose turned(const Vector& axis, double angle, const Vector& point) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const double cross[3][3] = {{0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}};
  Pose pose;
  for (std::size_t i = 0; i < 3; ++i) {
    double moved = point[i];
    for (std::size_t j = 0; j < 3; ++j) {
      const double entry = (i == j ? c : 0) + (1 - c) * axis[i] * axis[j] + s * cross[i][j];
      pose.matrix[4 * i + j] = entry;
      moved -= entry * point[j];
    }
    pose.matrix[4 * i + 3] = moved;
  }
  return pose;
}

using Pair = std::array<std::uint32_t, 3>;

struct Way {
  Collider collider;
  std::vector<Pair> pairs;
  std::vector<double> ms;
};

Result<Way> make_way(const SceneDescription& scene, bool screws, std::span<const double> x,
                     const ColliderOptions& options, const std::shared_ptr<Workers>& workers) {
  SceneDescription description = scene;
  for (Body& body : description.bodies)
    body.screw = screws && body.kind == BodyKind::kRigid && !body.half_space;
  Result<Scene> made = Scene::create(std::move(description));
  if (!made) return made.error();
  Result<Collider> collider =
      Collider::create(std::make_shared<const Scene>(std::move(made).value()), x, options, workers);
  if (!collider) return collider.error();
  return Way{std::move(collider).value(), {}, {}};
}

// A step, after which everything is put back.
Status turn(Way& way, const Frame& frame, const Frame& back) {
  const auto start = std::chrono::steady_clock::now();
  const Result<StepResult> result = way.collider.step(frame);
  const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
  if (!result) return result.error();
  way.ms.push_back(ms.count());
  way.pairs.clear();
  for (const Contact& c : result.value().contacts)
    way.pairs.push_back({static_cast<std::uint32_t>(c.kind), c.a, c.b});
  return way.collider.place(back);
}

std::uint64_t only_in(const std::vector<Pair>& a, const std::vector<Pair>& b) {
  std::vector<Pair> only;
  std::ranges::set_difference(a, b, std::back_inserter(only));
  return only.size();
}

Json to_json(const TurnRow& row) {
  return {{"set", row.set},
          {"degrees", row.degrees},
          {"on_screws", row.on_screws},
          {"on_lines", row.on_lines},
          {"missed", row.missed},
          {"invented", row.invented},
          {"ms_screws", row.ms_screws},
          {"ms_lines", row.ms_lines}};
}

}  // namespace

Result<std::vector<TurnRow>> measure_turns(const std::string& name, Input& input, std::uint32_t frame,
                                           std::span<const double> degrees, double min_separation,
                                           std::uint32_t rounds, const std::shared_ptr<Workers>& workers) {
  PositionBuffer buffer;
  if (Status status = input.read_frame(frame, buffer); !status) return status.error();
  const std::vector<double> x = std::visit(
      [](const auto& values) { return std::vector<double>(values.begin(), values.end()); }, buffer);
  const SceneDescription& scene = input.scene();
  const ColliderOptions options{.min_separation = min_separation};
  Result<Way> on_screws = make_way(scene, true, x, options, workers);
  if (!on_screws) return on_screws.error();
  Result<Way> on_lines = make_way(scene, false, x, options, workers);
  if (!on_lines) return on_lines.error();
  std::vector<TurnRow> rows;
  for (const double angle : degrees) {
    std::vector<BodyPose> poses;
    for (std::uint32_t b = 0; b < scene.bodies.size(); ++b) {
      const Body& body = scene.bodies[b];
      if (body.kind == BodyKind::kRigid && !body.half_space)
        poses.push_back({b, turned(axis_of(b), angle * std::numbers::pi / 180, middle_of(body, x))});
    }
    if (poses.empty())
      return invalid_argument("--turns: " + name + " has no rigid body; its info.json may declare some");
    std::vector<BodyPose> identities = poses;
    for (BodyPose& pose : identities) pose.pose = Pose{};
    Frame to, back;
    to.poses = poses;
    back.poses = identities;
    for (Way* way : {&on_screws.value(), &on_lines.value()}) way->ms.clear();
    for (std::uint32_t round = 0; round < rounds; ++round) {
      for (Way* way : {&on_screws.value(), &on_lines.value()})
        if (Status status = turn(*way, to, back); !status) return status.error();
    }
    const auto& screws = on_screws.value();
    const auto& lines = on_lines.value();
    rows.push_back({name, angle, screws.pairs.size(), lines.pairs.size(), only_in(screws.pairs, lines.pairs),
                    only_in(lines.pairs, screws.pairs), median(screws.ms), median(lines.ms)});
  }
  return rows;
}

std::string format_turns_table(std::span<const TurnRow> rows) {
  std::vector<Cells> table{
      {"degrees a step", "on screws", "on lines", "missed by lines", "invented", "screws, ms", "lines, ms"}};
  for (const TurnRow& row : rows)
    table.push_back({print("%g", row.degrees), std::to_string(row.on_screws), std::to_string(row.on_lines),
                     std::to_string(row.missed), std::to_string(row.invented), print("%.2f", row.ms_screws),
                     print("%.2f", row.ms_lines)});
  return rows.front().set + "\n\n" + format_markdown_table(table, 0);
}

std::string format_turns_csv(std::span<const TurnRow> rows) {
  std::vector<Json> fields;
  for (const TurnRow& row : rows) fields.push_back(to_json(row));
  return csv_of(to_json({}), fields);
}

std::string format_turns_json(std::span<const TurnRow> rows) {
  Json json = Json::array();
  for (const TurnRow& row : rows) json.push_back(to_json(row));
  return json.dump(1) + "\n";
}

}  // namespace warmfront::client
