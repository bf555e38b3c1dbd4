// SPDX-License-Identifier: Apache-2.0
// A limit on how many of a kind there are at once: streams, frames in flight. Thread-safe; costs an atomic.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <utility>

namespace warmfront::server {

class Gate {
 public:
  explicit Gate(std::uint32_t limit) : limit_(limit) {}

  /// One that is inside, until it is destroyed. Movable; outlived by the gate.
  class Ticket {
   public:
    explicit Ticket(Gate& gate) : gate_(&gate) {}
    Ticket(Ticket&& other) noexcept : gate_(std::exchange(other.gate_, nullptr)) {}
    Ticket& operator=(Ticket&& other) noexcept {
      std::swap(gate_, other.gate_);  // what this one had leaves with the other
      return *this;
    }
    ~Ticket() {
      if (gate_ != nullptr) gate_->inside_.fetch_sub(1, std::memory_order_relaxed);
    }

   private:
    Gate* gate_;
  };

  /// Nothing when the limit are inside already.
  std::optional<Ticket> enter() {
    if (inside_.fetch_add(1, std::memory_order_relaxed) < limit_) return std::optional<Ticket>(*this);
    inside_.fetch_sub(1, std::memory_order_relaxed);
    return std::nullopt;
  }

  std::uint32_t inside() const { return inside_.load(std::memory_order_relaxed); }
  std::uint32_t limit() const { return limit_; }

 private:
  const std::uint32_t limit_;
  std::atomic<std::uint32_t> inside_{0};
};

}  // namespace warmfront::server
