// SPDX-License-Identifier: Apache-2.0
// Uploads, unary steps, limits and expiry over gRPC, as a client sees them that does not use our library.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

TEST_F(ServiceTest, CreateShowStepDelete) {
  ASSERT_TRUE(create().ok());
  EXPECT_EQ(create().error_code(), StatusCode::ALREADY_EXISTS);
  const std::vector<std::uint64_t> expected = local_hashes(grids_, 0, 3);
  for (std::uint64_t k = 1; k <= 3; ++k) {
    v1::StepResponse response;
    ASSERT_TRUE(step(k, frame(k), &response).ok());
    EXPECT_EQ(response.frame(), k);
    EXPECT_EQ(hash_of(response.contacts()), expected[k - 1]);
    EXPECT_GT(response.summary().rows(), 0u) << "a test without contacts shows nothing";
    EXPECT_EQ(response.summary().vf() + response.summary().ee(), response.summary().rows());
    EXPECT_GT(response.summary().statistics().counts().elementary_tests(), 0u);
    EXPECT_NE(response.summary().statistics().front_state(), v1::FRONT_STATE_UNSPECIFIED);
  }
  Context list, get, remove, again;
  v1::ListSessionsResponse listed;
  ASSERT_TRUE(stub_->ListSessions(&list, {}, &listed).ok());
  ASSERT_EQ(listed.sessions_size(), 1);
  EXPECT_EQ(listed.sessions(0).last_frame(), 3u);
  EXPECT_EQ(listed.sessions(0).options().tier(), v1::TIER_CERTIFIED);
  EXPECT_GT(listed.sessions(0).memory_bytes(), 1000u);
  // The metadata alone names the session too.
  get.AddMetadata("warmfront-session", kId);
  v1::GetSessionResponse got;
  EXPECT_TRUE(stub_->GetSession(&get, {}, &got).ok());
  EXPECT_EQ(got.session().vertex_count(), grids_.vertex_count());
  v1::DeleteSessionRequest request;
  request.set_session_id(kId);
  v1::DeleteSessionResponse deleted;
  EXPECT_TRUE(stub_->DeleteSession(&remove, request, &deleted).ok());
  EXPECT_EQ(stub_->DeleteSession(&again, request, &deleted).error_code(), StatusCode::NOT_FOUND);
  const grpc::Status gone = step(4, frame(4));
  EXPECT_EQ(gone.error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(detail_of(gone).reason(), v1::ERROR_REASON_SESSION_NOT_FOUND);
  EXPECT_THAT(daemon_.log(), HasSubstr("\"event\":\"session_created\",\"session\":\"" + std::string(kId)));
  EXPECT_THAT(daemon_.log(), HasSubstr("\"reason\":\"deleted\""));
}

TEST_F(ServiceTest, ListsComeInPages) {
  const auto id = [](int i) { return "00000000-0000-4000-8000-00000000000" + std::to_string(i); };
  for (const int i : {3, 0, 4, 1, 2}) ASSERT_TRUE(create(id(i)).ok());
  const auto list = [&](int size, const std::string& token) {
    Context context;
    v1::ListSessionsRequest request;
    request.set_page_size(size);
    request.set_page_token(token);
    v1::ListSessionsResponse response;
    const grpc::Status status = stub_->ListSessions(&context, request, &response);
    std::vector<std::string> ids;
    for (const v1::SessionInfo& session : response.sessions()) ids.push_back(session.session_id());
    return std::tuple(status, ids, response.next_page_token());
  };
  using Ids = std::vector<std::string>;
  const auto [first, two, token] = list(2, "");
  EXPECT_EQ(two, (Ids{id(0), id(1)}));
  ASSERT_FALSE(token.empty());
  Context remove;
  v1::DeleteSessionRequest last_of_page;
  last_of_page.set_session_id(id(1));
  v1::DeleteSessionResponse deleted;
  ASSERT_TRUE(stub_->DeleteSession(&remove, last_of_page, &deleted).ok());
  const auto [second, next, after] = list(2, token);
  EXPECT_EQ(next, (Ids{id(2), id(3)}))
      << "a page begins behind a session that is gone as behind one that is there";
  const auto [third, rest, none] = list(2, after);
  EXPECT_EQ(rest, Ids{id(4)});
  EXPECT_EQ(none, "");
  EXPECT_EQ(std::get<1>(list(4, "")).size(), 4u);
  EXPECT_EQ(std::get<2>(list(4, "")), "") << "a page that is full and the last one says so";
  EXPECT_EQ(std::get<1>(list(0, "")).size(), 4u) << "without a size all";
  for (const auto& [size, wrong, field] : {std::tuple{-1, "", "page_size"},
                                           {1, "x", "page_token"},
                                           {1, "00000000-0000-4000-8000", "page_token"}}) {
    const grpc::Status status = std::get<0>(list(size, wrong));
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr(field));
  }
}

TEST_F(ServiceTest, BadUploadsNameFieldAndIndex) {
  std::vector<double> positions = grids_.positions(0);
  const auto expect = [&](const grpc::Status& status, const char* first, const char* second) {
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(first));
    EXPECT_THAT(status.error_message(), HasSubstr(second));
    EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_INVALID_INPUT);
  };
  positions[3 * 17 + 1] = std::numeric_limits<double>::quiet_NaN();
  expect(create(header(), faces(), bytes_of(positions)), "position", "17");
  positions[3 * 17 + 1] = std::numeric_limits<double>::infinity();
  expect(create(header(), faces(), bytes_of(positions)), "position", "17");
  std::string bad_faces = faces();
  const std::int32_t index = static_cast<std::int32_t>(grids_.vertex_count());
  std::memcpy(bad_faces.data() + 12 * 5 + 4, &index, 4);
  expect(create(header(), bad_faces, frame(0)), "face", "5");
  const std::int32_t negative = -1;
  std::memcpy(bad_faces.data() + 12 * 5 + 4, &negative, 4);
  expect(create(header(), bad_faces, frame(0)), "face", "5");
  expect(create(header(), faces().substr(1), frame(0)), "faces", "bytes");
  expect(create(header(), faces() + "x", frame(0)), "faces", "bytes");
  expect(create(header(), faces(), frame(0).substr(8)), "positions", "bytes");
  expect(create(header(), faces(), frame(0) + std::string(8, 'x')), "positions", "bytes");
  v1::SessionHeader bodies = header();
  bodies.add_bodies()->set_vertex_count(1);
  expect(create(bodies, faces(), frame(0)), "bod", "");
  expect_healthy();
}

TEST_F(ServiceTest, UnaryFrameRules) {
  ASSERT_TRUE(create().ok());
  v1::StepResponse first, again;
  ASSERT_TRUE(step(1, frame(1), &first).ok());
  ASSERT_TRUE(step(1, frame(1), &again).ok());
  EXPECT_EQ(first.SerializeAsString(), again.SerializeAsString()) << "the cached answer, its times included";
  const grpc::Status changed = step(1, frame(2));
  EXPECT_EQ(changed.error_code(), StatusCode::ABORTED);
  EXPECT_EQ(detail_of(changed).reason(), v1::ERROR_REASON_FRAME_CHANGED);
  for (const std::uint64_t wrong :
       {std::uint64_t{0}, std::uint64_t{3}, std::numeric_limits<std::uint64_t>::max()}) {
    const grpc::Status status = step(wrong, frame(2));
    EXPECT_EQ(status.error_code(), StatusCode::FAILED_PRECONDITION) << wrong;
    EXPECT_EQ(detail_of(status).expected_frame(), 2u);
    EXPECT_THAT(status.error_message(), HasSubstr("frame 2 is expected"));
  }
  EXPECT_EQ(step(2, frame(2).substr(1)).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(step(2, frame(2) + "x").error_code(), StatusCode::INVALID_ARGUMENT);
  v1::StepResponse second;
  ASSERT_TRUE(step(2, frame(2), &second).ok()) << "what failed did not count";
  EXPECT_EQ(hash_of(second.contacts()), local_hashes(grids_, 0, 2).back());
}

TEST_F(SmallLimitsTest, LimitsAreStatedAndKept) {
  Context info_context;
  v1::GetServerInfoResponse info;
  ASSERT_TRUE(stub_->GetServerInfo(&info_context, {}, &info).ok());
  EXPECT_EQ(info.limits().max_sessions(), 1u);
  EXPECT_EQ(info.limits().window(), 1u);
  v1::SessionHeader large = header();
  large.set_face_count(101);
  EXPECT_EQ(create(large, "", "").error_code(), StatusCode::RESOURCE_EXHAUSTED);
  ASSERT_TRUE(create().ok());
  const grpc::Status full = create(kOther);
  EXPECT_EQ(full.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(full.error_message(), HasSubstr("limit of 1 sessions"));
  EXPECT_EQ(step(1, std::string(70 << 10, 'x')).error_code(), StatusCode::RESOURCE_EXHAUSTED);
}

class ExpiryTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.idle_timeout = std::chrono::milliseconds(50);
    return config;
  }
  ExpiryTest() : ServiceTest(config()) {}
};

TEST_F(ExpiryTest, IdleSessionsAreClosedAndLogged) {
  ASSERT_TRUE(create().ok());
  grpc::Status status;
  for (int i = 0; i < 200 && status.ok(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(i < 100 ? 20 : 100));
    Context context;
    v1::GetSessionRequest request;
    request.set_session_id(kId);
    v1::GetSessionResponse response;
    status = stub_->GetSession(&context, request, &response);
  }
  EXPECT_EQ(status.error_code(), StatusCode::NOT_FOUND);
  EXPECT_THAT(daemon_.log(), HasSubstr("\"reason\":\"idle\""));
}

}  // namespace
}  // namespace warmfront::test
