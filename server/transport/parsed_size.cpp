// SPDX-License-Identifier: Apache-2.0
// Counting as protobuf's parser allocates. Thread safety as stated in the header.
#include "server/transport/parsed_size.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <grpcpp/impl/codegen/proto_utils.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "engine/workers.h"
#include "server/annotations.h"

namespace warmfront::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::io::CodedInputStream;
using Field = MessageLayout::Field;

// What an allocation takes beyond its size: malloc's header, and rounding up to 16.
constexpr std::size_t kBlock = 24;
// A place in a list that grows to twice its size, with the one that it is copied from.
constexpr std::size_t kPlaces = 3;
constexpr std::size_t kString = sizeof(std::string) + 2 * kBlock;  // the object, and its bytes' block
constexpr std::size_t kPointer = kPlaces * sizeof(void*);
// A field that the type does not know: 16 bytes in a list, and the list, when it is a message's first.
constexpr std::size_t kUnknownField = kPlaces * 16 + 2 * kBlock + 24;
constexpr int kDeepest = 100;
// Some 10 microseconds.
constexpr std::size_t kFieldsALook = 1024;

/// The bytes of a string: a large one may have pages of its own, of which malloc rounds up the number.
constexpr std::size_t string_bytes(std::size_t size) {
  constexpr std::size_t kLarge = 64 << 10, kPages = 8 << 10;
  return size + (size >= kLarge ? kPages : 0);
}

unsigned char width_of(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64:
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return 8;
    case FieldDescriptor::CPPTYPE_BOOL:
      return 1;
    default:
      return 4;
  }
}

/// All layouts made so far; a type that holds itself finds its own here.
struct Layouts {
  Mutex mutex;
  std::map<const Descriptor*, std::unique_ptr<MessageLayout>> by_type WARMFRONT_GUARDED_BY(mutex);
};

const MessageLayout& layout_locked(Layouts& all, const Descriptor& type) WARMFRONT_REQUIRES(all.mutex) {
  if (const auto known = all.by_type.find(&type); known != all.by_type.end()) return *known->second;
  auto made = std::make_unique<MessageLayout>();
  MessageLayout& layout = *made;
  const auto* prototype = google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
  layout.object_bytes = prototype->SpaceUsedLong() + kBlock;
  all.by_type.emplace(&type, std::move(made));
  // Two bytes make an empty one of these: a tag, and a length of 0, or the two tags of a group.
  std::size_t most_for_two = kUnknownField + std::max(kString, 24 + kBlock);
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& descriptor = *type.field(i);
    const auto number = static_cast<std::size_t>(descriptor.number());
    if (layout.fields.size() <= number) layout.fields.resize(number + 1);
    Field& field = layout.fields[number];
    field.repeated = descriptor.is_repeated();
    switch (descriptor.cpp_type()) {
      case FieldDescriptor::CPPTYPE_STRING:
        field.kind = Field::Kind::kString;
        break;
      case FieldDescriptor::CPPTYPE_MESSAGE:
        field.kind = Field::Kind::kMessage;
        field.message = &layout_locked(all, *descriptor.message_type());
        most_for_two = std::max(
            {most_for_two, field.message->object_bytes + kPointer, 2 * field.message->most_per_byte});
        break;
      default:
        field.kind = Field::Kind::kNumber;
        field.width = width_of(descriptor);
    }
  }
  layout.most_per_byte = (most_for_two + 1) / 2;
  return layout;
}

class Walk {
 public:
  /// Stops above `enough` bytes of memory, and after `most_fields`.
  Walk(CodedInputStream& in, std::size_t total, std::size_t enough, std::size_t most_fields = SIZE_MAX)
      : in_(in), total_(total), enough_(enough), fields_left_(most_fields) {}

  /// Of a message's fields up to the current limit, or to the end of group `group`. False to stop: enough,
  /// or no message.
  bool fields(const MessageLayout* type, int group, int depth) {
    if (depth > kDeepest) return false;
    while (const std::uint32_t tag = in_.ReadTag()) {
      const auto number = static_cast<std::size_t>(tag >> 3);
      constexpr Field kNotKnown{};
      const Field& field = type != nullptr && number < type->fields.size() ? type->fields[number] : kNotKnown;
      if (number == 0 || fields_left_ == 0) return false;
      if (--fields_left_ % kFieldsALook == 0) Workers::give_way();
      if ((tag & 7) == kEndGroup) return group != 0 && static_cast<int>(number) == group;
      if (!one(field, tag & 7, static_cast<int>(number), depth)) return false;
    }
    return group == 0 && in_.ConsumedEntireMessage();
  }

  std::size_t bytes() const { return bytes_; }
  bool out_of_fields() const { return fields_left_ == 0; }
  std::size_t left() const {
    return total_ - std::min(total_, static_cast<std::size_t>(in_.CurrentPosition()));
  }

 private:
  enum WireType : std::uint32_t { kVarint, kFixed64, kLength, kGroup, kEndGroup, kFixed32 };

  bool add(std::size_t bytes) { return (bytes_ += bytes) <= enough_; }

  bool one(const Field& field, std::uint32_t wire_type, int number, int depth) {
    std::uint64_t value = 0;
    std::uint32_t small = 0;
    const std::size_t scalar = field.kind != Field::Kind::kNumber ? kUnknownField
                               : field.repeated                   ? kPlaces * field.width
                                                                  : 0;
    switch (wire_type) {
      case kVarint:
        return in_.ReadVarint64(&value) && add(scalar);
      case kFixed64:
        return in_.ReadLittleEndian64(&value) && add(scalar);
      case kFixed32:
        return in_.ReadLittleEndian32(&small) && add(scalar);
      case kGroup:
        return add(kUnknownField + 24 + kBlock) && fields(nullptr, number, depth + 1);
      case kLength:
        return in_.ReadVarint32(&small) && small <= left() &&
               delimited(field, static_cast<int>(small), depth);
      default:
        return false;
    }
  }

  bool delimited(const Field& field, int length, int depth) {
    const auto size = static_cast<std::size_t>(length);
    switch (field.kind) {
      case Field::Kind::kMessage: {
        if (!add(field.message->object_bytes + (field.repeated ? kPointer : 0))) return false;
        if (length == 0) return depth < kDeepest;  // the most that there can be: no need of a limit
        const auto outer = in_.PushLimit(length);
        const bool whole = fields(field.message, 0, depth + 1);
        in_.PopLimit(outer);
        return whole;
      }
      case Field::Kind::kString:
        return add(kString + string_bytes(size) + (field.repeated ? kPointer : 0)) && in_.Skip(length);
      case Field::Kind::kNumber:  // packed: a byte each at least
        return add(field.repeated ? kPlaces * field.width * size
                                  : kUnknownField + kString + string_bytes(size)) &&
               in_.Skip(length);
      case Field::Kind::kUnknown:
        break;
    }
    return add(kUnknownField + kString + string_bytes(size)) && in_.Skip(length);
  }

  CodedInputStream& in_;
  const std::size_t total_, enough_;
  std::size_t bytes_ = 0, fields_left_;
};

}  // namespace

const MessageLayout& MessageLayout::of(const Descriptor& type) {
  static Layouts& all = *new Layouts;  // used by threads of gRPC until the process is gone
  const MutexLock lock(all.mutex);
  return layout_locked(all, type);
}

std::size_t parsed_size(const grpc::ByteBuffer& bytes, const MessageLayout& type, std::size_t enough) {
  grpc::ByteBuffer same = bytes;  // another reference to it
  grpc::ProtoBufferReader reader(&same);
  const std::size_t total = bytes.Length();
  if (!reader.status().ok()) return type.object_bytes;  // nor can it be parsed
  CodedInputStream in(&reader);
  Walk walk(in, total, enough > type.object_bytes ? enough - type.object_bytes : 0);
  const bool whole = walk.fields(&type, 0, 1);
  // The parser may go on a little longer than the walk did, and make one more object.
  return type.object_bytes + walk.bytes() + (whole ? 0 : (walk.left() + 2) * (type.most_per_byte + 1));
}

bool has_more_fields(const grpc::ByteBuffer& bytes, const MessageLayout& type, std::size_t most) {
  grpc::ByteBuffer same = bytes;
  grpc::ProtoBufferReader reader(&same);
  if (!reader.status().ok()) return false;
  CodedInputStream in(&reader);
  Walk walk(in, bytes.Length(), SIZE_MAX, most + 1);
  walk.fields(&type, 0, 1);
  return walk.out_of_fields();
}

}  // namespace warmfront::server
