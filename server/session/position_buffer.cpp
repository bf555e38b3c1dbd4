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
  if (dtype == Dtype::kFloat64) values_.emplace<std::vector<double>>();
}

std::string PositionBuffer::shape() const {
  const std::size_t size = values_.index() == 0 ? 4 : 8;
  return std::to_string(expected_) + " bytes are expected (" + std::to_string(expected_ / (3 * size)) +
         " vertices x 3 x float" + std::to_string(8 * size) + ")";
}

Status PositionBuffer::append(std::string_view bytes) {
  if (!overflow_ && bytes.size() > expected_ - received_)
    overflow_ = invalid_argument("positions: at least " + std::to_string(received_ + bytes.size()) +
                                 " bytes, but " + shape());
  if (overflow_) return *overflow_;
  if (bytes.empty()) return {};
  std::visit(
      [&](auto& values) {
        constexpr std::size_t kSize = sizeof(values[0]);
        const std::size_t end = received_ + bytes.size();
        values.resize((end + kSize - 1) / kSize);
        std::memcpy(reinterpret_cast<char*>(values.data()) + received_, bytes.data(), bytes.size());
      },
      values_);
  received_ += bytes.size();
  return {};
}

Status PositionBuffer::complete() const {
  if (overflow_) return *overflow_;
  if (received_ == expected_) return {};
  return invalid_argument("positions: " + std::to_string(received_) + " bytes, but " + shape());
}

Positions PositionBuffer::view() const {
  if (const auto* floats = std::get_if<std::vector<float>>(&values_)) return std::span<const float>(*floats);
  return std::span<const double>(std::get<std::vector<double>>(values_));
}

bool operator==(const PositionBuffer& a, const PositionBuffer& b) {
  if (a.overflow_ || b.overflow_) return false;  // there was more than is kept
  if (a.received_ != b.received_ || a.values_.index() != b.values_.index()) return false;
  return std::visit(
      [&](const auto& values) {
        const auto& others = std::get<std::decay_t<decltype(values)>>(b.values_);
        return values.size() == others.size() &&
               (values.empty() ||
                std::memcmp(values.data(), others.data(), values.size() * sizeof(values[0])) == 0);
      },
      a.values_);
}

}  // namespace warmfront::server
