// SPDX-License-Identifier: Apache-2.0
#include "client/cli/ranges/input_digest.h"

#include <cstdint>
#include <cstdio>
#include <variant>

#include "client/lib/scene_state.h"
#include "client/lib/wire.h"

namespace warmfront::client {
namespace {

/// 64-bit FNV-1a. The number of bytes counts, too.
class Digest {
 public:
  void add(std::string_view bytes) {
    for (std::uint64_t size = bytes.size(), i = 0; i < sizeof size; ++i) mix(size >> (8 * i));
    for (const char byte : bytes) mix(static_cast<unsigned char>(byte));
  }
  std::string hex() const {
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(state_));
    return digits;
  }

 private:
  void mix(std::uint64_t byte) { state_ = (state_ ^ (byte & 0xff)) * 0x100000001b3ULL; }

  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

std::string_view bytes_of(const Positions& positions) {
  return std::visit(
      [](auto values) {
        return std::string_view(reinterpret_cast<const char*>(values.data()), values.size_bytes());
      },
      positions);
}

void add(Digest& digest, const Positions& positions) {
  digest.add(positions.index() == 0 ? "float32" : "float64");
  digest.add(bytes_of(positions));
}

}  // namespace

std::string digest_of(const Positions& positions) {
  Digest digest;
  add(digest, positions);
  return digest.hex();
}

// What a session is made of is what a daemon is sent to make one.
std::string digest_of(const SceneDescription& scene, const Positions& first, const ColliderOptions& options,
                      std::string_view more) {
  constexpr std::size_t kChunk = std::size_t{1} << 20;
  const SceneState state(scene, first);
  v1::SessionHeader header;
  ColliderOptions asked;
  asked.tier = options.tier;
  asked.tolerance = options.tolerance;
  asked.min_separation = options.min_separation;
  asked.report = options.report;
  asked.fields = options.fields;
  *header.mutable_options() = to_proto(asked);
  state.describe(header);
  Digest digest;
  digest.add(header.SerializeAsString());
  digest.add(wire::as_bytes(scene.faces));
  digest.add(wire::as_bytes(scene.edges));
  add(digest, first);
  const auto take = [&digest](const v1::CreateSessionRequest& piece) {
    digest.add(piece.SerializeAsString());
    return true;
  };
  wire::upload_thickness(state.scene().thickness, kChunk, take);
  wire::upload(state.scene().filters, kChunk, take);
  digest.add(more);
  return digest.hex();
}

}  // namespace warmfront::client
