// SPDX-License-Identifier: Apache-2.0
// Charging and refusing. Thread safety as stated in the header.
#include "server/session/account.h"

#include <string>

#include "server/units.h"

namespace warmfront::server {
namespace {

Fault total_exceeded(std::size_t limit) {
  return limit_met("the sessions of this daemon hold all the memory that they may, " + describe_bytes(limit) +
                       "; try again when others have closed, or raise --max-total-bytes",
                   "max-total-bytes", true);
}

}  // namespace

bool Budget::try_take(std::size_t bytes) {
  std::size_t used = used_.load(std::memory_order_relaxed);
  do {
    if (used > limit_ || bytes > limit_ - used) return false;
  } while (!used_.compare_exchange_weak(used, used + bytes, std::memory_order_relaxed));
  return true;
}

Outcome<std::shared_ptr<Account>> Account::open(Budget& budget, std::size_t limit, std::size_t reserved) {
  if (reserved > limit)
    return limit_met("vertex_count, face_count: a session of this size takes about " +
                         describe_bytes(reserved) + ", and one may hold " + describe_bytes(limit) +
                         "; split the scene, or raise --max-session-bytes",
                     "max-session-bytes", false);
  if (!budget.try_take(reserved)) return total_exceeded(budget.limit());
  return std::shared_ptr<Account>(new Account(budget, limit, reserved));
}

Account::~Account() {
  // Holdings keep the account, so nothing but the reservation is left.
  budget_.give(reserved_);
}

void Account::add(std::size_t bytes) {
  // Each change is told its own before and after, so the differences add up whoever comes first.
  const std::size_t before = held_.fetch_add(bytes, std::memory_order_relaxed);
  budget_.take(charge(before + bytes) - charge(before));
}

void Account::remove(std::size_t bytes) {
  const std::size_t before = held_.fetch_sub(bytes, std::memory_order_relaxed);
  budget_.give(charge(before) - charge(before - bytes));
}

std::optional<Fault> Account::refusal() const {
  const std::size_t held = this->held();
  if (held > limit_)
    return limit_met("the session holds " + describe_bytes(held) + " and may hold " + describe_bytes(limit_) +
                         "; take the answers that wait, or create it again with less, or raise "
                         "--max-session-bytes",
                     "max-session-bytes", true);
  if (held > reserved_ && budget_.used() > budget_.limit()) return total_exceeded(budget_.limit());
  return std::nullopt;
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

std::size_t estimate_bytes(std::uint64_t vertices, std::uint64_t triangles, std::size_t bytes_per_number,
                           const Limits& limits) {
  constexpr std::size_t kPerVertex = 300, kPerTriangle = 800, kPerSession = 64 << 10;
  const std::size_t frame = 3 * bytes_per_number * vertices;
  return kPerSession + kPerVertex * vertices + kPerTriangle * triangles + (limits.window + 1) * frame;
}

}  // namespace warmfront::server
