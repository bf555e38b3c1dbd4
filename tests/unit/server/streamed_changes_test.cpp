// SPDX-License-Identifier: Apache-2.0
// Changes that come in pieces: carried out as one, refused as one, and charged while they come.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "client/lib/client.h"
#include "proto/wire/scene_change_pieces.h"
#include "tests/support/scenes.h"
#include "tests/unit/server/local_daemon.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;
using Doubles = std::span<const double>;

server::Config small_messages() {
  server::Config config;
  config.limits.max_message_bytes = 64 << 10;
  return config;
}

template <class T>
std::string raw_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// A flat body of side x side quads, which is several messages long.
struct Sheet {
  explicit Sheet(int side) : faces(testing::grid(side)) {
    for (int i = 0; i <= side; ++i)
      for (int j = 0; j <= side; ++j) positions.insert(positions.end(), {1.0 * i, 1.0 * j, 0.5});
  }
  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(positions.size() / 3); }
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<double> positions;
};

class StreamedChangesTest : public ::testing::Test {
 protected:
  using Request = v1::ChangeSceneRequest;

  StreamedChangesTest() {
    const std::vector<double> corners{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1};
    SceneDescription scene{6, {{0, 1, 2}, {3, 4, 5}}, {{"", 0, 3}, {"", 3, 3}}};
    session_.emplace(client_.create_session(scene, Doubles(corners)).value());
  }

  Request replacement(const Sheet& sheet, const std::string& key = "key") const {
    Request request;
    request.set_session_id(session_->id());
    request.set_next_frame(1);
    request.set_key(key);
    v1::BodyReplacement& replaced = *request.add_changes()->mutable_replace_body();
    replaced.set_index(1);
    replaced.mutable_with()->mutable_body()->set_vertex_count(sheet.vertex_count());
    replaced.mutable_with()->set_faces(raw_bytes(sheet.faces));
    replaced.mutable_with()->set_positions(raw_bytes(sheet.positions));
    return request;
  }

  // Calls `send(write)`, which sends what it likes.
  using Write = std::function<bool(const Request&)>;
  grpc::Status stream(const std::function<void(const Write&, grpc::ClientContext&)>& send,
                      v1::ChangeSceneResponse* answer = nullptr) {
    grpc::ClientContext context;
    context.AddMetadata("warmfront-session", session_->id());
    v1::ChangeSceneResponse response;
    auto writer = stub_->StreamChangeScene(&context, &response);
    send([&](const Request& piece) { return writer->Write(piece); }, context);
    writer->WritesDone();
    grpc::Status status = writer->Finish();
    if (answer != nullptr) *answer = response;
    return status;
  }
  grpc::Status stream(std::vector<Request> messages, v1::ChangeSceneResponse* answer = nullptr) {
    return stream(
        [&](const Write& write, grpc::ClientContext&) {
          for (const Request& message : messages)
            if (!write(message)) return;
        },
        answer);
  }
  std::vector<Request> pieces(Request request, std::size_t chunk = 40 << 10) const {
    std::vector<Request> messages;
    wire::send_pieces(std::move(request), chunk, [&](const Request& piece) {
      messages.push_back(piece);
      return true;
    });
    return messages;
  }
  void expect_refused(const std::vector<Request>& messages, const char* words) {
    const grpc::Status status = stream(messages);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(words));
    EXPECT_EQ(info().vertex_count, 6U) << "the session is as it was";
  }
  client::SessionInfo info() { return client_.get_session(session_->id()).value(); }

  LocalDaemon daemon_{small_messages()};
  client::Client client_ = client::Client::connect(daemon_.address()).value();
  std::optional<client::Session> session_;
  std::unique_ptr<v1::CollisionService::Stub> stub_ = v1::CollisionService::NewStub(
      grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials()));
};

TEST_F(StreamedChangesTest, AreOneChangeHoweverManyMessages) {
  const Sheet sheet(100);
  for (const std::size_t chunk : {std::size_t{50000}, std::size_t{4097}}) {
    const std::vector<Request> messages = pieces(replacement(sheet, std::to_string(chunk)), chunk);
    EXPECT_GT(messages.size(), 300000 / chunk);
    v1::ChangeSceneResponse answer;
    const grpc::Status status = stream(messages, &answer);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(answer.session().vertex_count(), 3 + sheet.vertex_count());
    EXPECT_EQ(answer.session().face_count(), 1 + sheet.faces.size());
    v1::ChangeSceneResponse again;
    EXPECT_TRUE(stream(pieces(replacement(sheet, std::to_string(chunk))), &again).ok());
    EXPECT_EQ(again.state().digest(), answer.state().digest())
        << "the same key: answered, and not done again";
    EXPECT_EQ(again.state().revision(), answer.state().revision());
  }
}

TEST_F(StreamedChangesTest, TheClientSendsWhatIsLargeThatWay) {
  const Sheet sheet(150);
  BodyAddition with{{"", 0, sheet.vertex_count()}, sheet.faces};
  ASSERT_TRUE(session_->replace_body(1, with, Doubles(sheet.positions)).ok());
  EXPECT_EQ(info().vertex_count, 3 + sheet.vertex_count());
  ASSERT_TRUE(session_->add_body(with, Doubles(sheet.positions)).ok());
  PairFilters filters;
  filters.patches.assign(3 + 2 * sheet.vertex_count(), 1);
  ASSERT_TRUE(session_->change_filters(filters).ok());
  Sheet torn = sheet;
  torn.faces.pop_back();
  ASSERT_TRUE(session_->replace_elements(2, torn.faces).ok());
  daemon_.restart();
  const auto still = session_->step({});
  ASSERT_TRUE(still.ok()) << still.error().message;
  EXPECT_EQ(info().face_count, 1 + sheet.faces.size() + torn.faces.size());
  EXPECT_EQ(session_->resumes(), 1U);
}

TEST_F(StreamedChangesTest, WhatDoesNotFitIsRefused) {
  const std::vector<Request> good = pieces(replacement(Sheet(60)));
  expect_refused({}, "ended without a message");
  std::vector<Request> bad = good;
  bad.erase(bad.begin() + 1);
  expect_refused(bad, "changes[0].continues: there is no change before it");
  bad = good;
  bad.pop_back();
  expect_refused(bad, "changes[0].replace_body.with.positions");
  bad = good;
  bad[2].set_key("key");
  expect_refused(bad, "has more in it than changes");
  bad = good;
  bad[2].mutable_changes(0)->mutable_replace_body()->set_index(1);
  expect_refused(bad, "changes[0].continues: has more in it than arrays");
  bad = good;
  bad[2].mutable_changes(0)->mutable_add();
  expect_refused(bad, "changes[0].continues: the change before it is of another kind");
  grpc::ClientContext context;
  v1::ChangeSceneResponse response;
  Request alone = replacement(Sheet(2));
  alone.mutable_changes(0)->set_continues(true);
  EXPECT_THAT(stub_->ChangeScene(&context, alone, &response).error_message(),
              HasSubstr("is of StreamChangeScene alone"));
  EXPECT_TRUE(stream(good).ok());
}

TEST_F(StreamedChangesTest, OfAnUnknownSessionAreRefused) {
  Request other = replacement(Sheet(2));
  other.set_session_id("01234567-89ab-cdef-0123-456789abcdef");
  const grpc::Status status = stream(pieces(other));
  EXPECT_NE(status.error_code(), grpc::StatusCode::OK);
  EXPECT_EQ(info().vertex_count, 6U);
}

TEST_F(StreamedChangesTest, AreChargedWhileTheyComeAndGivenBack) {
  const std::uint64_t before = info().memory_bytes;
  const std::vector<Request> messages = pieces(replacement(Sheet(100)));
  const grpc::Status cancelled = stream([&](const Write& write, grpc::ClientContext& context) {
    for (std::size_t k = 0; k + 1 < messages.size(); ++k) ASSERT_TRUE(write(messages[k]));
    while (info().memory_bytes < before + 400000) std::this_thread::yield();
    context.TryCancel();
  });
  EXPECT_EQ(cancelled.error_code(), grpc::StatusCode::CANCELLED);
  while (info().memory_bytes > before) std::this_thread::yield();
  EXPECT_EQ(info().vertex_count, 6U);
  EXPECT_TRUE(session_->step({}).ok());
}

TEST_F(StreamedChangesTest, StopAtTheSessionsLimit) {
  daemon_.restart([](server::Config& config) { config.limits.max_session_bytes = 4 << 20; });
  ASSERT_TRUE(session_->step({}).ok());
  Request first = replacement(Sheet(2));
  first.set_next_frame(2);
  std::vector<Request> messages = pieces(first);
  Request more;
  v1::SceneChange& piece = *more.add_changes();
  piece.set_continues(true);
  piece.mutable_replace_body()->mutable_with()->set_faces(std::string(60000, '\0'));
  std::size_t sent = 0;
  const grpc::Status status = stream([&](const Write& write, grpc::ClientContext&) {
    for (const Request& message : messages) ASSERT_TRUE(write(message));
    while (sent < 100000 && write(more)) ++sent;
  });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("max-session-bytes"));
  EXPECT_LT(sent, 100000U) << "it was stopped on the way";
  EXPECT_TRUE(session_->step({}).ok());
}

}  // namespace
}  // namespace warmfront::test
