// SPDX-License-Identifier: Apache-2.0
// A map under a lock. Thread safety as stated in the header.
#include "server/session/store.h"

#include <algorithm>
#include <utility>

namespace warmfront::server {

Fault Store::not_found(const SessionId& id) {
  return {ErrorCode::kNotFound, Reason::kSessionNotFound,
          "session " + id.text() +
              " is not here: it expired, was deleted or lived in another daemon; create it again"};
}

Store::Reservation::~Reservation() {
  if (store_ == nullptr) return;
  const MutexLock lock(store_->mutex_);
  store_->sessions_.erase(key_);
}

void Store::Reservation::fill(std::shared_ptr<Session> session) {
  Store* store = std::exchange(store_, nullptr);
  const MutexLock lock(store->mutex_);
  store->sessions_.at(key_) = std::move(session);
}

Outcome<Store::Reservation> Store::reserve(const SessionId& id, const std::string& owner,
                                           std::uint32_t most) {
  Key key{id, owner};
  const MutexLock lock(mutex_);
  if (sessions_.contains(key))
    return Fault{
        ErrorCode::kAlreadyExists, Reason::kSessionExists,
        "session " + id.text() +
            " exists already; choose another id, attach to it (StreamSteps), or delete it where nobody uses "
            "it any more"};
  if (sessions_.size() >= max_sessions_)
    return limit_met("the daemon holds its limit of " + std::to_string(max_sessions_) +
                         " sessions; close one, or raise --max-sessions",
                     "max-sessions", true);
  if (count_locked(owner) >= most)
    return limit_met("principal " + owner + " has its limit of " + std::to_string(most) +
                         " sessions; close one, or raise --max-sessions-per-principal or its quota",
                     "max-sessions-per-principal", true);
  sessions_.emplace(key, nullptr);
  return Reservation(*this, std::move(key));
}

Outcome<std::shared_ptr<Session>> Store::find(const SessionId& id, const std::string& owner) const {
  const Key key{id, owner};
  const MutexLock lock(mutex_);
  const auto found = sessions_.find(key);
  if (found == sessions_.end() || !found->second) return not_found(id);
  return found->second;
}

Outcome<std::shared_ptr<Session>> Store::find_any(const SessionId& id) const {
  const MutexLock lock(mutex_);
  std::shared_ptr<Session> only;
  for (auto at = sessions_.lower_bound(Key{id, {}}); at != sessions_.end() && at->first.id == id; ++at) {
    if (!at->second) continue;
    if (only)
      return Fault{ErrorCode::kFailedPrecondition, Reason::kProtocol,
                   "session " + id.text() + ": principals " + only->owner() + " and " + at->first.owner +
                       " have one of this id; say whose in principal"};
    only = at->second;
  }
  if (!only) return not_found(id);
  return only;
}

std::vector<std::shared_ptr<Session>> Store::list() const {
  const MutexLock lock(mutex_);
  std::vector<std::shared_ptr<Session>> sessions;
  for (const auto& [key, session] : sessions_)
    if (session) sessions.push_back(session);
  return sessions;
}

void Store::forget(const Session& session) {
  std::shared_ptr<Session> doomed;  // released outside the lock
  const MutexLock lock(mutex_);
  // Without memory of its own: what is broken is forgotten in any case.
  const auto found =
      std::ranges::find_if(sessions_, [&](const auto& at) { return at.second.get() == &session; });
  if (found == sessions_.end()) return;
  doomed = std::move(found->second);
  sessions_.erase(found);
}

std::vector<std::shared_ptr<Session>> Store::remove_idle(std::chrono::milliseconds timeout) {
  std::vector<std::shared_ptr<Session>> idle;
  const MutexLock lock(mutex_);
  idle.reserve(sessions_.size());  // so that all that are taken out are told of
  for (auto it = sessions_.begin(); it != sessions_.end();) {
    const bool stays = [&] {
      if (!it->second) return true;
      const SessionSnapshot snapshot = it->second->snapshot();
      return snapshot.attached || snapshot.in_hand || snapshot.idle < timeout;
    }();
    if (stays) {
      ++it;
      continue;
    }
    idle.push_back(std::move(it->second));
    it = sessions_.erase(it);
  }
  return idle;
}

std::size_t Store::count_locked(const std::string& owner) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(sessions_, [&](const auto& at) { return at.first.owner == owner; }));
}

std::size_t Store::count(const std::string& owner) const {
  const MutexLock lock(mutex_);
  return count_locked(owner);
}

std::size_t Store::size() const {
  const MutexLock lock(mutex_);
  return sessions_.size();
}

}  // namespace warmfront::server
