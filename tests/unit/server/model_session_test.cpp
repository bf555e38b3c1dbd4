// SPDX-License-Identifier: Apache-2.0
// A scene's model over the wire: partial frames, poses, bodies added and changed, and all of it again after
// the session was lost.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <type_traits>

#include "client/lib/client.h"
#include "server/session/frame_buffer.h"
#include "tests/support/scenes.h"
#include "tests/unit/server/heap.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Session;
using ::testing::HasSubstr;

template <class Real>
class ModelSessionTest : public ::testing::Test {
 protected:
  void expect_same(const Result<Answer>& remote, const Result<StepResult>& local) {
    ASSERT_TRUE(remote.ok()) << remote.error().message;
    ASSERT_TRUE(local.ok()) << local.error().message;
    const std::span<const Contact> expected = local.value().contacts;
    const client::ContactTable& table = remote.value().contacts;
    ASSERT_EQ(table.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(table.kind[i], expected[i].kind);
      EXPECT_EQ(table.vertices[i], collider_.scene().vertices_of(expected[i]));
      EXPECT_EQ(table.toi[i], expected[i].toi);
      EXPECT_EQ(table.normal.at(i), local.value().geometry[i].normal);
      EXPECT_EQ(table.points.at(i), local.value().geometry[i].points);
    }
    EXPECT_TRUE(table.weights.empty()) << "not asked for";
    contacts_ += expected.size();
  }

  static ColliderOptions options() {
    ColliderOptions options;
    options.fields.normal = options.fields.points = true;
    return options;
  }

  Heap<Real> heap_;
  std::uint64_t contacts_ = 0;
  Collider collider_ =
      Collider::create(std::make_shared<const Scene>(Scene::create(heap_.description).value()),
                       std::span<const Real>(heap_.x), options(), std::make_shared<Workers>(1))
          .value();
  LocalDaemon daemon_;
  Client client_ = Client::connect(daemon_.address()).value();
  Session session_ =
      client_.create_session(heap_.description, std::span<const Real>(heap_.x), options()).value();
};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(ModelSessionTest, Reals);

TYPED_TEST(ModelSessionTest, TheSameBitsAsInThisProcessThroughChangesAndLosses) {
  using Real = TypeParam;
  for (int k = 1; k <= 24; ++k) {
    const Mixture<Real> mixture(k, this->heap_);
    this->expect_same(this->session_.step(mixture.frame), this->collider_.step(mixture.frame));
    if (k == 6) {
      std::vector<Real> fresh;
      Heap<Real>::append_octahedron(0.5, 0.5, fresh);
      BodyAddition addition;
      addition.body.vertex_count = 6;
      addition.body.kind = BodyKind::kRigid;
      addition.faces = testing::octahedron();
      ASSERT_EQ(this->session_.add_body(addition, std::span<const Real>(fresh)).value(), 5U);
      ASSERT_EQ(this->collider_.add_body(addition, std::span<const Real>(fresh)).value(), 5U);
    }
    if (k == 12) {
      for (const auto& [index, kind] : {std::pair{0U, BodyKind::kRigid}, std::pair{5U, BodyKind::kRemoved}}) {
        ASSERT_TRUE(this->session_.change_body(index, {"", 0, 6, kind}).ok());
        ASSERT_TRUE(this->collider_.change_body(index, {"", 0, 6, kind}).ok());
      }
    }
    // The session is gone: what the client keeps makes the same one again.
    if (k % 5 == 0) {
      ASSERT_TRUE(this->client_.delete_session(this->session_.id()).ok());
    }
  }
  EXPECT_EQ(this->session_.resumes(), 4U);
  EXPECT_GT(this->contacts_, 200U);
}

TYPED_TEST(ModelSessionTest, BadFramesAreNamedAndTheSessionGoesOn) {
  using Real = TypeParam;
  const auto refused = [&](const Frame& frame) {
    const Result<Answer> answer = this->session_.step(frame);
    EXPECT_FALSE(answer.ok());
    if (answer.ok()) return std::string();
    EXPECT_EQ(answer.error().code, ErrorCode::kInvalidArgument) << answer.error().message;
    return answer.error().message;
  };
  BodyPose pose{3, {}};
  Frame frame;
  frame.poses = {&pose, 1};
  EXPECT_THAT(refused(frame), HasSubstr("poses[0]: body 3 is not rigid"));
  pose = {1, {}};
  pose.pose.matrix[5] = 2;
  EXPECT_THAT(refused(frame), HasSubstr("is not rigid"));
  const std::vector<Real> row{0, 0, 0};
  const std::uint32_t vertex[]{99};
  Frame sparse;
  sparse.vertices = vertex;
  sparse.vertex_positions = std::span<const Real>(row);
  EXPECT_THAT(refused(sparse), HasSubstr("vertex 99 is not in [0, 30)"));
  EXPECT_EQ(this->session_.change_body(2, {"", 0, 6, BodyKind::kRigid, true, 1, 0}).error().code,
            ErrorCode::kInvalidArgument);
  const Mixture<Real> mixture(1, this->heap_);
  this->expect_same(this->session_.step(mixture.frame), this->collider_.step(mixture.frame));
}

TEST(FrameBufferTest, PiecesAreCheckedAgainstTheScene) {
  const Heap<float> heap;
  const Scene scene = Scene::create(heap.description).value();
  const auto complain = [&](const server::MovedPiece& piece) {
    server::FrameBuffer buffer(server::Dtype::kFloat32, scene);
    static_cast<void>(buffer.append(piece));
    const Status status = buffer.complete(scene);
    return status.ok() ? std::string() : status.error().message;
  };
  const auto bytes = [](std::initializer_list<std::uint32_t> values) {
    return std::string(reinterpret_cast<const char*>(values.begin()), 4 * values.size());
  };
  EXPECT_EQ(complain({}), "") << "nothing moved";
  EXPECT_THAT(complain({.bodies = "abc"}), HasSubstr("moved.bodies: 3 bytes are no whole number"));
  EXPECT_THAT(complain({.bodies = bytes({7})}), HasSubstr("body 7 is not in [0, 5)"));
  EXPECT_THAT(complain({.bodies = bytes({3}), .body_positions = "12345678"}),
              HasSubstr("moved.body_positions"));
  EXPECT_THAT(complain({.bodies = {}, .body_positions = "12345678"}),
              HasSubstr("moved.body_positions: 8 bytes, but 0 bytes are expected"));
  EXPECT_THAT(complain({.poses = std::string(48, 'x')}),
              HasSubstr("96 bytes are expected for 2 rigid bodies"));
  EXPECT_THAT(complain({.vertices = bytes({1})}), HasSubstr("12 bytes are expected for 1 vertices"));
  EXPECT_THAT(complain({.vertices = std::string(1000, 'x')}), HasSubstr("more than the scene could use"));
  server::FrameBuffer both(server::Dtype::kFloat32, scene);
  static_cast<void>(both.append(std::string(4, 'x')));
  static_cast<void>(both.append(server::MovedPiece{.vertices = bytes({1})}));
  EXPECT_THAT(both.complete(scene).error().message, HasSubstr("give either"));
}

}  // namespace
}  // namespace warmfront::test
