// SPDX-License-Identifier: Apache-2.0
// The sessions of the daemon, by id. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/annotations.h"
#include "server/fault.h"
#include "server/session/id.h"
#include "server/session/session.h"

namespace warmfront::server {

/// Each owner has ids of its own: what others have chosen is nothing that it could find out.
class Store {
 public:
  /// A session's name in the daemon.
  struct Key {
    SessionId id;
    std::string owner;
    friend auto operator<=>(const Key&, const Key&) = default;
  };

  explicit Store(std::uint32_t max_sessions) : max_sessions_(max_sessions) {}

  /// A place in the store, held while a session is uploaded and built; given back unless it is filled.
  /// Movable; outlived by the store.
  class Reservation {
   public:
    Reservation(Store& store, Key key) : store_(&store), key_(std::move(key)) {}
    Reservation(Reservation&& other) noexcept
        : store_(std::exchange(other.store_, nullptr)), key_(std::move(other.key_)) {}
    Reservation& operator=(Reservation&&) = delete;
    ~Reservation();

    /// Puts the session into its place.
    void fill(std::shared_ptr<Session> session);

   private:
    Store* store_;
    Key key_;
  };

  /// ALREADY_EXISTS for an id that its owner uses already, RESOURCE_EXHAUSTED when the store is full or its
  /// owner has `most` of them.
  Outcome<Reservation> reserve(const SessionId& id, const std::string& owner = {},
                               std::uint32_t most = std::numeric_limits<std::uint32_t>::max());

  /// NOT_FOUND for an id unknown, or still being built, or of a session that belongs to another.
  Outcome<std::shared_ptr<Session>> find(const SessionId& id, const std::string& owner = {}) const;
  /// Of any owner; FAILED_PRECONDITION when several have this id.
  Outcome<std::shared_ptr<Session>> find_any(const SessionId& id) const;
  /// In the order of their ids, whoever owns them.
  std::vector<std::shared_ptr<Session>> list() const;
  /// Takes this very session out, not one that has its id by now.
  void forget(const Session& session);
  /// Takes out every session without a stream or a request in hand, and idle for at least `timeout`.
  std::vector<std::shared_ptr<Session>> remove_idle(std::chrono::milliseconds timeout);

  /// Sessions open, those being built included.
  std::size_t size() const;
  /// The same, of one owner.
  std::size_t count(const std::string& owner) const;

 private:
  static Fault not_found(const SessionId& id);
  std::size_t count_locked(const std::string& owner) const WARMFRONT_REQUIRES(mutex_);

  // Constant after construction.
  const std::uint32_t max_sessions_;

  // Protected by mutex_.
  mutable Mutex mutex_;
  std::map<Key, std::shared_ptr<Session>> sessions_ WARMFRONT_GUARDED_BY(mutex_);  // null: reserved
};

}  // namespace warmfront::server
