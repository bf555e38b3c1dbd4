// SPDX-License-Identifier: Apache-2.0
// The sessions of the daemon, by id. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "server/annotations.h"
#include "server/session/fault.h"
#include "server/session/id.h"
#include "server/session/session.h"

namespace warmfront::server {

class Store {
 public:
  explicit Store(std::uint32_t max_sessions) : Store(max_sessions, max_sessions) {}
  Store(std::uint32_t max_sessions, std::uint32_t max_sessions_per_owner)
      : max_sessions_(max_sessions), max_sessions_per_owner_(max_sessions_per_owner) {}

  /// A place in the store, held while a session is uploaded and built; given back unless it is filled.
  /// Movable; outlived by the store.
  class Reservation {
   public:
    Reservation(Store& store, SessionId id) : store_(&store), id_(std::move(id)) {}
    Reservation(Reservation&& other) noexcept
        : store_(std::exchange(other.store_, nullptr)), id_(std::move(other.id_)) {}
    Reservation& operator=(Reservation&&) = delete;
    ~Reservation();

    /// Puts the session into its place.
    void fill(std::shared_ptr<Session> session);

   private:
    Store* store_;
    SessionId id_;
  };

  /// ALREADY_EXISTS for an id in use, RESOURCE_EXHAUSTED when the store is full or its owner has too many.
  Outcome<Reservation> reserve(const SessionId& id, const std::string& owner = {});

  /// NOT_FOUND for an id unknown, or still being built, or of a session that belongs to another.
  Outcome<std::shared_ptr<Session>> find(const SessionId& id, const std::string& owner = {}) const;
  /// The same, whoever owns it.
  Outcome<std::shared_ptr<Session>> find_any(const SessionId& id) const;
  /// In the order of their ids, whoever owns them.
  std::vector<std::shared_ptr<Session>> list() const;
  /// Takes a session out; null when there is none.
  std::shared_ptr<Session> remove(const SessionId& id);
  /// Takes this very session out, not one that has its id by now.
  void forget(const Session& session);
  /// Takes out every session without a stream or a request in hand, and idle for at least `timeout`.
  std::vector<std::shared_ptr<Session>> remove_idle(std::chrono::milliseconds timeout);

  /// Sessions open, those being built included.
  std::size_t size() const;

 private:
  struct Place {
    std::string owner;
    std::shared_ptr<Session> session;  ///< null: reserved
  };
  static Fault not_found(const SessionId& id);

  // Constant after construction.
  const std::uint32_t max_sessions_;
  const std::uint32_t max_sessions_per_owner_;

  // Protected by mutex_.
  mutable Mutex mutex_;
  std::map<SessionId, Place> sessions_ WARMFRONT_GUARDED_BY(mutex_);
};

}  // namespace warmfront::server
