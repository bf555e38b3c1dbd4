// SPDX-License-Identifier: Apache-2.0
// A client without our library: a bare stub, a scene, and shorthands for the messages. Used by one thread at
// a time.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "tests/unit/server/moving_grids.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {

using Stream = grpc::ClientReaderWriter<v1::StreamStepsRequest, v1::StreamStepsResponse>;

inline constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";
inline constexpr const char* kOther = "11234567-89ab-cdef-0123-456789abcdef";

inline std::string bytes_of(const std::vector<double>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

inline v1::ErrorDetail detail_of(const v1::Status& status) {
  v1::ErrorDetail detail;
  for (const auto& any : status.details()) any.UnpackTo(&detail);
  return detail;
}

inline v1::ErrorDetail detail_of(const grpc::Status& status) {
  v1::Status message;
  message.ParseFromString(status.error_details());
  return detail_of(message);
}

/// A context that ends every call, so that no test hangs; much later than a machine that does other work may
/// need for it.
struct Context : grpc::ClientContext {
  Context() { set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(3)); }
};

class BareClient {
 public:
  /// A connection of its own.
  static std::shared_ptr<grpc::Channel> channel_to(const std::string& address) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    // A daemon that was just started is found at once.
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
    // How long connecting may take: other tests keep the machine busy.
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 10'000);
    return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  }

  /// Calls go to `address` from now on.
  void connect(const std::string& address) {
    address_ = address;
    channel_ = channel_to(address);
    stub_ = v1::CollisionService::NewStub(channel_);
  }

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

  /// `header()` of a scene that is a body for each grid.
  v1::SessionHeader header_with_bodies(const std::string& id = kId) const {
    v1::SessionHeader described = header(id);
    for (const std::uint32_t first : {0U, grids_.vertex_count() / 2}) {
      v1::Body& body = *described.add_bodies();
      body.set_first_vertex(first);
      body.set_vertex_count(grids_.vertex_count() / 2);
    }
    return described;
  }

  /// `more` follows the positions.
  grpc::Status create(const v1::SessionHeader& header, const std::string& faces, const std::string& positions,
                      const std::vector<v1::CreateSessionRequest>& more = {},
                      v1::CreateSessionResponse* response = nullptr) {
    Context context;
    v1::CreateSessionResponse ignored;
    const auto writer = stub_->CreateSession(&context, response ? response : &ignored);
    v1::CreateSessionRequest request;
    *request.mutable_header() = header;
    writer->Write(request);
    request.set_faces(faces);
    writer->Write(request);
    request.set_positions(positions);
    writer->Write(request);
    for (const v1::CreateSessionRequest& piece : more) writer->Write(piece);
    writer->WritesDone();
    return writer->Finish();
  }
  grpc::Status create(const std::string& id = kId) {
    return create(header(id), faces(), bytes_of(grids_.positions(0)));
  }

  v1::SessionInfo session_info(const std::string& id = kId) {
    Context context;
    v1::GetSessionRequest request;
    request.set_session_id(id);
    v1::GetSessionResponse response;
    const grpc::Status status = stub_->GetSession(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.session();
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

  /// The daemon still serves, and answers a session of its own correctly.
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
  std::string address_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::CollisionService::Stub> stub_;
};

}  // namespace warmfront::test
