// SPDX-License-Identifier: Apache-2.0
// A session to whose scene octahedra are added, replaced and removed, within limits.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/session/session.h"
#include "tests/support/observers.h"
#include "tests/support/scenes.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {

inline server::AddBody octahedron_to_add() {
  server::AddBody add;
  add.addition.body.vertex_count = 6;
  add.addition.faces = testing::octahedron();
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      for (int k = 0; k < 3; ++k) add.positions.push_back(k == axis ? sign : 0.0);
  return add;
}

/// A body is added and removed repeatedly, until the session refuses: how often it was added.
struct SceneChurn {
  static constexpr int kThreads = 2;
  explicit SceneChurn(std::size_t session_bytes, std::uint32_t window = server::Limits().window,
                      std::uint64_t max_vertices = server::Limits().max_vertices) {
    limits.window = window;
    limits.max_vertices = max_vertices;
    scene.vertex_count = 6;
    scene.faces = testing::octahedron();
    scene.bodies = {{"", 0, 6}};
    account = server::Account::open(budget, session_bytes, 0).value();
    server::PositionBuffer positions(server::Dtype::kFloat64, 6);
    EXPECT_TRUE(positions.append(bytes_of(octahedron_to_add().positions)).ok());
    session =
        server::Session::create(
            {server::SessionId::parse(kId).value(), scene, {}, server::Dtype::kFloat64, 0, {}}, positions,
            {std::make_shared<Workers>(1), runner, limits, account,
             [](server::Session&, const server::Fault&) {}})
            .value();
  }
  std::optional<server::Fault> change(server::SceneChange change) {
    std::promise<std::optional<server::Fault>> done;
    session->change({1, {std::move(change)}},
                    tell_change([&](const server::Outcome<server::SessionState>& outcome) {
                      done.set_value(outcome ? std::nullopt : std::optional(outcome.fault()));
                    }));
    return done.get_future().get();
  }
  std::optional<server::Fault> add(std::uint32_t octahedra) { return change(many(octahedra)); }
  std::optional<server::Fault> replace(std::uint32_t index, std::uint32_t octahedra) {
    server::AddBody with = many(octahedra);
    if (octahedra == 0) with.addition.body.kind = BodyKind::kRemoved;
    return change(server::ReplaceBody{index, std::move(with.addition), std::move(with.positions)});
  }
  static server::AddBody many(std::uint32_t octahedra) {
    server::AddBody body;
    for (std::uint32_t i = 0; i < octahedra; ++i) {
      server::AddBody one = octahedron_to_add();
      for (auto face : one.addition.faces) {
        for (auto& vertex : face) vertex += static_cast<std::int32_t>(6 * i);
        body.addition.faces.push_back(face);
      }
      for (std::size_t k = 0; k < one.positions.size(); ++k)
        body.positions.push_back(one.positions[k] + (k % 3 == 0 ? 10.0 * (i + 1) : 0));
    }
    body.addition.body.vertex_count = 6 * octahedra;
    return body;
  }
  std::optional<server::Fault> remove(std::uint32_t index) {
    server::ChangeBody removed{index, {}};
    removed.body.vertex_count = session->scene()->bodies()[index].vertex_count;
    removed.body.kind = BodyKind::kRemoved;
    return change(std::move(removed));
  }
  server::Limits limits;
  server::Budget budget{1 << 30};
  server::Runner runner{kThreads};
  SceneDescription scene;
  std::shared_ptr<server::Account> account;
  std::shared_ptr<server::Session> session;
};

}  // namespace warmfront::test
