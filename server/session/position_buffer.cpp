// SPDX-License-Identifier: Apache-2.0
// Positions from bytes. Thread safety as stated in the header.
#include "server/session/position_buffer.h"

#include <bit>
#include <cstring>
#include <type_traits>

namespace warmfront::server {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian and bytes are copied as they are");

PositionBuffer::PositionBuffer(Dtype dtype, std::uint32_t vertex_count)
    : expected_(std::size_t{3} * vertex_count * size_of(dtype)) {
  if (dtype == Dtype::kFloat64) memory_.values_.emplace<Numbers<double>>();
}

std::string PositionBuffer::shape() const {
  const std::size_t size = memory_.values_.index() == 0 ? 4 : 8;
  return std::to_string(expected_) + " bytes are expected (" + std::to_string(expected_ / (3 * size)) +
         " vertices x 3 x float" + std::to_string(8 * size) + ")";
}

void PositionBuffer::reuse(PositionMemory memory) noexcept {
  const std::size_t bytes = memory.bytes();
  if (received_ > 0 || memory.values_.index() != memory_.values_.index() || bytes < expected_ ||
      bytes - expected_ > expected_ / 4)
    return;
  memory_ = std::move(memory);
  std::visit([](auto& values) { values.clear(); }, memory_.values_);
}

Status PositionBuffer::append(std::span<const std::string_view> pieces) {
  std::size_t size = 0;
  for (const std::string_view piece : pieces) size += piece.size();
  if (!overflow_ && size > expected_ - received_)
    overflow_ = invalid_argument("positions: at least " + std::to_string(received_ + size) + " bytes, but " +
                                 shape());
  if (overflow_) return *overflow_;
  if (size == 0) return {};
  std::visit(
      [&](auto& values) {
        constexpr std::size_t kSize = sizeof(values[0]);
        values.resize((received_ + size + kSize - 1) / kSize);
        char* to = reinterpret_cast<char*>(values.data()) + received_;
        for (const std::string_view piece : pieces) {
          hash_.copy(piece, to);
          to += piece.size();
        }
      },
      memory_.values_);
  received_ += size;
  return {};
}

Status PositionBuffer::complete() const {
  if (overflow_) return *overflow_;
  if (received_ == expected_) return {};
  return invalid_argument("positions: " + std::to_string(received_) + " bytes, but " + shape());
}

Positions PositionBuffer::view() const {
  if (const auto* floats = std::get_if<Numbers<float>>(&memory_.values_))
    return std::span<const float>(*floats);
  return std::span<const double>(std::get<Numbers<double>>(memory_.values_));
}

std::string_view PositionBuffer::bytes() const {
  return std::visit(
      [&](const auto& values) {
        return std::string_view(reinterpret_cast<const char*>(values.data()), received_);
      },
      memory_.values_);
}

bool operator==(const PositionBuffer& a, const PositionBuffer& b) {
  if (a.overflow_ || b.overflow_) return false;  // there was more than is kept
  if (a.received_ != b.received_ || a.memory_.values_.index() != b.memory_.values_.index()) return false;
  return std::visit(
      [&](const auto& values) {
        const auto& others = std::get<std::decay_t<decltype(values)>>(b.memory_.values_);
        return a.received_ == 0 || std::memcmp(values.data(), others.data(), a.received_) == 0;
      },
      a.memory_.values_);
}

}  // namespace warmfront::server
