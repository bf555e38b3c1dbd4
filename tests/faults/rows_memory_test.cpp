// SPDX-License-Identifier: Apache-2.0
// Fault table, row 27: a session's data are corrupted in memory. The daemon detects it, recomputes them if
// possible, and reports it if not.
#include <memory>

#include "client/lib/client.h"
#include "engine/bvh/bvh.h"
#include "tests/faults/fault_table.h"
#include "tests/faults/process_memory.h"
#include "tests/faults/raw_socket.h"
#include "tests/unit/server/answer_hash.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

/// A session larger than the untouched one, so that its memory can be told from that one's.
class FaultTableMemory : public FaultTable {
 protected:
  void SetUp() override { begin({"--self-check-steps", "1", "--metrics-listen", "127.0.0.1:0"}); }

  std::string victim_frame(std::uint64_t number) const { return bytes_of(victim_.positions(number)); }
  void create_victim() {
    v1::SessionHeader wanted = header();
    wanted.set_vertex_count(victim_.vertex_count());
    wanted.set_face_count(static_cast<std::uint32_t>(victim_.scene().faces.size()));
    wanted.mutable_options()->set_leaf_size(kLeafSize);
    const SceneDescription scene = victim_.scene();
    ASSERT_TRUE(create(wanted, {reinterpret_cast<const char*>(scene.faces.data()), 12 * scene.faces.size()},
                       victim_frame(0))
                    .ok());
  }
  /// The next frames, each with the right contacts; the front's state in the last.
  v1::FrontState step_victim_to(std::uint64_t last) {
    v1::StepResponse response;
    for (; frame_ < last; ++frame_) {
      const grpc::Status status = step(frame_ + 1, victim_frame(frame_ + 1), &response);
      EXPECT_TRUE(status.ok()) << status.error_message();
      EXPECT_EQ(hash_of(response.contacts()), local_hashes(victim_, frame_, frame_ + 1).front());
    }
    return response.summary().statistics().front_state();
  }

  /// Where the hierarchy of either grid has each face: it numbers faces along its leaves, so they stand in
  /// order.
  std::vector<std::uint32_t> leaf_of_face() const {
    const auto faces = static_cast<std::uint32_t>(victim_.scene().faces.size());
    const TreeShape shape(faces / 2, kLeafSize);
    std::vector<std::uint32_t> leaves(shape.primitive_count());
    for (NodeId leaf = shape.first_leaf(); leaf < shape.end_node(); ++leaf)
      std::fill(leaves.begin() + shape.begin(leaf), leaves.begin() + shape.end(leaf), number_of(leaf));
    return leaves;
  }
  int break_hierarchy() {
    const std::vector<std::uint32_t> leaves = leaf_of_face();
    return flip_bits(daemon_->pid(), leaves, leaves.size() / 2, 4);
  }
  int break_scene() {
    std::vector<std::uint32_t> corners;
    for (const auto& face : victim_.scene().faces) corners.insert(corners.end(), face.begin(), face.end());
    return flip_bits(daemon_->pid(), corners, corners.size() / 2, 1);
  }
  std::string metrics() const {
    const std::string log = daemon_->log();
    const std::size_t at = log.find("127.0.0.1:", log.find("\"metrics_listening\""));
    const RawSocket socket(std::stoi(log.substr(at + 10)));
    socket.send("GET /metrics HTTP/1.0\r\n\r\n");
    return socket.read_all(5000);
  }

  /// Small, for a table of leaves that no other memory looks like.
  static constexpr std::uint32_t kLeafSize = 8;
  const MovingGrids victim_{9};
  std::uint64_t frame_ = 0;
};

TEST_F(FaultTableMemory, Row27_AHierarchyThatBreaksIsMadeAnewAndTheSecondTimeTheSessionIsClosed) {
  create_victim();
  EXPECT_EQ(step_victim_to(5), v1::FRONT_STATE_UPDATED);
  ASSERT_GE(break_hierarchy(), 1) << "it stands in the daemon's memory";
  EXPECT_EQ(step_victim_to(6), v1::FRONT_STATE_REBUILT) << "the answer is that of the rebuilt hierarchy";
  EXPECT_EQ(step_victim_to(9), v1::FRONT_STATE_UPDATED) << "and it is warm again";
  EXPECT_THAT(daemon_->log(), HasSubstr("\"session_rebuilt\""));
  EXPECT_THAT(metrics(), HasSubstr("warmfront_session_rebuilds_total{reason=\"self_check\"} 1"));
  EXPECT_THAT(metrics(), HasSubstr("warmfront_self_checks_total{result=\"rebuilt\"} 1"));
  ASSERT_GE(break_hierarchy(), 1);
  expect_fault(step(10, victim_frame(10)), StatusCode::DATA_LOSS, v1::ERROR_REASON_DATA_LOSS,
               "after it was made anew once; the session is dropped, create it again");
  expect_fault(step(10, victim_frame(10)), StatusCode::NOT_FOUND, v1::ERROR_REASON_SESSION_NOT_FOUND,
               "create it again");
  EXPECT_THAT(metrics(), HasSubstr("warmfront_rejected_total{reason=\"data_loss\"} 1"));
}

TEST_F(FaultTableMemory, Row27_ASceneThatBreaksIsDataLossAndTheClientGoesOn) {
  create_victim();
  step_victim_to(3);
  ASSERT_GE(break_scene(), 1);
  expect_fault(step(4, victim_frame(4)), StatusCode::DATA_LOSS, v1::ERROR_REASON_DATA_LOSS,
               "frame 4: self-check: the scene's topology has changed");

  // The client library creates the session again, and no answer is missing or different.
  client::Client client = client::Client::connect(daemon_->socket()).value();
  const std::vector<double> start = victim_.positions(0);
  client::Session session = client.create_session(victim_.scene(), std::span<const double>(start)).value();
  const auto expected = local_hashes(victim_, 0, 6);
  for (std::uint64_t k = 1; k <= 6; ++k) {
    if (k == 4) {
      ASSERT_GE(break_scene(), 1);
    }
    const std::vector<double> next = victim_.positions(k);
    const Result<client::Answer> answer = session.step(std::span<const double>(next));
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(test::hash_of(answer.value()), expected[k - 1]) << k;
  }
  EXPECT_EQ(session.resumes(), 1U);
}

TEST_F(FaultTableMemory, Row27_OnDemand) {
  begin({"--self-check-steps", "0"});
  create_victim();
  step_victim_to(2);
  const auto check = [&](v1::CheckSessionResponse& response) {
    Context context;
    v1::CheckSessionRequest request;
    request.set_session_id(kId);
    return stub_->CheckSession(&context, request, &response);
  };
  v1::CheckSessionResponse response;
  ASSERT_TRUE(check(response).ok());
  EXPECT_EQ(response.found(), "");
  ASSERT_GE(break_hierarchy(), 1);
  ASSERT_TRUE(check(response).ok());
  EXPECT_THAT(response.found(), HasSubstr("do not match its primitive order"));
  EXPECT_EQ(step_victim_to(3), v1::FRONT_STATE_REBUILT);
  ASSERT_TRUE(check(response).ok());
  EXPECT_EQ(response.found(), "");
  ASSERT_GE(break_hierarchy(), 1);
  expect_fault(check(response), StatusCode::DATA_LOSS, v1::ERROR_REASON_DATA_LOSS, "made anew once");
}

}  // namespace
}  // namespace warmfront::test
