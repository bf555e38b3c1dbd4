// SPDX-License-Identifier: Apache-2.0
// A limit on how many of a kind there are at once: streams, frames in flight. Thread-safe; costs an atomic.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

namespace warmfront::server {

class Gate {
 public:
  /// Who is inside this one is inside the outer one, too, which outlives it.
  explicit Gate(std::uint32_t limit, Gate* outer = nullptr) : limit_(limit), outer_(outer) {}

  /// One that is inside, until it is destroyed. Movable; outlived by the gate, which `owner` sees to.
  class Ticket {
   public:
    explicit Ticket(Gate& gate, std::shared_ptr<const void> owner = nullptr)
        : gate_(&gate), owner_(std::move(owner)) {}
    Ticket(Ticket&& other) noexcept
        : gate_(std::exchange(other.gate_, nullptr)), owner_(std::move(other.owner_)) {}
    Ticket& operator=(Ticket&& other) noexcept {
      std::swap(gate_, other.gate_);  // what this one had leaves with the other
      owner_.swap(other.owner_);
      return *this;
    }
    ~Ticket() {
      for (Gate* gate = gate_; gate != nullptr; gate = gate->outer_)
        gate->inside_.fetch_sub(1, std::memory_order_relaxed);
    }

   private:
    Gate* gate_;
    std::shared_ptr<const void> owner_;
  };

  /// Nothing when the limit, of this or of an outer one, are inside already. The ticket keeps `owner`, for a
  /// gate that is part of something that may go first.
  std::optional<Ticket> enter(std::shared_ptr<const void> owner = nullptr) {
    if (!try_enter()) return std::nullopt;
    return std::make_optional<Ticket>(*this, std::move(owner));
  }

  std::uint32_t inside() const { return inside_.load(std::memory_order_relaxed); }
  std::uint32_t limit() const { return limit_.load(std::memory_order_relaxed); }
  bool full() const { return inside() >= limit(); }
  /// Who is inside stays.
  void set_limit(std::uint32_t limit) { limit_.store(limit, std::memory_order_relaxed); }

 private:
  bool try_enter() {
    if (inside_.fetch_add(1, std::memory_order_relaxed) < limit() &&
        (outer_ == nullptr || outer_->try_enter()))
      return true;
    inside_.fetch_sub(1, std::memory_order_relaxed);
    return false;
  }

  std::atomic<std::uint32_t> limit_;
  Gate* const outer_;
  std::atomic<std::uint32_t> inside_{0};
};

}  // namespace warmfront::server
