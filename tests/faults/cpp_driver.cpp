// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "client/lib/client.h"
#include "tests/faults/session_driver.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using testing::AddOperation;
using testing::StepOperation;

/// Views of positions as a session of float32 or of float64 takes them.
class Given {
 public:
  explicit Given(bool single) : single_(single) {}
  Given(const Given&) = delete;
  Given& operator=(const Given&) = delete;

  Positions operator()(const std::vector<double>& rows) {
    if (!single_) return std::span<const double>(rows);
    const std::vector<float>& floats = floats_.emplace_back(rows.begin(), rows.end());
    return std::span<const float>(floats);
  }

 private:
  const bool single_;
  std::deque<std::vector<float>> floats_;
};

/// A frame's views of what a step operation owns.
class FrameOf {
 public:
  FrameOf(const StepOperation& step, bool single) : given_(single) {
    if (step.all) frame_.positions = given_(*step.all);
    for (const StepOperation::Rows& rows : step.bodies)
      bodies_.push_back({rows.body, given_(rows.positions)});
    frame_.bodies = bodies_;
    frame_.poses = step.poses;
    frame_.vertices = step.vertices;
    frame_.vertex_positions = given_(step.vertex_positions);
  }

  const Frame& frame() const { return frame_; }

 private:
  Given given_;
  Frame frame_;
  std::vector<BodyPositions> bodies_;
};

class CppDriver final : public SessionDriver {
 public:
  CppDriver(std::string address, bool single) : address_(std::move(address)), single_(single) {}

  Status create(const testing::AcceptedState& state, const ColliderOptions& options) override {
    session_.reset();
    auto client = client::Client::connect(address_, {.call_timeout = 20s,
                                                     .create_timeout = 60s,
                                                     .answer_timeout = 60s,
                                                     .resume_timeout = 60s,
                                                     .max_resumes_without_answer = 1000});
    if (!client) return client.error();
    Given given(single_);
    auto session = client.value().create_session(state.scene, given(state.positions), options);
    if (!session) return session.error();
    session_.emplace(std::move(session).value());
    return {};
  }
  Result<client::Answer> step(const StepOperation& operation) override {
    const FrameOf moved(operation, single_);
    switch (operation.as) {
      case StepOperation::As::kStep:
        return session_->step(moved.frame(), operation.options);
      case StepOperation::As::kTrial:
        return session_->trial(moved.frame(), operation.options);
      case StepOperation::As::kPlace:
        return session_->place(moved.frame());
      case StepOperation::As::kMaxStep:
        break;
    }
    auto answer = session_->max_step(moved.frame(), operation.leave_out_overlaps, operation.options);
    if (!answer) return answer.error();
    return std::move(answer.value().answer);
  }
  Status submit(const StepOperation& operation) override {
    Question question{.options = operation.options};
    if (operation.as == StepOperation::As::kTrial) question.kind = QuestionKind::kTrial;
    if (operation.as == StepOperation::As::kPlace) question.kind = QuestionKind::kPlace;
    if (operation.as == StepOperation::As::kMaxStep)
      question = {QuestionKind::kMaxStep, operation.options, operation.leave_out_overlaps};
    const auto number = session_->submit(FrameOf(operation, single_).frame(), question);
    return number.ok() ? Status() : Status(number.error());
  }
  Result<client::Answer> proximity(const testing::NearOperation& near) override {
    return near.tangled ? session_->intersections(near.where, near.options)
                        : session_->proximity(near.distance, near.where, near.options);
  }
  bool asks() const override { return true; }
  Result<CommitResult> commit(double fraction) override { return session_->commit(fraction); }
  Status submit_commit(double fraction) override {
    const auto number = session_->submit_commit(fraction);
    return number.ok() ? Status() : Status(number.error());
  }
  Result<client::Answer> next_answer() override { return session_->next_answer(); }
  Result<std::uint32_t> add_body(const AddOperation& add) override {
    Given given(single_);
    return session_->add_body(add.addition, given(add.positions));
  }
  Status change_body(std::uint32_t index, const Body& body) override {
    return session_->change_body(index, body);
  }
  Status change_filters(const PairFilters& filters) override { return session_->change_filters(filters); }
  Status change_excluded_pairs(const std::vector<std::array<std::uint32_t, 2>>& pairs) override {
    return session_->change_excluded_pairs(pairs);
  }
  Status change_options(const ColliderOptions& options) override { return session_->change_options(options); }
  Status replace(const ReplaceElements& change) override {
    return session_->replace_elements(change.index, change.faces, change.edges);
  }
  Status replace(const ReplaceBody& change) override {
    Given given(single_);
    return session_->replace_body(change.index, change.addition, given(change.positions));
  }
  Status close() override { return session_->close(); }
  Result<State> state() override {
    Result<std::vector<double>> positions = session_->positions();
    if (!positions) return positions.error();
    Result<std::vector<BodyPose>> poses = session_->poses();
    if (!poses) return poses.error();
    return State{std::move(positions).value(), std::move(poses).value()};
  }
  bool single() const override { return single_; }
  std::string id() const override { return session_->id(); }
  std::uint32_t window() const override { return session_->window(); }

 private:
  const std::string address_;
  const bool single_;
  std::optional<client::Session> session_;
};

}  // namespace

std::unique_ptr<SessionDriver> drive_cpp(const std::string& address) {
  return std::make_unique<CppDriver>(address, false);
}
std::unique_ptr<SessionDriver> drive_cpp_in_float32(const std::string& address) {
  return std::make_unique<CppDriver>(address, true);
}

}  // namespace warmfront::test
