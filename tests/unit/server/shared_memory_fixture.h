// SPDX-License-Identifier: Apache-2.0
// A client of shared memory without our library, attached to a stream.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "tests/unit/server/packet_client.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {

inline constexpr std::uint64_t kSharedBytes = std::uint64_t{1} << 20;
inline constexpr std::uint64_t kAnswerRoomAt = std::uint64_t{1} << 19;

/// A stream of the session, attached.
struct AttachedStream {
  AttachedStream(v1::CollisionService::Stub& stub, const std::string& id)
      : stream(stub.StreamSteps(&context)) {
    stream->Write(attach(id));
    v1::StreamStepsResponse response;
    EXPECT_TRUE(stream->Read(&response));
    token = response.attached().shared_memory().token();
    state = response.attached();
  }
  static v1::StreamStepsRequest attach(const std::string& id) {
    v1::StreamStepsRequest request;
    request.mutable_attach()->set_session_id(id);
    request.mutable_attach()->set_takeover(true);
    return request;
  }

  Context context;
  std::unique_ptr<Stream> stream;
  std::string token;
  v1::Attached state;
};

class SharedMemoryTest : public ServiceTest {
 protected:
  using ServiceTest::ServiceTest;

  static v1::StreamStepsRequest shared_frame(std::uint64_t number, std::uint64_t offset,
                                             std::uint64_t length) {
    v1::StreamStepsRequest request;
    v1::StepFrame& step = *request.mutable_step();
    step.set_frame(number);
    step.mutable_shared_positions()->set_offset(offset);
    step.mutable_shared_positions()->set_length(length);
    return request;
  }
  /// The positions of the frame, from `offset` on, and where its answer may be.
  v1::StreamStepsRequest put(const PacketClient& packets, std::uint64_t number,
                             std::uint64_t offset = 0) const {
    const std::string positions = frame(number);
    std::memcpy(packets.memory() + offset, positions.data(), positions.size());
    v1::StreamStepsRequest request = shared_frame(number, offset, positions.size());
    request.mutable_step()->mutable_answer_room()->set_offset(kAnswerRoomAt);
    request.mutable_step()->mutable_answer_room()->set_length(kSharedBytes - kAnswerRoomAt);
    return request;
  }
  /// The hash of an answer, wherever its columns are.
  static std::uint64_t hash_in(const PacketClient& packets, const v1::StepAnswer& answer) {
    if (!answer.has_shared()) return hash_of(answer.contacts());
    v1::ContactColumns columns;
    std::uint64_t at = answer.shared().offset();
    const auto column = [&](wire::SharedColumn which, std::size_t size) {
      if ((answer.shared().columns() & wire::bit_of(which)) == 0) return std::string();
      at = wire::column_begins(at);
      std::string bytes(packets.memory() + at, size * answer.summary().rows());
      at += bytes.size();
      return bytes;
    };
    columns.set_kind(column(wire::SharedColumn::kKind, 1));
    columns.set_status(column(wire::SharedColumn::kStatus, 1));
    columns.set_v(column(wire::SharedColumn::kVertices, 16));
    columns.set_toi(column(wire::SharedColumn::kToi, 8));
    return hash_of(columns);
  }
  void expect_refused(PacketClient& packets, const v1::StreamStepsRequest& request, const char* words) {
    ASSERT_TRUE(packets.send(request));
    const auto response = packets.receive();
    ASSERT_TRUE(response);
    EXPECT_EQ(response->error().status().code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(response->error().status().message(), ::testing::HasSubstr(words));
  }
  std::uint64_t charged() {
    Context context;
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
    return info.charged_bytes();
  }
  std::uint64_t held() { return session_info().memory_bytes(); }

  const std::vector<std::uint64_t> expected_ = local_hashes(grids_, 0, 8);
};

}  // namespace warmfront::test
