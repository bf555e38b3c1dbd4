// SPDX-License-Identifier: Apache-2.0
#include "client/lib/frame_message.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <grpcpp/support/slice.h>

#include <array>

namespace warmfront::client {
namespace {

using google::protobuf::io::CodedOutputStream;

/// Writes the tag and length of a bytes or message field, before its content.
void write_length(CodedOutputStream& out, int field, std::size_t length) {
  constexpr std::uint32_t kLengthDelimited = 2;
  out.WriteTag(static_cast<std::uint32_t>(field) << 3 | kLengthDelimited);
  out.WriteVarint64(length);
}

template <class Write>
std::string written(Write write) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  CodedOutputStream out(&stream);
  write(out);
  out.Trim();
  return bytes;
}

grpc::Slice shared_slice(const FrameBytes& bytes, std::size_t at, std::size_t count) {
  using Owner = FrameBytes;
  // gRPC takes the bytes as they are and does not write to them.
  return {const_cast<char*>(bytes.data()) + at, count, [](void* owner) { delete static_cast<Owner*>(owner); },
          new Owner(bytes)};
}

}  // namespace

grpc::ByteBuffer positions_message(std::uint64_t frame, bool more, const FrameBytes& positions,
                                   std::size_t at, std::size_t count, const v1::Question* question) {
  v1::StepFrame rest;
  if (question != nullptr) *rest.mutable_question() = *question;
  rest.set_frame(frame);
  rest.set_more(more);
  // Fields may come in any order: the positions last.
  const std::string step = written([&](CodedOutputStream& out) {
    out.WriteString(rest.SerializeAsString());
    write_length(out, v1::StepFrame::kPositionsFieldNumber, count);
  });
  const std::string head = written([&](CodedOutputStream& out) {
    write_length(out, v1::StreamStepsRequest::kStepFieldNumber, step.size() + count);
    out.WriteString(step);
  });
  const std::array slices{grpc::Slice(head), shared_slice(positions, at, count)};
  return {slices.data(), slices.size()};
}

}  // namespace warmfront::client
