// SPDX-License-Identifier: Apache-2.0
// Thread safety as stated in the header.
#include "client/python/native/session.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "client/python/native/errors.h"
#include "client/python/native/given_frame.h"
#include "client/python/native/interruptible.h"
#include "client/python/native/reading.h"

namespace warmfront::python {
namespace py = pybind11;
namespace {

using client::LocalSession;
using client::PendingAnswer;

// Who waits longer wants to be able to interrupt: what took so long when it was last asked, or was not
// among the last few questions, is computed on another thread, while this one looks for signals. That thread
// begins with cold caches and memory of its own, which steps of some milliseconds would feel.
constexpr std::chrono::milliseconds kLong{100};

// Names of limits, as a daemon has them.
constexpr const char* kMaxContacts = "max-contacts";
constexpr const char* kAdjacentFaces = "adjacent-faces";

std::shared_ptr<Workers> workers_of(int threads) {
  // All sessions share those of the process: a program with many has no more threads than cores.
  static const auto* shared = new std::shared_ptr<Workers>(std::make_shared<Workers>(0));
  return threads == 0 ? *shared : std::make_shared<Workers>(threads);
}

Clock::time_point after(std::optional<double> seconds) {
  constexpr double kMost = 1e9;
  if (!seconds || *seconds > kMost) return Clock::time_point::max();
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*seconds));
}

}  // namespace

std::shared_ptr<Session> Session::create(const py::handle& header, const py::buffer& positions,
                                         const py::buffer& faces, const py::buffer& edges,
                                         const py::object& thickness, const py::object& filters,
                                         int threads) {
  SceneDescription scene;
  const ColliderOptions options = options_of(header.attr("options"));
  if (Status valid = validate(options); !valid)
    throw raised({valid.error().code, "options: " + valid.error().message});
  scene.vertex_count = header.attr("vertex_count").cast<std::uint32_t>();
  std::size_t index = 0;
  for (const py::handle body : header.attr("bodies"))
    scene.bodies.push_back(body_of(body, "bodies[" + std::to_string(index++) + "]"));
  scene.excluded_pairs = body_pairs_of(header.attr("excluded_pairs"));
  if (!filters.is_none()) {
    scene.filters = filters_of(filters);
    check(scene.filters.check_numbers());
  }
  scene.faces = rows_of<std::array<std::int32_t, 3>>(faces);
  scene.edges = rows_of<std::array<std::int32_t, 2>>(edges);
  if (!thickness.is_none()) scene.thickness = rows_of<double>(thickness.cast<py::buffer>());
  const auto first_frame = header.attr("first_frame").cast<std::uint64_t>();
  const py::buffer_info given = positions.request();
  const Positions rows = python::positions_of(given);
  const Rounding rounding =
      std::holds_alternative<std::span<const float>>(rows) ? Rounding::kFloat32 : Rounding::kFloat64;

  std::optional<Result<Collider>> made;
  run(
      [&](const std::atomic<bool>& stop) {
        Result<Scene> checked = Scene::create(std::move(scene), StopSignal(&stop));
        if (!checked) {
          made.emplace(checked.error());
          return;
        }
        made.emplace(Collider::create(std::make_shared<const Scene>(std::move(checked).value()), rows,
                                      options, workers_of(threads), &stop));
      },
      Clock::time_point::max(), nullptr);
  return std::make_shared<Session>(value_of(*std::move(made), kAdjacentFaces), rounding, first_frame);
}

std::shared_ptr<Answer> Session::made(client::Answer answer, const std::optional<Question>& question,
                                      std::size_t frame_bytes) const {
  auto result = std::make_shared<Answer>();
  static_cast<client::Answer&>(*result) = std::move(answer);
  if (!question) return result;
  result->fields = merged(options(), *question).fields;
  result->reduced = question->options.reduced;
  result->edge_faces = question->kind == QuestionKind::kIntersections;
  if (result->all_deformable) {
    result->frame_bytes = frame_bytes;
    result->positions_bytes = std::size_t{3} * scene().vertex_count() * (float32_ ? 4 : 8);
  }
  return result;
}

Session::Asked& Session::asked_alike(const Question& question) {
  const auto known = std::ranges::find(asked_, question, &Asked::question);
  if (known != asked_.end()) return *known;
  Asked& other = asked_.at(oldest_asked_);
  oldest_asked_ = (oldest_asked_ + 1) % asked_.size();
  return other = {question, Clock::duration::max()};
}

std::shared_ptr<Answer> Session::wait(LocalSession::Request request, std::optional<double> timeout,
                                      std::size_t frame_bytes) {
  const std::shared_ptr<LocalSession> local = local_;
  const Clock::time_point begin = Clock::now();
  std::optional<Result<client::Answer>> answer;
  const bool is_brief = request.commit || asked_alike(request.question).took <= kLong;
  if (timeout || !is_brief) {
    const Ended ended = run(
        [&](const std::atomic<bool>& stop) {
          // Who is given up after the last look at `stop` does not count either.
          if (request.counts())
            request.accept = [&](const StepResult&) -> Status {
              if (stop.load(std::memory_order_relaxed)) return PendingAnswer::cancelled();
              return {};
            };
          answer = local->ask(request, {.cancelled = &stop}, false)->take();
        },
        after(timeout), &stopped_);
    if (ended == Ended::kTimeUp && !*answer)
      throw raised({ErrorCode::kDeadlineExceeded, "no answer within the time limit"});
  } else {
    bool raised_by_signal = false;
    if (request.counts())
      request.accept = [&](const StepResult&) -> Status {
        if (!interrupted()) return {};
        raised_by_signal = true;
        return PendingAnswer::cancelled();
      };
    {
      const py::gil_scoped_release unlocked;
      answer = local->ask(request, {.cancelled = &stopped_}, false)->take();
    }
    if (raised_by_signal) throw py::error_already_set();
  }
  if (!request.commit) asked_alike(request.question).took = Clock::now() - begin;
  return made(value_of(*std::move(answer), kMaxContacts),
              request.commit ? std::nullopt : std::optional(request.question), frame_bytes);
}

std::shared_ptr<Answer> Session::ask(const Question& question, const py::object& positions,
                                     const py::object& parts, std::optional<double> timeout) {
  const GivenFrame given(positions, parts, float32_, scene());
  return wait({given.frame(), question}, timeout, given.bytes());
}

std::shared_ptr<Answer> Session::commit(double fraction, std::optional<double> timeout) {
  return wait({.commit = fraction}, timeout, 0);
}

std::shared_ptr<Submitted> Session::submit(const Question& question, const py::object& positions,
                                           const py::object& parts) {
  const GivenFrame given(positions, parts, float32_, scene());
  return std::make_shared<Submitted>(Submitted{
      local_->ask({given.frame(), question}, {.cancelled = &stopped_}, true), question, given.bytes()});
}

std::shared_ptr<Submitted> Session::submit_commit(double fraction) {
  return std::make_shared<Submitted>(
      Submitted{local_->ask({.commit = fraction}, {.cancelled = &stopped_}, true), std::nullopt, 0});
}

std::shared_ptr<Answer> Session::take(Submitted& submitted) {
  const std::shared_ptr<LocalSession> local = local_;
  std::optional<Result<client::Answer>> answer;
  bool raised_by_signal = false;
  {
    const py::gil_scoped_release unlocked;
    while (!submitted.pending->wait_until(Clock::now() + kLook) && !raised_by_signal)
      raised_by_signal = interrupted();
    if (!raised_by_signal) answer = submitted.pending->take();
  }
  if (raised_by_signal) throw py::error_already_set();  // it may be taken again
  return made(value_of(*std::move(answer), kMaxContacts), submitted.question, submitted.frame_bytes);
}

namespace {

ColliderOptions read_options(const py::handle& options) {
  ColliderOptions read = options_of(options);
  if (Status valid = validate(read); !valid)
    throw raised({valid.error().code, "options: " + valid.error().message});
  return read;
}

}  // namespace

void Session::change(const py::iterable& given, const py::handle& options) {
  std::vector<SceneChange> changes;
  for (const py::handle& change : given) changes.push_back(change_of(change, float32_));
  std::optional<ColliderOptions> read;
  if (!options.is_none()) read = read_options(options);
  const std::size_t count = changes.size();
  std::size_t failed = 0;
  Status status;
  run(
      [&](const std::atomic<bool>& stop) {
        status = local_->collider().change(std::move(changes), &stop, &failed, read);
        if (status) ++changes_;
      },
      Clock::time_point::max(), &stopped_);
  if (status) return;
  const std::string where = failed < count ? "changes[" + std::to_string(failed) + "]: " : "options.";
  throw raised({status.error().code, where + status.error().message}, kAdjacentFaces);
}

void Session::change_options(const py::handle& options) {
  const ColliderOptions read = read_options(options);
  Status status;
  // As a list of no changes, which is refused as a daemon refuses it.
  run(
      [&](const std::atomic<bool>& stop) {
        status = local_->collider().change({}, &stop, nullptr, read);
        if (status) ++changes_;
      },
      Clock::time_point::max(), &stopped_);
  if (!status) throw raised({status.error().code, "options." + status.error().message});
}

py::array Session::positions() const {
  const std::vector<double> rows = local_->collider().positions();
  const auto vertices = static_cast<py::ssize_t>(rows.size() / 3);
  if (!float32_) {
    py::array_t<double> array({vertices, py::ssize_t{3}});
    std::ranges::copy(rows, array.mutable_data());
    return array;
  }
  py::array_t<float> array({vertices, py::ssize_t{3}});
  std::ranges::transform(rows, array.mutable_data(), [](double x) { return static_cast<float>(x); });
  return array;
}

}  // namespace warmfront::python
