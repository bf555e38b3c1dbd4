// SPDX-License-Identifier: Apache-2.0
// Messages to values and back, chunks, uploads and statuses: everything at the wire that needs no network.
#include "server/transport/convert.h"

#include <gmock/gmock.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>

#include "client/lib/wire.h"
#include "server/transport/errors.h"
#include "server/transport/stream_codec.h"
#include "server/transport/upload.h"

namespace warmfront::server {
namespace {

using ::testing::HasSubstr;

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";

v1::SessionHeader header(std::uint32_t vertices, std::uint32_t faces) {
  v1::SessionHeader header;
  header.set_session_id(kId);
  header.set_vertex_count(vertices);
  header.set_face_count(faces);
  header.set_dtype(v1::DTYPE_FLOAT32);
  return header;
}

Answer make_rows(std::size_t rows) {
  Answer answer;
  answer.frame = 5;
  answer.vf = rows;
  answer.earliest_toi = 0.125;
  answer.statistics.counts.bv_tests = 42;
  answer.statistics.front_state = FrontState::kRebuilt;
  for (std::size_t i = 0; i < rows; ++i) {
    answer.kind.push_back(i % 2);
    answer.status.push_back(static_cast<std::uint8_t>(1 + i % 4));
    const auto v = static_cast<std::uint32_t>(i);
    answer.vertices.push_back({v, v + 1, v + 2, v + 3});
    answer.toi.push_back(0.5 / static_cast<double>(i + 1));
  }
  return answer;
}

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

TEST(OptionsTest, DefaultsAreTheEnginesAndAllSurviveTheRoundTrip) {
  Limits roomy;  // whatever this machine has
  roomy.max_session_bytes = std::size_t{1} << 40;
  const ColliderOptions defaults = options_from({}, roomy).value();
  EXPECT_EQ(to_proto(defaults).SerializeAsString(), to_proto(ColliderOptions{}).SerializeAsString());
  ColliderOptions options;
  options.tolerance = 0.25;
  options.min_separation = 3;
  options.report = Report::kEarliest;
  options.front = FrontMode::kPaper;
  options.bounds = BoundsKind::kAabb;
  options.normal_cones = true;
  options.lazy_front = false;
  options.leaf_size = 2;
  options.rebuild_after_stalled_steps = 0;
  options.rebuild_every_steps = 9;
  options.max_front_bytes = 1000;
  options.max_contacts = 77;
  const v1::ColliderOptions message = client::to_proto(options);
  EXPECT_EQ(to_proto(options_from(message, {}).value()).SerializeAsString(), message.SerializeAsString())
      << "client and server give every field the same meaning";
  Limits limits;
  limits.max_contacts = 10;
  EXPECT_EQ(options_from(message, limits).value().max_contacts, 10u);
}

TEST(OptionsTest, BadValuesNameTheField) {
  v1::ColliderOptions message;
  message.set_tolerance(2);
  EXPECT_THAT(options_from(message, {}).fault().message, HasSubstr("tolerance"));
  message = {};
  message.set_front(static_cast<v1::FrontMode>(17));
  EXPECT_EQ(options_from(message, {}).fault().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(options_from(message, {}).fault().message, HasSubstr("options.front: value 17"));
}

TEST(AnswerChunksTest, AnyChunkSizeGivesTheSameRowsOnceAndOneSummary) {
  for (const std::size_t rows : {0u, 1u, 7u, 100u}) {
    const Answer answer = make_rows(rows);
    for (const std::size_t chunk_bytes : {1u, 26u, 27u, 260u, 1u << 20}) {
      client::Answer received;
      std::size_t lasts = 0;
      AnswerChunks chunks(std::make_shared<const Answer>(make_rows(rows)), chunk_bytes);
      while (!chunks.done()) {
        grpc::ByteBuffer chunk = chunks.next();
        EXPECT_EQ(lasts, 0u) << "nothing comes after the last";
        v1::StreamStepsResponse response;
        ASSERT_TRUE(grpc::SerializationTraits<v1::StreamStepsResponse>::Deserialize(&chunk, &response).ok());
        EXPECT_LE(response.answer().contacts().kind().size() * Answer::kBytesPerRow,
                  std::max(chunk_bytes, Answer::kBytesPerRow));
        ASSERT_TRUE(client::append_columns(response.answer().contacts(), received.contacts).ok());
        if (!response.answer().last()) continue;
        ++lasts;
        ASSERT_TRUE(client::finish_answer(response.answer(), received).ok());
      }
      EXPECT_EQ(lasts, 1u);
      EXPECT_EQ(received.frame, 5u);
      EXPECT_EQ(received.contacts.vertices, answer.vertices);
      EXPECT_EQ(received.contacts.toi, answer.toi);
      EXPECT_EQ(received.earliest_toi, 0.125);
      EXPECT_EQ(received.statistics.counts.bv_tests, 42u);
      EXPECT_EQ(received.statistics.front_state, FrontState::kRebuilt);
    }
  }
}

TEST(AnswerChunksTest, ReducedRowsComeWithWhatTheyStandForInChunksOfAnySize) {
  const auto make_reduced = [] {
    Answer made = make_rows(50);
    for (std::uint32_t i = 0; i < 50; ++i) {
      made.multiplicity.push_back(1 + 3 * i);
      made.stencil.push_back(std::array<std::uint8_t, 3>{15, 7, 5}[i % 3]);
    }
    return made;
  };
  const Answer answer = make_reduced();
  EXPECT_EQ(answer.bytes_per_row(), Answer::kBytesPerRow + 5);
  for (const std::size_t chunk_bytes : {1u, 31u, 310u, 1u << 20}) {
    client::Answer received;
    AnswerChunks chunks(std::make_shared<const Answer>(make_reduced()), chunk_bytes);
    while (!chunks.done()) {
      grpc::ByteBuffer chunk = chunks.next();
      v1::StreamStepsResponse response;
      ASSERT_TRUE(grpc::SerializationTraits<v1::StreamStepsResponse>::Deserialize(&chunk, &response).ok());
      ASSERT_TRUE(client::append_part(response.answer(), received).ok());
      if (!response.answer().last()) continue;
      ASSERT_TRUE(client::finish_answer(response.answer(), received).ok());
    }
    EXPECT_EQ(received.contacts.multiplicity, answer.multiplicity);
    EXPECT_EQ(received.contacts.stencil, answer.stencil);
  }
  v1::ContactColumns columns;
  fill_columns(answer, 0, 3, columns);
  const auto malformed = [&](auto spoil) {
    v1::ContactColumns bad = columns;
    spoil(bad);
    client::ContactTable table;
    return !client::append_columns(bad, table).ok();
  };
  EXPECT_FALSE(malformed([](v1::ContactColumns&) {}));
  EXPECT_TRUE(malformed([](v1::ContactColumns& bad) { bad.clear_stencil(); }));
  EXPECT_TRUE(malformed([](v1::ContactColumns& bad) { bad.mutable_multiplicity()->pop_back(); }));
  for (const char stencil : {0, 2, 8, 16, 127, -1})
    EXPECT_TRUE(malformed([&](v1::ContactColumns& bad) { bad.mutable_stencil()->back() = stencil; }));
}

TEST(ParserTest, EveryTruncationOfAMessageIsRefusedOrIncomplete) {
  v1::StreamStepsRequest request;
  request.mutable_step()->set_frame(300);
  request.mutable_step()->set_positions(std::string(64, 'p'));
  const std::string bytes = request.SerializeAsString();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    grpc::ByteBuffer buffer = buffer_of(bytes.substr(0, size));
    const auto parsed = parse_request(buffer);
    ASSERT_FALSE(parsed.ok()) << size;
    EXPECT_EQ(parsed.fault().code, ErrorCode::kInvalidArgument);
  }
  grpc::ByteBuffer whole = buffer_of(bytes);
  EXPECT_TRUE(parse_request(whole).ok());
}

TEST(ParserTest, RandomBytesNeverDoHarm) {
  std::mt19937 random(7);
  std::size_t refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes(random() % 80, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    grpc::ByteBuffer buffer = buffer_of(bytes);
    const auto parsed = parse_request(buffer);
    if (!parsed.ok()) {
      EXPECT_EQ(parsed.fault().code, ErrorCode::kInvalidArgument);
      ++refused;
    }
  }
  EXPECT_GT(refused, 19'000u);
}

TEST(UploadTest, LengthsOrderAndHeaderAreChecked) {
  const Limits limits;
  const auto fault_of = [&](std::vector<v1::CreateSessionRequest> requests) {
    Upload upload(limits);
    for (const v1::CreateSessionRequest& request : requests)
      if (auto fault = upload.add(request)) return *fault;
    return upload.complete().value_or(Fault{ErrorCode::kInternal, Reason::kEngine, "accepted"});
  };
  v1::CreateSessionRequest head, faces, positions;
  *head.mutable_header() = header(3, 1);
  faces.set_faces(std::string(12, '\0'));
  positions.set_positions(std::string(36, '\0'));
  EXPECT_EQ(fault_of({head, faces, positions}).message, "accepted");
  EXPECT_EQ(fault_of({head, positions, faces}).message, "accepted") << "the two may be mixed";

  EXPECT_THAT(fault_of({faces}).message, HasSubstr("header comes first"));
  EXPECT_THAT(fault_of({head, head}).message, HasSubstr("second header"));
  EXPECT_THAT(fault_of({v1::CreateSessionRequest{}}).message, HasSubstr("none of"));
  EXPECT_THAT(fault_of({}).message, HasSubstr("before its header"));
  EXPECT_THAT(fault_of({head, faces}).message, HasSubstr("positions: 0 bytes, but 36 bytes are expected"));
  EXPECT_THAT(fault_of({head, positions}).message, HasSubstr("faces: the upload ended after 0 of 12 bytes"));
  EXPECT_THAT(fault_of({head, faces, faces}).message, HasSubstr("faces: 24 bytes, but 12 are expected"));
  EXPECT_THAT(fault_of({head, faces, positions, positions}).message,
              HasSubstr("positions: at least 72 bytes"));

  v1::CreateSessionRequest bad = head;
  bad.mutable_header()->set_session_id("me");
  EXPECT_THAT(fault_of({bad}).message, HasSubstr("session_id"));
  bad = head;
  bad.mutable_header()->set_dtype(v1::DTYPE_UNSPECIFIED);
  EXPECT_THAT(fault_of({bad}).message, HasSubstr("dtype"));
  bad = head;
  bad.mutable_header()->set_vertex_count(4'000'000'000u);
  EXPECT_EQ(fault_of({bad}).code, ErrorCode::kResourceExhausted);
  EXPECT_THAT(fault_of({bad}).message, HasSubstr("vertex_count: 4000000000"));
  bad = head;
  bad.mutable_header()->add_bodies()->set_kind(static_cast<v1::BodyKind>(9));
  EXPECT_THAT(fault_of({bad}).message, HasSubstr("bodies[0].kind"));
}

TEST(StatusTest, DetailsSurviveTheTrailer) {
  const Fault fault{ErrorCode::kFailedPrecondition, Reason::kFrameOutOfOrder, "frame 9 is out of order", 7};
  const grpc::Status status = to_grpc(fault);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  v1::Status message;
  ASSERT_TRUE(message.ParseFromString(status.error_details()));
  v1::ErrorDetail detail;
  ASSERT_EQ(message.details_size(), 2);
  ASSERT_TRUE(message.details(0).UnpackTo(&detail));
  EXPECT_EQ(detail.reason(), v1::ERROR_REASON_FRAME_OUT_OF_ORDER);
  EXPECT_EQ(detail.expected_frame(), 7u);
  EXPECT_EQ(client::remote_error_from(status).error.code, ErrorCode::kFailedPrecondition);
  v1::ErrorInfo info;
  EXPECT_EQ(message.details(1).type_url(), "type.googleapis.com/google.rpc.ErrorInfo");
  ASSERT_TRUE(info.ParseFromString(message.details(1).value()));
  EXPECT_EQ(info.reason(), "FRAME_OUT_OF_ORDER");
  EXPECT_EQ(info.domain(), "warmfront.v1");
  EXPECT_EQ(info.metadata().at("expected_frame"), "7");
}

TEST(StatusTest, GenericClientsLearnWhenToRetryAndWhichLimit) {
  const v1::Status message = to_proto(limit_met("sessions: 4 of 4", "max-sessions", true));
  ASSERT_EQ(message.details_size(), 4);
  v1::ErrorInfo info;
  v1::RetryInfo retry;
  v1::QuotaFailure quota;
  ASSERT_TRUE(info.ParseFromString(message.details(1).value()));
  EXPECT_EQ(info.reason(), "LIMIT");
  EXPECT_EQ(info.metadata().at("limit"), "max-sessions");
  EXPECT_EQ(message.details(2).type_url(), "type.googleapis.com/google.rpc.RetryInfo");
  ASSERT_TRUE(retry.ParseFromString(message.details(2).value()));
  EXPECT_EQ(retry.retry_delay().seconds(), 1);
  EXPECT_EQ(message.details(3).type_url(), "type.googleapis.com/google.rpc.QuotaFailure");
  ASSERT_TRUE(quota.ParseFromString(message.details(3).value()));
  EXPECT_EQ(quota.violations(0).subject(), "limit:max-sessions");
  EXPECT_EQ(quota.violations(0).description(), "sessions: 4 of 4");
  EXPECT_EQ(to_proto(limit_met("a scene", "max-vertices", false)).details_size(), 3) << "no retry helps";
}

}  // namespace
}  // namespace warmfront::server
