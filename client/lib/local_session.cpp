// SPDX-License-Identifier: Apache-2.0
// Thread safety as stated in the header.
#include "client/lib/local_session.h"

#include <algorithm>
#include <exception>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "engine/scene/description_checks.h"

namespace warmfront::client {
namespace {

ContactTable columns_of(const StepResult& step, const Scene& scene, const ContactFields& fields) {
  ContactTable table;
  table.kind.reserve(step.contacts.size());
  table.status.reserve(step.contacts.size());
  table.vertices.reserve(step.contacts.size());
  table.toi.reserve(step.contacts.size());
  for (const Contact& contact : step.contacts) {
    table.kind.push_back(contact.kind);
    table.status.push_back(contact.status);
    if (contact.kind == ContactKind::kEdgeFace)
      table.edge_faces.push_back(scene.edge_face_vertices_of(contact));
    else
      table.vertices.push_back(scene.vertices_of(contact));
    table.toi.push_back(contact.toi);
  }
  for (const ContactGeometry& geometry : step.geometry) {
    if (fields.weights) table.weights.push_back(geometry.weights);
    if (fields.normal) table.normal.push_back(geometry.normal);
    if (fields.points) table.points.push_back(geometry.points);
    if (fields.direction) table.direction.push_back(geometry.direction);
    if (fields.squared_distance) table.squared_distance.push_back(geometry.squared_distance);
    if (fields.closest) table.closest.push_back(geometry.closest);
  }
  for (const ClosestPair& pair : step.closest_pairs) {
    table.multiplicity.push_back(pair.multiplicity);
    table.stencil.push_back(pair.stencil);
  }
  return table;
}

/// A copy of a frame, so that the caller's arrays are free again. Stays where it is.
class OwnFrame {
 public:
  explicit OwnFrame(const Frame& frame)
      : bodies_(frame.bodies.begin(), frame.bodies.end()),
        poses_(frame.poses.begin(), frame.poses.end()),
        vertices_(frame.vertices.begin(), frame.vertices.end()) {
    for (BodyPositions& body : bodies_) body.positions = own(body.positions);
    if (frame.positions) frame_.positions = own(*frame.positions);
    frame_.bodies = bodies_;
    frame_.poses = poses_;
    frame_.vertices = vertices_;
    frame_.vertex_positions = own(frame.vertex_positions);
  }
  OwnFrame(const OwnFrame&) = delete;
  OwnFrame& operator=(const OwnFrame&) = delete;

  const Frame& frame() const { return frame_; }

 private:
  Positions own(const Positions& positions) {
    return std::visit(
        [&](auto rows) -> Positions {
          using Row = std::remove_const_t<typename decltype(rows)::element_type>;
          return std::span<const Row>(
              std::get<std::vector<Row>>(arrays_.emplace_back(std::vector<Row>(rows.begin(), rows.end()))));
        },
        positions);
  }

  std::deque<std::variant<std::vector<float>, std::vector<double>>> arrays_;
  std::vector<BodyPositions> bodies_;
  std::vector<BodyPose> poses_;
  std::vector<std::uint32_t> vertices_;
  Frame frame_;
};

Error at_frame(std::uint64_t number, const Error& error) {
  return {error.code, "frame " + std::to_string(number) + ": " + error.message};
}

}  // namespace

class LocalSession::Job final : public PendingAnswer {
 public:
  /// `number`: of the frame that it is about.
  /// `failures`: known to who asked.
  Job(const std::shared_ptr<LocalSession>& session, const Request& request, std::uint64_t number,
      std::uint64_t failures, const WaitOptions& wait, bool handed_out)
      : PendingAnswer(wait, handed_out),
        session_(session),
        request_(request),
        number_(number),
        failures_(failures) {
    if (handed_out) request_.frame = own_.emplace(request.frame).frame();
  }

  bool wait_until(Time until) override {
    if (const std::shared_ptr<LocalSession> session = session_.lock()) return session->wait(*this, until);
    if (!settled()) settle(Error{ErrorCode::kFailedPrecondition, "the session was closed before the answer"});
    return true;
  }

  const Request& request() const { return request_; }
  std::uint64_t number() const { return number_; }
  std::uint64_t failures() const { return failures_; }

  std::optional<Error> why;  ///< it has no answer; protected by the session's mutex

 private:
  const std::weak_ptr<LocalSession> session_;
  std::optional<OwnFrame> own_;
  Request request_;
  const std::uint64_t number_;
  const std::uint64_t failures_;
};

LocalSession::~LocalSession() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    for (const std::shared_ptr<Job>& job : jobs_) job->cancel();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

// As a daemon's: one kind of positions for all of a session.
Status LocalSession::check_kind(const Positions& positions, const std::string& where) const {
  const bool single = std::holds_alternative<std::span<const float>>(positions);
  const bool any = std::visit([](auto rows) { return !rows.empty(); }, positions);
  if (!any || single == float32()) return {};
  return invalid_argument(where + ": the session was created with " + (float32() ? "float32" : "float64") +
                          " positions; give every frame the same kind");
}

Status LocalSession::check_kind(const Frame& frame) const {
  if (frame.positions) {
    if (Status fits = check_kind(*frame.positions, "positions"); !fits) return fits;
  }
  const std::span<const Body> bodies = collider_.scene().bodies();
  for (std::size_t i = 0; i < frame.bodies.size(); ++i) {
    const auto& [body, positions] = frame.bodies[i];
    if (body >= bodies.size()) continue;  // which the engine says
    if (Status fits = check_kind(positions, "positions"); !fits)
      return of_body("bodies[" + std::to_string(i) + "]", body, bodies[body], fits.error());
  }
  return check_kind(frame.vertex_positions, "vertex_positions");
}

Status LocalSession::check_idle() const {
  const std::lock_guard lock(mutex_);
  if (jobs_.empty()) return {};
  return Error{ErrorCode::kFailedPrecondition, "frames are unanswered; take their answers first"};
}

std::shared_ptr<PendingAnswer> LocalSession::ask(const Request& request, const WaitOptions& wait,
                                                 bool handed_out) {
  if (Status may = PendingAnswer::check(wait); !may) return std::make_shared<PendingAnswer>(may.error());
  if (!handed_out && !wait.timeout && check_idle() && next_ == frame_ + 1) {
    Result<Answer> answer = compute(request, wait.cancelled);
    if (!answer && answer.error().code == ErrorCode::kCancelled)
      return std::make_shared<PendingAnswer>(at_frame(next_, PendingAnswer::cancelled()));
    if (answer && request.counts()) next_ = ++frame_ + 1;
    return std::make_shared<PendingAnswer>(std::move(answer));
  }
  const auto job = std::make_shared<Job>(shared_from_this(), request, next_, failures_, wait, handed_out);
  {
    const std::lock_guard lock(mutex_);
    if (!thread_.joinable()) thread_ = std::thread([this] { compute_all(); });
    jobs_.push_back(job);
  }
  if (request.counts()) ++next_;
  changed_.notify_all();
  return job;
}

bool LocalSession::wait(const Job& job, PendingAnswer::Time until) {
  std::unique_lock lock(mutex_);
  while (!job.settled()) {
    const PendingAnswer::Time now = PendingAnswer::Clock::now();
    if (now >= until) break;
    Job& first = *jobs_.front();
    PendingAnswer::Time next = until;
    if (!first.why) {
      first.why = first.given_up(now);
      if (first.why)
        first.cancel();
      else
        next = std::min(until, first.next_look(now));
    }
    if (next == PendingAnswer::Time::max())
      changed_.wait(lock);
    else
      changed_.wait_until(lock, next);
  }
  // That it failed is known now. What was asked after it fails, too, and tells no more than that.
  if (job.settled() && job.failed() && job.request().counts() && job.failures() == failures_) {
    next_ = frame_ + 1;
    ++failures_;
  }
  return job.settled();
}

void LocalSession::compute_all() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return ending_ || !jobs_.empty(); });
    if (ending_) return;
    const std::shared_ptr<Job> job = jobs_.front();
    std::optional<Result<Answer>> answer;
    std::exception_ptr thrown;
    if (!job->why) job->why = job->given_up(PendingAnswer::Clock::now(), false);
    if (!job->why && job->number() != frame_ + 1)
      job->why = Error{ErrorCode::kFailedPrecondition, "a frame before it failed, and frame " +
                                                           std::to_string(frame_ + 1) + " is the next one"};
    if (job->why) {
      if (job->request().moves()) trial_lost_ = true;
      answer = at_frame(job->number(), *job->why);
    } else {
      lock.unlock();
      try {
        answer = compute(job->request(), job->stop());
      } catch (...) {
        thrown = std::current_exception();
      }
      lock.lock();
      if (ending_) return;
      if (answer && *answer && job->request().counts()) ++frame_;
      if (answer && !*answer && answer->error().code == ErrorCode::kCancelled)
        answer = at_frame(job->number(), job->why.value_or(PendingAnswer::cancelled()));
    }
    if (thrown)
      job->settle(thrown);
    else
      job->settle(*std::move(answer));
    jobs_.pop_front();
    changed_.notify_all();
  }
}

Status LocalSession::check(const Request& request) const {
  const Question& question = request.question;
  const auto of_question = [](const Error& error) { return Error{error.code, "question." + error.message}; };
  if (Status valid = validate(question.kind, question.options); !valid) return of_question(valid.error());
  const std::size_t most = collider_.options().max_contacts;
  if (question.options.max_contacts && *question.options.max_contacts > most)
    return invalid_argument("question.max_contacts: " + std::to_string(*question.options.max_contacts) +
                            " is above the session's " + std::to_string(most));
  if (Status valid = validate(merged(collider_.options(), question)); !valid)
    return of_question(valid.error());
  if (!request.moves()) return {};
  return check_kind(request.frame);
}

Frame LocalSession::as_sent(const Frame& frame) {
  Frame sent = frame;
  if (float32() && !frame.poses.empty()) {
    rounded_.clear();
    for (const BodyPose& pose : frame.poses) rounded_.push_back({pose.body, in_float32(pose.pose)});
    sent.poses = rounded_;
  }
  return sent;
}

Result<Answer> LocalSession::compute(const Request& request, const std::atomic<bool>* stop) {
  const std::uint64_t number = frame_ + 1;
  if (trial_lost_ && request.needs_trial())
    return at_frame(number,
                    {ErrorCode::kFailedPrecondition,
                     "the last motion was given up or refused before its turn; ask for a trial first"});
  Answer answer;
  answer.frame = number;
  if (request.commit) {
    Result<CommitResult> taken = collider_.commit(*request.commit, rounding_);
    if (!taken) return at_frame(number, taken.error());
    answer.commit = taken.value();
    return answer;
  }
  if (Status fits = check(request); !fits) {
    if (request.moves()) trial_lost_ = true;
    return at_frame(number, fits.error());
  }
  if (request.moves()) trial_lost_ = false;
  // Columns are made before the step is taken: where there is no memory for them, it did not happen.
  const ContactFields fields = merged(collider_.options(), request.question).fields;
  const auto accept = [&](const StepResult& step) -> Status {
    static_cast<KindCounts&>(answer) = step;
    answer.possible = step.possible;
    answer.earliest_toi = step.earliest_toi;
    answer.overlaps_at_start = step.overlaps_at_start;
    answer.contacts = columns_of(step, collider_.scene(), fields);
    answer.vertex_distances.assign(step.vertex_distances.begin(), step.vertex_distances.end());
    answer.worlds.assign(step.worlds.begin(), step.worlds.end());
    answer.world_tois.assign(step.world_tois.begin(), step.world_tois.end());
    return request.accept ? request.accept(step) : Status();
  };
  Question question = request.question;
  question.rounding = rounding_;
  const Result<StepResult> result = collider_.ask(as_sent(request.frame), question, stop, accept);
  if (!result) return at_frame(number, result.error());
  answer.statistics = result.value().statistics;
  if (result.value().all_deformable)
    answer.all_deformable.emplace(AllDeformable{*result.value().all_deformable});
  return answer;
}

}  // namespace warmfront::client
