// SPDX-License-Identifier: Apache-2.0
// Fault table, row 30: tenants who ask for more work or memory than there is, beside a session that is
// stepped all the while and, where it says so, one with long steps.
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

#include "tests/faults/fault_table.h"
#include "tests/support/hostile_scenes.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using testing::HostileScene;
using Milliseconds = std::chrono::duration<double, std::milli>;

std::string faces_of(const HostileScene& scene) {
  return {reinterpret_cast<const char*>(scene.description.faces.data()), scene.description.faces.size() * 12};
}

class FaultTableTenants : public FaultTable {
 protected:
  void SetUp() override {
    begin({"--max-session-bytes", "256MiB", "--max-total-bytes", "512MiB"});
    // Sessions are left behind, within what they are charged.
    allowed_peak_ = 256 * kMiB;
    allowed_growth_ = 160 * kMiB;
  }

  v1::SessionHeader header_of(const HostileScene& scene, const std::string& id) const {
    v1::SessionHeader header = this->header(id);
    header.set_vertex_count(scene.description.vertex_count);
    header.set_face_count(static_cast<std::uint32_t>(scene.description.faces.size()));
    header.mutable_options()->set_report(v1::REPORT_COUNT);
    for (const Body& body : scene.description.bodies) {
      v1::Body& declared = *header.add_bodies();
      declared.set_first_vertex(body.first_vertex);
      declared.set_vertex_count(body.vertex_count);
      if (body.kind == BodyKind::kRigid) declared.set_kind(v1::BODY_KIND_RIGID);
    }
    return header;
  }
  static std::string id_of(int number) {
    std::string id = "41234567-89ab-cdef-0123-45678900000";
    id += static_cast<char>('0' + number);
    return id;
  }

  /// A call of Step on a thread of its own, until it is told to give up.
  class Stepping {
   public:
    Stepping(v1::CollisionService::Stub& stub, const std::string& id, std::uint64_t frame,
             const std::string& positions) {
      request_.set_session_id(id);
      request_.set_frame(frame);
      request_.set_positions(positions);
      context_.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(5));
      thread_ = std::thread([this, &stub] {
        v1::StepResponse response;
        status_ = stub.Step(&context_, request_, &response);
        done_ = true;
      });
    }
    ~Stepping() {
      context_.TryCancel();
      if (thread_.joinable()) thread_.join();
    }
    Stepping(const Stepping&) = delete;
    Stepping& operator=(const Stepping&) = delete;
    bool done() const { return done_; }
    void cancel() { context_.TryCancel(); }
    grpc::Status wait() {
      thread_.join();
      return status_;
    }

   private:
    grpc::ClientContext context_;
    v1::StepRequest request_;
    std::atomic<bool> done_{false};
    grpc::Status status_;
    std::thread thread_;
  };

  /// A session of separate bodies, whose step to a state with all in one place takes minutes.
  std::string create_greedy(int number, int triangles = 20'000) {
    HostileScene scene = testing::flat_grid(static_cast<int>(std::sqrt(triangles / 2.0)));
    const grpc::Status created =
        create(header_of(scene, id_of(number)), faces_of(scene), bytes_of(scene.positions));
    EXPECT_TRUE(created.ok()) << created.error_message();
    return bytes_of(testing::collapsed_grid(triangles).positions);
  }
  void wait_until_in_flight(std::uint32_t frames) {
    for (int i = 0; i < 3000; ++i) {
      Context context;
      v1::GetServerInfoResponse info;
      ASSERT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
      if (info.frames_in_flight() >= frames) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    FAIL() << "the greedy steps do not begin";
  }
};

TEST_F(FaultTableTenants, Row30_AStepWithoutEndLeavesOthersTheirShareAndCanBeStopped) {
  steps_alone();
  std::vector<std::unique_ptr<Stepping>> greedy;
  for (int i = 0; i < 3; ++i) {
    const std::string collapsed = create_greedy(i);
    greedy.push_back(std::make_unique<Stepping>(*stub_, id_of(i), 1, collapsed));
  }
  wait_until_in_flight(3);
  steps_beside("three steps without end", 200);
  steps_beside("three steps without end, later", 1000);
  // One with long steps, too, is made and stepped.
  const HostileScene large = testing::flat_grid(200);
  v1::SessionHeader wanted = header_of(large, kOther);
  ASSERT_TRUE(create(wanted, faces_of(large), bytes_of(large.positions)).ok());
  const auto began = std::chrono::steady_clock::now();
  for (std::uint64_t frame = 1; frame <= 3; ++frame) {
    std::vector<double> moved = large.positions;
    for (double& x : moved) x += 0.01 * static_cast<double>(frame);
    ASSERT_TRUE(step(frame, bytes_of(moved), nullptr, kOther).ok());
  }
  std::printf("three steps of 80,000 triangles: %.0f ms\n",
              Milliseconds(std::chrono::steady_clock::now() - began).count());
  for (const auto& one : greedy) EXPECT_FALSE(one->done()) << "it was to be without end";
  // A step stops when its session is deleted, and when its client gives up.
  Context context;
  v1::DeleteSessionRequest doomed;
  doomed.set_session_id(id_of(0));
  v1::DeleteSessionResponse deleted;
  ASSERT_TRUE(stub_->DeleteSession(&context, doomed, &deleted).ok());
  EXPECT_EQ(greedy[0]->wait().error_code(), StatusCode::NOT_FOUND);
  greedy[1]->cancel();
  EXPECT_EQ(greedy[1]->wait().error_code(), StatusCode::CANCELLED);
  for (int i = 0; i < 1000; ++i) {
    Context again;
    v1::GetServerInfoResponse info;
    ASSERT_TRUE(stub_->GetServerInfo(&again, {}, &info).ok());
    if (info.frames_in_flight() == 1) break;
    ASSERT_LT(i, 999) << "steps continue after their client has gone";
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

TEST_F(FaultTableTenants, Row30_ADrainStopsAStepWithoutEnd) {
  begin({"--drain-timeout", "4s"});
  const std::string collapsed = create_greedy(0);
  Stepping greedy(*stub_, id_of(0), 1, collapsed);
  wait_until_in_flight(1);
  daemon_->terminate();
  const int status = daemon_->wait();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "exit status " << status;
  EXPECT_EQ(greedy.wait().error_code(), StatusCode::UNAVAILABLE)
      << "its client continues with another daemon";
  begin({});
}

TEST_F(FaultTableTenants, Row30_TenThousandBodiesInOnePlace) {
  for (const BodyKind kind : {BodyKind::kRigid, BodyKind::kDeformable}) {
    HostileScene scene = testing::coincident_triangles(10'000, kind);
    const std::string collapsed = bytes_of(scene.positions);
    for (std::size_t v = 0; v < scene.positions.size() / 3; ++v)
      scene.positions[3 * v] += 3.0 * static_cast<double>(v / 3);
    ASSERT_TRUE(create(header_of(scene, id_of(0)), faces_of(scene), bytes_of(scene.positions)).ok());
    steps_alone();
    {
      Stepping greedy(*stub_, id_of(0), 1, collapsed);
      steps_beside(
          kind == BodyKind::kRigid ? "10,000 rigid bodies in one place" : "10,000 bodies in one place", 300);
    }
    Context context;
    v1::DeleteSessionRequest doomed;
    doomed.set_session_id(id_of(0));
    v1::DeleteSessionResponse deleted;
    ASSERT_TRUE(stub_->DeleteSession(&context, doomed, &deleted).ok());
  }
}

TEST_F(FaultTableTenants, Row30_AFanIsMadeInNoTimeOrRefused) {
  const HostileScene fan = testing::fan(9'990);
  steps_alone();
  std::thread attacker([&] {
    const grpc::Status made = create(header_of(fan, id_of(0)), faces_of(fan), bytes_of(fan.positions));
    std::printf("a fan of 9,990 triangles: %s\n", made.ok() ? "made" : made.error_message().c_str());
  });
  steps_beside("a fan of 9,990 triangles", 300);
  attacker.join();
}

TEST_F(FaultTableTenants, Row30_AThousandChangesThatChangeNothing) {
  const HostileScene large = testing::flat_grid(224);
  HostileScene declared = large;
  declared.description.bodies.push_back({"", 0, large.description.vertex_count, BodyKind::kDeformable});
  ASSERT_TRUE(create(header_of(declared, id_of(0)), faces_of(large), bytes_of(large.positions)).ok());
  v1::ChangeSceneRequest request;
  request.set_session_id(id_of(0));
  request.set_next_frame(1);
  for (int i = 0; i < 1000; ++i) {
    v1::BodyChange& change = *request.add_changes()->mutable_change();
    change.set_index(0);
    change.mutable_body()->set_vertex_count(large.description.vertex_count);
  }
  steps_alone();
  std::thread attacker([&] {
    const auto began = std::chrono::steady_clock::now();
    Context context;
    v1::ChangeSceneResponse changed;
    const grpc::Status status = stub_->ChangeScene(&context, request, &changed);
    EXPECT_TRUE(status.ok()) << status.error_message();
    std::printf("a thousand changes of 100,352 triangles that change nothing: %.0f ms\n",
                Milliseconds(std::chrono::steady_clock::now() - began).count());
  });
  steps_beside("a thousand changes", 300);
  attacker.join();
}

}  // namespace
}  // namespace warmfront::test
