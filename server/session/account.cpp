// SPDX-License-Identifier: Apache-2.0
// Charging and refusing. Thread safety as stated in the header.
#include "server/session/account.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "server/units.h"

namespace warmfront::server {

Fault Budget::exceeded(std::size_t bytes) const {
  const bool daemon = std::string_view(setting_) == "max-total-bytes";
  const std::string raise =
      std::string("raise --") + setting_ + (daemon ? "" : ", or have the principal's quota raised");
  const std::string whose = daemon ? "the sessions of this daemon" : "this principal's sessions";
  if (bytes > limit())
    return limit_met("the session would hold some " + describe_bytes(bytes) + ", and all " + whose +
                         " together may hold " + describe_bytes(limit()) + "; split the scene, or " + raise,
                     setting_, false);
  return limit_met(whose + " hold all the memory that they may, " + describe_bytes(limit()) +
                       "; try again when others have closed, or " + raise,
                   setting_, true);
}

bool Budget::try_take(std::size_t bytes) {
  std::size_t used = used_.load(std::memory_order_relaxed);
  do {
    const std::size_t limit = this->limit();
    if (used > limit || bytes > limit - used) return false;
  } while (!used_.compare_exchange_weak(used, used + bytes, std::memory_order_relaxed));
  return true;
}

Outcome<std::shared_ptr<Account>> Account::open(Budget& budget, std::size_t limit, std::size_t reserved,
                                                std::shared_ptr<Budget> of_principal) {
  if (reserved > limit)
    // Where a session may hold as much as all together, a higher --max-session-bytes alone is lowered again.
    return limit_met("vertex_count, face_count, filters: a session of this size takes about " +
                         describe_bytes(reserved) + ", and one may hold " + describe_bytes(limit) +
                         "; split the scene, or raise " +
                         (limit < budget.limit() ? "" : "--max-total-bytes, which is met as well, and ") +
                         "--max-session-bytes",
                     "max-session-bytes", false);
  if (!budget.try_take(reserved)) return budget.exceeded(reserved);
  if (of_principal && !of_principal->try_take(reserved)) {
    budget.give(reserved);
    return of_principal->exceeded(reserved);
  }
  std::unique_ptr<Account> account;
  try {
    account.reset(new Account(budget, of_principal, limit, reserved));
  } catch (...) {
    if (of_principal) of_principal->give(reserved);
    budget.give(reserved);
    throw;
  }
  return std::shared_ptr<Account>(std::move(account));  // gives it back itself from here on
}

Account::~Account() {
  // Holdings keep the account, so nothing but the reservation is left.
  budget_.give(reserved_);
  if (of_principal_) of_principal_->give(reserved_);
}

void Account::add(std::size_t bytes) {
  // Each change is told its own before and after, so the differences add up whoever comes first.
  const std::size_t before = held_.fetch_add(bytes, std::memory_order_relaxed);
  const std::size_t more = charge(before + bytes) - charge(before);
  budget_.take(more);
  if (of_principal_) of_principal_->take(more);
}

void Account::remove(std::size_t bytes) {
  const std::size_t before = held_.fetch_sub(bytes, std::memory_order_relaxed);
  const std::size_t less = charge(before) - charge(before - bytes);
  budget_.give(less);
  if (of_principal_) of_principal_->give(less);
}

std::optional<Fault> Account::refusal(std::size_t more) const {
  const std::size_t held = this->held();
  if (held > limit_)
    return limit_met("the session holds " + describe_bytes(held) + " and may hold " + describe_bytes(limit_) +
                         "; take the answers that wait, or create it again with less, or raise "
                         "--max-session-bytes",
                     "max-session-bytes", true);
  if (more > limit_ - held)
    return limit_met("the session holds " + describe_bytes(held) + ", would hold some " +
                         describe_bytes(more) + " more, and may hold " + describe_bytes(limit_) +
                         "; create it again with less, or raise --max-session-bytes",
                     "max-session-bytes", false);
  if (const Budget* budget = exceeded_by(held, more)) return budget->exceeded(charge(held + more));
  return std::nullopt;
}

bool Account::over(std::size_t more) const {
  const std::size_t held = this->held();
  return held > limit_ || more > limit_ - held || exceeded_by(held, more) != nullptr;
}

const Budget* Account::exceeded_by(std::size_t held, std::size_t more) const {
  if (held + more <= reserved_) return nullptr;
  const std::size_t extra = charge(held + more) - charge(held);
  const auto exceeds = [extra](const Budget& budget) { return budget.used() + extra > budget.limit(); };
  if (exceeds(budget_)) return &budget_;
  return of_principal_ && exceeds(*of_principal_) ? of_principal_.get() : nullptr;
}

Holding::Holding(std::shared_ptr<Account> account, std::size_t bytes) : account_(std::move(account)) {
  set(bytes);
}

Holding& Holding::operator=(Holding&& other) noexcept {
  if (this == &other) return *this;
  set(0);
  account_ = std::move(other.account_);
  bytes_ = std::exchange(other.bytes_, 0);
  return *this;
}

void Holding::set(std::size_t bytes) {
  if (!account_) return;
  if (bytes > bytes_) account_->add(bytes - bytes_);
  if (bytes < bytes_) account_->remove(bytes_ - bytes);
  bytes_ = bytes;
}

// The scene keeps what was given, a collider the same in its own numbers, and of edges and pairs which
// vertices each vertex is excluded with: on regular meshes 6, 18 and 36 within one, two and three edges.
// Vectors that grow have room for twice what is in them.
std::size_t estimate_filter_bytes(const FilterSize& filters, std::uint64_t vertices, bool explain) {
  constexpr std::size_t kPerVertexAtRest = 72, kPerVertexOfPatches = 12, kPerVertexOfPairs = 32,
                        kPerPair = 40;
  constexpr std::array<std::size_t, PairFilters::kMostEdges + 1> kPerVertexWithin{0, 100, 200, 400};
  std::size_t per_vertex = kPerVertexWithin[std::min(filters.within_edges, PairFilters::kMostEdges)];
  if (filters.near_at_rest) per_vertex += kPerVertexAtRest;
  if (filters.patches) per_vertex += kPerVertexOfPatches;
  if (filters.excluded_vertex_pairs > 0) per_vertex += kPerVertexOfPairs;
  return (explain ? 2 : 1) * (per_vertex * vertices + kPerPair * filters.excluded_vertex_pairs);
}

std::size_t estimate_bytes(std::uint64_t vertices, std::uint64_t triangles, std::size_t bytes_per_number,
                           bool explain, bool thick, const Limits& limits) {
  constexpr std::size_t kPerVertex = 300, kPerThickVertex = 40, kPerTriangle = 800, kPerSession = 64 << 10;
  const std::size_t frame = 3 * bytes_per_number * vertices;
  const std::size_t per_vertex = kPerVertex + (thick ? kPerThickVertex : 0);
  const std::size_t collider = per_vertex * vertices + kPerTriangle * triangles;
  return kPerSession + (explain ? 2 : 1) * collider + (limits.window + 1) * frame;
}

}  // namespace warmfront::server
