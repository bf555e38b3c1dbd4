// SPDX-License-Identifier: Apache-2.0
// The service over gRPC as a client sees it that does not use our library: uploads, frames, streams and their
// errors.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <random>

#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;
using Stream = grpc::ClientReaderWriter<v1::StreamStepsRequest, v1::StreamStepsResponse>;

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";
constexpr const char* kOther = "11234567-89ab-cdef-0123-456789abcdef";

std::string bytes_of(const std::vector<double>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

v1::ErrorDetail detail_of(const v1::Status& status) {
  v1::ErrorDetail detail;
  for (const auto& any : status.details()) any.UnpackTo(&detail);
  return detail;
}

v1::ErrorDetail detail_of(const grpc::Status& status) {
  v1::Status message;
  message.ParseFromString(status.error_details());
  return detail_of(message);
}

/// A context that ends every call in time, so that no test hangs.
struct Context : grpc::ClientContext {
  Context() { set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30)); }
};

class ServiceTest : public ::testing::Test {
 protected:
  explicit ServiceTest(server::Config config = {})
      : daemon_(std::move(config)),
        channel_(grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials())),
        stub_(v1::CollisionService::NewStub(channel_)) {}

  v1::SessionHeader header(const std::string& id = kId) const {
    v1::SessionHeader header;
    header.set_session_id(id);
    header.set_vertex_count(grids_.vertex_count());
    header.set_face_count(static_cast<std::uint32_t>(grids_.scene().faces.size()));
    header.set_dtype(v1::DTYPE_FLOAT64);
    return header;
  }
  std::string faces() const {
    const SceneDescription scene = grids_.scene();
    return {reinterpret_cast<const char*>(scene.faces.data()), scene.faces.size() * 12};
  }

  grpc::Status create(const v1::SessionHeader& header, const std::string& faces,
                      const std::string& positions) {
    Context context;
    v1::CreateSessionResponse response;
    const auto writer = stub_->CreateSession(&context, &response);
    v1::CreateSessionRequest request;
    *request.mutable_header() = header;
    writer->Write(request);
    request.set_faces(faces);
    writer->Write(request);
    request.set_positions(positions);
    writer->Write(request);
    writer->WritesDone();
    return writer->Finish();
  }
  grpc::Status create(const std::string& id = kId) {
    return create(header(id), faces(), bytes_of(grids_.positions(0)));
  }

  grpc::Status step(std::uint64_t frame, const std::string& positions, v1::StepResponse* response = nullptr,
                    const std::string& id = kId) {
    Context context;
    v1::StepRequest request;
    request.set_session_id(id);
    request.set_frame(frame);
    request.set_positions(positions);
    v1::StepResponse ignored;
    return stub_->Step(&context, request, response ? response : &ignored);
  }
  std::string frame(std::uint64_t number) const { return bytes_of(grids_.positions(number)); }

  /// The daemon still serves, and steps a session of its own rightly.
  void expect_healthy() {
    static int count = 0;
    const std::string id = "21234567-89ab-cdef-0123-" + std::to_string(100000000000 + count++);
    ASSERT_TRUE(create(id).ok());
    v1::StepResponse response;
    ASSERT_TRUE(step(1, frame(1), &response, id).ok());
    EXPECT_EQ(hash_of(response.contacts()), local_hashes(grids_, 0, 1).front());
    Context context;
    v1::DeleteSessionRequest request;
    request.set_session_id(id);
    v1::DeleteSessionResponse deleted;
    EXPECT_TRUE(stub_->DeleteSession(&context, request, &deleted).ok());
  }

  static std::uint64_t hash_of(const v1::ContactColumns& columns) {
    ContactHash hash;
    const std::size_t rows = columns.kind().size();
    hash.begin_step(rows);
    for (std::size_t i = 0; i < rows; ++i) {
      std::array<std::uint32_t, 4> v{};
      double toi = 0;
      std::memcpy(v.data(), columns.v().data() + 16 * i, 16);
      std::memcpy(&toi, columns.toi().data() + 8 * i, 8);
      hash.add(static_cast<ContactKind>(columns.kind()[i]), static_cast<ContactStatus>(columns.status()[i]),
               v, toi);
    }
    return hash.value();
  }

  static v1::StreamStepsRequest attach(const std::string& id, bool takeover = false) {
    v1::StreamStepsRequest request;
    request.mutable_attach()->set_session_id(id);
    request.mutable_attach()->set_takeover(takeover);
    return request;
  }
  static v1::StreamStepsRequest frame_message(std::uint64_t number, const std::string& positions,
                                              bool more = false) {
    v1::StreamStepsRequest request;
    request.mutable_step()->set_frame(number);
    request.mutable_step()->set_positions(positions);
    request.mutable_step()->set_more(more);
    return request;
  }
  static v1::StreamStepsRequest detach() {
    v1::StreamStepsRequest request;
    request.mutable_detach();
    return request;
  }

  /// Attaches and takes the reply.
  std::unique_ptr<Stream> open(Context& context, std::uint64_t expected_frame, const std::string& id = kId,
                               bool takeover = false) {
    auto stream = stub_->StreamSteps(&context);
    stream->Write(attach(id, takeover));
    v1::StreamStepsResponse response;
    EXPECT_TRUE(stream->Read(&response));
    EXPECT_EQ(response.attached().expected_frame(), expected_frame);
    return stream;
  }

  const MovingGrids grids_{6};
  LocalDaemon daemon_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::CollisionService::Stub> stub_;
};

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
  bad_faces = faces();
  std::memcpy(bad_faces.data() + 12 * 7, bad_faces.data() + 12 * 7 + 8, 4);
  expect(create(header(), bad_faces, frame(0)), "face", "7");
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

TEST_F(ServiceTest, AStreamPipelinesAndKeepsTheOrderOverErrors) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  std::string bad = frame(2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(bad.data() + 8 * (3 * 4 + 2), &nan, 8);
  stream->Write(frame_message(1, frame(1)));
  stream->Write(frame_message(2, bad));
  stream->Write(frame_message(3, frame(3)));
  // Frame 2 once more, in three parts that end within a number.
  const std::string good = frame(2);
  stream->Write(frame_message(2, good.substr(0, 5), true));
  stream->Write(frame_message(2, good.substr(5, 100), true));
  stream->Write(frame_message(2, good.substr(105)));
  stream->Write(detach());
  v1::StreamStepsResponse response;
  const auto expected = local_hashes(grids_, 0, 2);
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected[0]);
  EXPECT_TRUE(response.answer().last());
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.error().status().code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(response.error().frame(), 2u);
  EXPECT_THAT(response.error().status().message(), HasSubstr("4"));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.error().status().code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(detail_of(response.error().status()).expected_frame(), 2u);
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected[1]);
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok()) << "a detach ends well";
}

TEST_F(ServiceTest, MessagesOutOfPlaceEndTheStreamAndNotTheSession) {
  ASSERT_TRUE(create().ok());
  const auto ends_with = [&](const std::vector<v1::StreamStepsRequest>& requests) {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    for (const auto& request : requests)
      if (!stream->Write(request)) break;
    stream->WritesDone();
    v1::StreamStepsResponse response;
    while (stream->Read(&response)) {
    }
    return stream->Finish();
  };
  EXPECT_EQ(ends_with({frame_message(1, frame(1))}).error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ends_with({attach(kId), attach(kId)}).error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ends_with({attach(kOther)}).error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(ends_with({attach("x")}).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ends_with({attach(kId), frame_message(1, "abc", true), frame_message(2, "abc")}).error_code(),
            StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ends_with({attach(kId), frame_message(1, "abc", true)}).error_code(),
            StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(ends_with({attach(kId)}).ok()) << "a half-close is as good as a detach";
  EXPECT_TRUE(ends_with({}).ok());
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(ServiceTest, GarbageOnAStreamIsInvalidArgumentAndTheSessionLives) {
  ASSERT_TRUE(create().ok());
  grpc::GenericStub generic(channel_);
  std::mt19937 random(3);
  const std::string whole = frame_message(1, std::string(40, 'p')).SerializeAsString();
  for (int round = 0; round < 60; ++round) {
    // Truncations of a real message, then random bytes of a wire type that does not exist.
    std::string garbage;
    if (round < 30) {
      garbage = whole.substr(0, whole.size() - 1 - static_cast<std::size_t>(round));
    } else {
      garbage.resize(1 + random() % 200, '\x07');
      for (std::size_t i = 1; i < garbage.size(); ++i) garbage[i] = static_cast<char>(random());
    }
    Context context;
    grpc::CompletionQueue queue;
    const auto call = generic.PrepareCall(&context, "/warmfront.v1.CollisionService/StreamSteps", &queue);
    const auto wait = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    const auto write = [&](const std::string& bytes) {
      const grpc::Slice slice(bytes);
      call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
      return wait();
    };
    call->StartCall(nullptr);
    ASSERT_TRUE(wait());
    if (round % 2 == 0) {
      ASSERT_TRUE(write(attach(kId, true).SerializeAsString()));
    }
    write(garbage);
    // The status comes after whatever was answered before.
    grpc::ByteBuffer answer;
    do {
      call->Read(&answer, nullptr);
    } while (wait());
    grpc::Status status;
    call->Finish(&status, nullptr);
    wait();
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << round << ": " << status.error_message();
    queue.Shutdown();
  }
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(ServiceTest, ASessionHasOneStreamUnlessItIsTakenOver) {
  ASSERT_TRUE(create().ok());
  Context first, second, third;
  const auto holder = open(first, 1);
  const auto refused = stub_->StreamSteps(&second);
  refused->Write(attach(kId));
  v1::StreamStepsResponse response;
  EXPECT_FALSE(refused->Read(&response));
  const grpc::Status status = refused->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::ABORTED);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_SESSION_ATTACHED);
  const auto taker = open(third, 1, kId, true);
  EXPECT_FALSE(holder->Read(&response));
  EXPECT_EQ(holder->Finish().error_code(), StatusCode::ABORTED);
  taker->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(taker->Read(&response));
  EXPECT_EQ(response.answer().frame(), 1u);
}

TEST_F(ServiceTest, DeletingASessionEndsItsStream) {
  ASSERT_TRUE(create().ok());
  Context context, remove;
  const auto stream = open(context, 1);
  v1::DeleteSessionRequest request;
  request.set_session_id(kId);
  v1::DeleteSessionResponse deleted;
  ASSERT_TRUE(stub_->DeleteSession(&remove, request, &deleted).ok());
  v1::StreamStepsResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::NOT_FOUND);
}

TEST_F(ServiceTest, AVanishedClientLeavesTheSessionToTheNext) {
  ASSERT_TRUE(create().ok());
  {
    Context context;
    const auto stream = open(context, 1);
    stream->Write(frame_message(1, frame(1)));
    context.TryCancel();
    EXPECT_FALSE(stream->Finish().ok());
  }
  // Frame 1 may or may not have been read before the end; both are fine, and nobody is locked out for long.
  Context context;
  auto stream = stub_->StreamSteps(&context);
  stream->Write(attach(kId, true));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_LE(response.attached().expected_frame(), 2u);
  stream->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), local_hashes(grids_, 0, 1).front());
}

class SmallLimitsTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_sessions = 1;
    config.limits.max_triangles = 100;
    config.limits.answer_chunk_bytes = 64;
    config.limits.window = 1;
    config.limits.max_message_bytes = 64 << 10;
    return config;
  }
  SmallLimitsTest() : ServiceTest(config()) {}
};

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

TEST_F(SmallLimitsTest, AnswersComeInChunksAndManyFramesThroughAWindowOfOne) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  const auto expected = local_hashes(grids_, 0, 8);
  // All are sent at once: what is beyond the window waits unread.
  for (std::uint64_t k = 1; k <= 8; ++k) ASSERT_TRUE(stream->Write(frame_message(k, frame(k))));
  for (std::uint64_t k = 1; k <= 8; ++k) {
    v1::ContactColumns all;
    v1::StreamStepsResponse response;
    std::size_t chunks = 0;
    do {
      ASSERT_TRUE(stream->Read(&response));
      ASSERT_EQ(response.answer().frame(), k);
      const v1::ContactColumns& part = response.answer().contacts();
      EXPECT_LE(part.kind().size(), 2u) << "64 bytes are two rows";
      all.mutable_kind()->append(part.kind());
      all.mutable_status()->append(part.status());
      all.mutable_v()->append(part.v());
      all.mutable_toi()->append(part.toi());
      ++chunks;
    } while (!response.answer().last());
    EXPECT_GT(chunks, 2u);
    EXPECT_EQ(response.answer().summary().rows(), all.kind().size());
    EXPECT_EQ(hash_of(all), expected[k - 1]);
  }
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

TEST_F(ExpiryTest, IdleSessionsAreClosedAndSaidSo) {
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

TEST_F(ServiceTest, DrainRefusesNewCallsNotifiesStreamsAndDeliversWhatIsInHand) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  for (std::uint64_t k = 1; k <= 3; ++k) stream->Write(frame_message(k, frame(k)));
  v1::StreamStepsResponse response;
  // The first answer shows that the frames arrived.
  ASSERT_TRUE(stream->Read(&response));
  bool drained = false;
  std::thread drain([&] { drained = daemon_->drain(); });
  std::uint64_t answered = 1;
  bool noticed = false;
  while (stream->Read(&response)) {
    if (response.has_draining()) noticed = true;
    if (response.has_answer()) {
      EXPECT_EQ(response.answer().frame(), ++answered);
    }
  }
  const grpc::Status status = stream->Finish();
  drain.join();
  EXPECT_TRUE(noticed);
  EXPECT_EQ(answered, 3u);
  EXPECT_EQ(status.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_DRAINING);
  EXPECT_TRUE(drained);
  EXPECT_EQ(create(kOther).error_code(), StatusCode::UNAVAILABLE);
}

}  // namespace
}  // namespace warmfront::test
