// SPDX-License-Identifier: Apache-2.0
// Whose frames a daemon traces, below whose spans, and what it says of them.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/lib/client.h"
#include "tests/unit/server/service_fixture.h"
#include "tests/unit/server/trace_spans.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;

class TracedTest : public ServiceTest {
 protected:
  TracedTest() : ServiceTest(config()) {}
  static server::Config config() {
    server::Config config;
    config.trace.file = path();
    config.trace.sample = 0;
    std::filesystem::remove(path());
    return config;
  }
  static std::string path() { return ::testing::TempDir() + "warmfront_traced_" + std::to_string(getpid()); }
  ~TracedTest() override { std::filesystem::remove(path()); }

  // After the daemon has ended, which sends what waits.
  std::vector<nlohmann::json> spans() {
    daemon_.stop();
    std::ifstream file(path());
    std::vector<nlohmann::json> all;
    for (std::string line; std::getline(file, line);)
      for (nlohmann::json& span : spans_of(line)) all.push_back(std::move(span));
    return all;
  }
};

TEST_F(TracedTest, FramesOfACallThatAsksForItAreTraced) {
  ASSERT_TRUE(create().ok());
  for (const char* parent : {kNotSampled, kSampled}) {
    Context context;
    context.AddMetadata("traceparent", parent);
    const auto stream = stub_->StreamSteps(&context);
    v1::StreamStepsRequest attach;
    attach.mutable_attach()->set_session_id(kId);
    v1::StreamStepsResponse response;
    ASSERT_TRUE(stream->Write(attach) && stream->Read(&response));
    const std::uint64_t first = response.attached().expected_frame();
    // The second one is refused: too short.
    ASSERT_TRUE(stream->Write(frame_message(first, bytes_of(grids_.positions(first)))) &&
                stream->Read(&response));
    ASSERT_TRUE(response.has_answer());
    ASSERT_TRUE(stream->Write(frame_message(first + 1, "short")) && stream->Read(&response));
    ASSERT_TRUE(response.has_error());
    stream->WritesDone();
    ASSERT_TRUE(stream->Finish().ok());
  }
  Context unary;
  unary.AddMetadata("traceparent", kSampled);
  v1::StepRequest request;
  request.set_session_id(kId);
  request.set_frame(3);
  request.set_positions(bytes_of(grids_.positions(3)));
  v1::StepResponse stepped;
  ASSERT_TRUE(stub_->Step(&unary, request, &stepped).ok());

  std::vector<std::string> roots;
  for (const nlohmann::json& span : spans()) {
    EXPECT_EQ(span["traceId"], "0af7651916cd43dd8448eb211c80319c");
    if (span["kind"] != 2) continue;
    EXPECT_EQ(span["parentSpanId"], "b7ad6b7169203331");
    std::string words = span["name"];
    for (const nlohmann::json& attribute : span["attributes"])
      if (attribute["key"] == "warmfront.frame" || attribute["key"] == "rpc.grpc.status_code")
        words += " " + attribute["value"]["intValue"].get<std::string>();
    if (span.contains("status")) {
      EXPECT_THAT(span["status"]["message"].get<std::string>(), HasSubstr("positions: 5 bytes"));
    }
    roots.push_back(words);
  }
  EXPECT_EQ(roots, (std::vector<std::string>{"warmfront.v1.CollisionService/StreamSteps frame 0 2",
                                             "warmfront.v1.CollisionService/StreamSteps frame 3 3",
                                             "warmfront.v1.CollisionService/Step frame 0 3"}));
}

// A client of the library says once whose span it works for; a session may have another one's.
TEST_F(TracedTest, AClientsSpanIsTheParentOfItsFrames) {
  constexpr const char* kAnotherSpan = "00-11111111111111111111111111111111-2222222222222222-01";
  {
    client::Client plain = client::Client::connect(daemon_.address()).value();
    client::Client solver = client::Client::connect(daemon_.address(), {.traceparent = kSampled}).value();
    SceneDescription scene = grids_.scene();
    const auto step = [&](client::Client& client, const client::SessionOptions& options) {
      const std::vector<double> start = grids_.positions(0), moved = grids_.positions(1);
      client::Session session =
          client.create_session(scene, std::span<const double>(start), {}, options).value();
      EXPECT_TRUE(session.step(std::span<const double>(moved)).ok());
      EXPECT_TRUE(session.close().ok());
    };
    step(plain, {});
    step(solver, {});
    step(solver, {.traceparent = kAnotherSpan});
    step(solver, {.traceparent = kNotSampled});
    EXPECT_THAT(
        solver.create_session(scene, std::span<const double>(), {}, {.traceparent = "mine"}).error().message,
        HasSubstr("traceparent 'mine': 00-TRACE-SPAN-FLAGS of W3C Trace Context is expected"));
  }
  const Result<client::Client> refused =
      client::Client::connect(daemon_.address(), {.traceparent = std::string(kSampled) + " "});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);

  std::vector<std::string> parents;
  for (const nlohmann::json& span : spans()) {
    if (span["kind"] != 2) continue;
    parents.push_back(span["traceId"].get<std::string>() + " " + span["parentSpanId"].get<std::string>());
  }
  EXPECT_EQ(parents, (std::vector<std::string>{"0af7651916cd43dd8448eb211c80319c b7ad6b7169203331",
                                               "11111111111111111111111111111111 2222222222222222"}));
}

}  // namespace
}  // namespace warmfront::test
