// SPDX-License-Identifier: Apache-2.0
// A session in this process, for Python: releases the interpreter's lock while it computes, and looks for
// signals meanwhile. Used by one thread at a time, but for stop().
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "client/lib/local_session.h"
#include "client/python/native/answer.h"
#include "engine/frame.h"
#include "engine/question.h"

namespace warmfront::python {

/// A question that was submitted and not yet answered.
struct Submitted {
  std::shared_ptr<client::PendingAnswer> pending;
  std::optional<Question> question;  ///< none of a commit
  std::size_t frame_bytes = 0;
};

class Session {
 public:
  /// header: a v1.SessionHeader; arrays as the wire has them, of filters in a v1.PairFilters, or None.
  /// threads: 0 for those of the process. Throws Raised as a daemon refuses.
  static std::shared_ptr<Session> create(const pybind11::handle& header, const pybind11::buffer& positions,
                                         const pybind11::buffer& faces, const pybind11::buffer& edges,
                                         const pybind11::object& thickness, const pybind11::object& filters,
                                         int threads);

  Session(Collider collider, Rounding rounding, std::uint64_t first_frame)
      : local_(std::make_shared<client::LocalSession>(std::move(collider), rounding, first_frame)),
        float32_(rounding == Rounding::kFloat32) {}

  /// Waits. timeout: seconds, or none.
  std::shared_ptr<Answer> ask(const Question& question, const pybind11::object& positions,
                              const pybind11::object& parts, std::optional<double> timeout);
  std::shared_ptr<Answer> commit(double fraction, std::optional<double> timeout);
  /// Without waiting, on a thread of its own; the frame is copied.
  std::shared_ptr<Submitted> submit(const Question& question, const pybind11::object& positions,
                                    const pybind11::object& parts);
  std::shared_ptr<Submitted> submit_commit(double fraction);
  std::shared_ptr<Answer> take(Submitted& submitted);

  /// changes: v1.SceneChanges, all of which are carried out or none, and with them options, or None.
  void change(const pybind11::iterable& changes, const pybind11::handle& options);
  /// options: a v1.ColliderOptions.
  void change_options(const pybind11::handle& options);
  /// Any thread: what is computed ends, and nothing is from then on.
  void stop() { stopped_.store(true, std::memory_order_relaxed); }

  std::uint64_t frame() const { return local_->frame(); }
  /// Lists of changes, or of options, that were carried out: also where a signal raised right after one.
  std::uint64_t changes() const { return changes_; }
  /// (n, 3) of the session's type, a copy.
  pybind11::array positions() const;
  const Scene& scene() const { return local_->collider().scene(); }
  const ColliderOptions& options() const { return local_->collider().options(); }
  std::size_t memory_bytes() const { return local_->collider().memory_bytes(); }

 private:
  using Clock = std::chrono::steady_clock;

  std::shared_ptr<Answer> wait(client::LocalSession::Request request, std::optional<double> timeout,
                               std::size_t frame_bytes);
  std::shared_ptr<Answer> made(client::Answer answer, const std::optional<Question>& question,
                               std::size_t frame_bytes) const;

  std::shared_ptr<client::LocalSession> local_;
  const bool float32_;
  std::uint64_t changes_ = 0;
  std::atomic<bool> stopped_{false};  // any thread
  // How long the answers of the last few took, each but once: about as long as that of one asked alike.
  struct Asked {
    Question question;
    Clock::duration took = Clock::duration::max();
  };
  Asked& asked_alike(const Question& question);

  std::array<Asked, 8> asked_{};
  std::size_t oldest_asked_ = 0;
};

}  // namespace warmfront::python
