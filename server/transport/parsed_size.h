// SPDX-License-Identifier: Apache-2.0
// What a message becomes in memory, told from its bytes before they are parsed: two bytes on the wire may be
// an object of a hundred. Thread-safe.
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <vector>

namespace warmfront::server {

/// What a message type and those in it cost in memory, from the generated descriptors. Constant.
class MessageLayout {
 public:
  /// Of a generated type; made once per process and type, and kept.
  static const MessageLayout& of(const google::protobuf::Descriptor& type);

  struct Field {
    enum class Kind : unsigned char { kUnknown, kNumber, kString, kMessage } kind = Kind::kUnknown;
    bool repeated = false;
    unsigned char width = 0;                 ///< of a number, in memory
    const MessageLayout* message = nullptr;  ///< of a message
  };

  std::size_t object_bytes = 0;  ///< of one that is empty, with what the allocator adds
  std::vector<Field> fields;     ///< by number; what is missing is unknown
  /// No message of this type takes more for a byte on the wire, this object itself and strings' own bytes
  /// apart.
  std::size_t most_per_byte = 0;

  /// What a message of so many bytes becomes at most.
  std::size_t most(std::size_t bytes) const { return object_bytes + (bytes + 2) * (most_per_byte + 1); }
};

/// The layout of a generated type, looked up once.
template <class Message>
const MessageLayout& layout_of() {
  static const MessageLayout& layout = MessageLayout::of(*Message::descriptor());
  return layout;
}

/// At least the bytes of memory that protobuf 3.21 takes for parsing `bytes` as that type, counted to
/// `enough`, after which it stops counting. Of bytes that are no such message: at least what it takes until
/// it finds out. One pass over the tags, without allocating: what strings hold is skipped; nested as deep as
/// protobuf itself goes, which is 100.
std::size_t parsed_size(const grpc::ByteBuffer& bytes, const MessageLayout& type, std::size_t enough);

/// Whether they have more fields than `most`, those of messages within them included, as far as they are a
/// message of that type. Looks at no more than so many.
bool has_more_fields(const grpc::ByteBuffer& bytes, const MessageLayout& type, std::size_t most);

}  // namespace warmfront::server
