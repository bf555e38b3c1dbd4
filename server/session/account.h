// SPDX-License-Identifier: Apache-2.0
// Who holds how much memory: a budget for the daemon, an account for each session in it, and holdings, which
// are charged for as long as they live. Thread-safe, a holding apart, which is used by one thread at a time.
// Charging costs atomics only.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "engine/pair_filters.h"
#include "server/fault.h"
#include "server/session/limits.h"

namespace warmfront::server {

/// Bytes that all sessions of a daemon, or of a principal, are charged, and their limit.
class Budget {
 public:
  /// `setting` is what the limit is called.
  explicit Budget(std::size_t limit, const char* setting = "max-total-bytes")
      : limit_(limit), setting_(setting) {}

  /// False, and nothing is taken, when that would exceed the limit.
  [[nodiscard]] bool try_take(std::size_t bytes);
  void take(std::size_t bytes) { used_.fetch_add(bytes, std::memory_order_relaxed); }
  void give(std::size_t bytes) { used_.fetch_sub(bytes, std::memory_order_relaxed); }

  std::size_t used() const { return used_.load(std::memory_order_relaxed); }
  std::size_t limit() const { return limit_.load(std::memory_order_relaxed); }
  /// What is held already stays.
  void set_limit(std::size_t limit) { limit_.store(limit, std::memory_order_relaxed); }
  /// What who meets the limit is told, of `bytes` that would be held: by what would never fit, that.
  Fault exceeded(std::size_t bytes) const;

 private:
  std::atomic<std::size_t> limit_;
  const char* const setting_;
  std::atomic<std::size_t> used_{0};
};

/// What one session holds. The budgets are charged what was reserved when the session was made, or what the
/// session holds when that is more: a session that stays within its reservation never suffers from how others
/// grow.
class Account {
 public:
  /// RESOURCE_EXHAUSTED when `reserved` is above the session's limit or does not fit into a budget any more:
  /// the daemon's, which outlives the account, or that of its principal, if there is one.
  static Outcome<std::shared_ptr<Account>> open(Budget& budget, std::size_t limit, std::size_t reserved,
                                                std::shared_ptr<Budget> of_principal = nullptr);
  ~Account();
  Account(const Account&) = delete;
  Account& operator=(const Account&) = delete;

  void add(std::size_t bytes);
  void remove(std::size_t bytes);
  std::size_t held() const { return held_.load(std::memory_order_relaxed); }

  /// Why the session may not do what makes it grow, by `more` bytes where that is known: it would hold more
  /// than its limit, or more than it reserved while its principal or the daemon is beyond theirs.
  std::optional<Fault> refusal(std::size_t more = 0) const;
  /// Whether it would refuse with so many bytes more.
  bool over(std::size_t more = 0) const;

 private:
  Account(Budget& budget, std::shared_ptr<Budget> of_principal, std::size_t limit, std::size_t reserved)
      : budget_(budget), of_principal_(std::move(of_principal)), limit_(limit), reserved_(reserved) {}
  /// The budget that cannot bear so much more than is held; null when all can.
  const Budget* exceeded_by(std::size_t held, std::size_t more) const;
  std::size_t charge(std::size_t held) const { return held > reserved_ ? held : reserved_; }

  // Constant after construction.
  Budget& budget_;
  const std::shared_ptr<Budget> of_principal_;  // null: none
  const std::size_t limit_;
  const std::size_t reserved_;

  std::atomic<std::size_t> held_{0};
};

/// Bytes on an account until it is destroyed. An empty one holds nothing.
class Holding {
 public:
  Holding() = default;
  explicit Holding(std::shared_ptr<Account> account, std::size_t bytes = 0);
  Holding(Holding&& other) noexcept
      : account_(std::move(other.account_)), bytes_(std::exchange(other.bytes_, 0)) {}
  Holding& operator=(Holding&& other) noexcept;
  ~Holding() { set(0); }

  void set(std::size_t bytes);
  std::size_t bytes() const { return bytes_; }
  /// Null for one that charges nobody.
  const Account* account() const { return account_.get(); }

 private:
  std::shared_ptr<Account> account_;
  std::size_t bytes_ = 0;
};

/// How large filters are; of none by default.
struct FilterSize {
  std::uint32_t within_edges = 0;
  bool near_at_rest = false;
  std::uint64_t excluded_vertex_pairs = 0;
  bool patches = false;

  static FilterSize of(const PairFilters& filters) {
    return {filters.within_edges, filters.near_at_rest > 0, filters.excluded_vertex_pairs.size(),
            !filters.patches.empty()};
  }
};

/// A half-space, which has none, takes about as much as so many vertices do.
inline constexpr std::uint64_t kVerticesPerHalfSpace = 8;

/// What filters of a scene of so many vertices take on top of estimate_bytes(), while they are uploaded or
/// made.
std::size_t estimate_filter_bytes(const FilterSize& filters, std::uint64_t vertices, bool explain);

/// What a session is going to hold, measured on the built-in and recorded scenes and rounded up: scene,
/// hierarchy, a usual front, the upload, and a window of frames that wait. With `explain` a second collider
/// runs beside the first. `thick`: vertices have thickness.
std::size_t estimate_bytes(std::uint64_t vertices, std::uint64_t triangles, std::size_t bytes_per_number,
                           bool explain, bool thick, const Limits& limits);

}  // namespace warmfront::server
