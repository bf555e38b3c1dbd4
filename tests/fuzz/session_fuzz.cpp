// SPDX-License-Identifier: Apache-2.0
// Reads bytes as requests to a session: frames right, wrong, repeated, early, late, in pieces, of what moved
// only and several at once, bodies added and changed in between, streams that attach, take over and leave,
// and a close at any moment. After each, the session says what its contract says, every request is answered
// exactly once and in order, and a good frame still gets the right answer. The session works on threads of
// its own, or on its client's.
#include <chrono>
#include <cstring>
#include <future>
#include <limits>
#include <thread>
#include <utility>

#include "server/session/session.h"
#include "tests/fuzz/any_body.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/fuzzed_session.h"
#include "tests/fuzz/moved_parts.h"
#include "tests/fuzz/session_model.h"
#include "tests/support/observers.h"

namespace {

using namespace warmfront;
using namespace warmfront::server;
using fuzz::expect;
using fuzz::FuzzedSession;
using Parts = fuzz::MovedParts;
using StepOutcome = FuzzedSession::StepOutcome;

class Driver : FuzzedSession {
 public:
  using FuzzedSession::FuzzedSession;

  void run() {
    while (!input_.empty()) act();
    // Whatever happened before: an open session still answers correctly.
    right_frame();
    session_->close(kGone);
    wait_until_gone();
  }

 private:
  void act() {
    switch (input_.next() % 16) {
      case 0:
      case 1:
        return right_frame();
      case 2:
        return repeated_frame();
      case 3:
        return changed_frame();
      case 4:
        return frame_out_of_order();
      case 5:
        return frame_of_wrong_length();
      case 6:
        return frame_with_a_number_that_is_none();
      case 7:
        return frame_of_any_positions();
      case 8:
        return several_at_once();
      case 9:
        return attach(input_.next() % 2 == 0);
      case 10:
        return detach();
      case 11:
        return close_sometimes();
      case 12:
        return frame_of_what_moved();
      case 13:
        return frame_of_any_parts();
      case 14:
        return add_body();
      case 15:
        return change_body();
    }
  }

  /// The runner's threads may be the last to let go of it. What the fuzzer counts as leaked is what is left
  /// when an input is through.
  void wait_until_gone() {
    attachment_.reset();
    left_.reset();
    const std::weak_ptr<Session> last = std::exchange(session_, nullptr);
    for (int i = 0; i < 10'000 && !last.expired(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    expect(last.expired(), "nobody keeps a closed session");
  }

  void expect_answer(const StepOutcome& outcome) {
    if (closed_) return expect_fault(outcome, ErrorCode::kNotFound);
    expect(outcome.ok(), "a right frame is answered");
    expect(outcome.value()->frame + 1 == model_.expected(), "with its number");
    expect(fuzz::hash_of(*outcome.value()) == model_.last_hash(), "and the bits of a cold traversal");
  }
  void expect_fault(const StepOutcome& outcome, ErrorCode code) {
    expect(!outcome.ok(), "what is wrong is refused");
    expect(outcome.fault().code == (closed_ ? ErrorCode::kNotFound : code), "with its code");
    expect(!outcome.fault().message.empty(), "and with words");
  }

  void right_frame() {
    const std::vector<double> positions = model_.positions_for(input_.next());
    const FrameBuffer contents = buffer(positions);
    const StepOutcome outcome = step(model_.expected(), contents);
    if (!closed_) expect(model_.step(positions), "the model takes it");
    expect_answer(outcome);
    last_ = contents;
  }
  void repeated_frame() {
    // What was a frame of the scene before bodies came is still that frame.
    const StepOutcome outcome = step(model_.expected() - 1, last_ ? *last_ : buffer(model_.positions()));
    model_.stepped() ? expect_answer(outcome) : expect_fault(outcome, ErrorCode::kFailedPrecondition);
  }
  void changed_frame() {
    std::vector<double> positions = model_.positions();
    double& changed = positions[input_.next() % positions.size()];
    // Another zero is another frame: sameness is of bits.
    changed = changed == 0 && !std::signbit(changed) ? -0.0 : changed + 1;
    FrameBuffer contents = buffer(positions);
    if (last_ && contents == *last_) return;
    expect_fault(step(model_.expected() - 1, std::move(contents)),
                 model_.stepped() ? ErrorCode::kAborted : ErrorCode::kFailedPrecondition);
  }
  void frame_out_of_order() {
    const std::uint64_t expected = model_.expected();
    const std::uint64_t distance = std::uint64_t{input_.next()} << (input_.next() % 56);
    const std::uint64_t frame = input_.next() % 2 == 0 ? expected + 1 + distance : expected - 2 - distance;
    if (frame == expected || frame + 1 == expected) return;
    const StepOutcome outcome = step(frame, buffer(model_.positions_for(1)));
    expect_fault(outcome, ErrorCode::kFailedPrecondition);
    if (!closed_) expect(outcome.fault().expected_frame == expected, "a gap says what is expected");
  }
  void frame_of_wrong_length() {
    FrameBuffer wrong = empty_buffer();
    const std::size_t right = std::size_t{24} * model_.scene().vertex_count();
    const std::size_t length = input_.next() * std::size_t{4};
    expect(wrong.append(std::string(length, 'x')).ok() == (length <= right), "too many bytes are refused");
    if (length == right) return;
    expect_fault(step(model_.expected(), std::move(wrong)), ErrorCode::kInvalidArgument);
  }
  void frame_with_a_number_that_is_none() {
    std::vector<double> positions = model_.positions_for(2);
    const std::uint8_t which = input_.next();
    const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()};
    positions[which % positions.size()] = bad[which % 3];
    expect_fault(step(model_.expected(), buffer(positions)), ErrorCode::kInvalidArgument);
  }
  void frame_of_any_positions() {
    std::vector<double> positions = model_.positions_for(3);
    for (double& x : positions) {
      const std::string_view bytes = input_.take(sizeof(double));
      std::memcpy(&x, bytes.data(), bytes.size());
    }
    const FrameBuffer contents = buffer(positions);
    const StepOutcome outcome = step(model_.expected(), contents);
    if (closed_ || !model_.step(positions)) return expect_fault(outcome, ErrorCode::kInvalidArgument);
    expect_answer(outcome);
    last_ = contents;
  }

  /// Some bodies as wholes, some by poses, single vertices of others; the rest is not mentioned.
  void frame_of_what_moved() {
    Parts parts;
    std::vector<double> next = model_.positions();
    std::vector<bool> given(model_.scene().body_count(), false);
    std::vector<BodyPose> poses;
    for (std::uint32_t b = 0; b < model_.scene().body_count(); ++b) {
      const std::uint8_t choice = input_.next();
      if (model_.fixed(b) || choice % 4 == 0) continue;
      const bool rigid = model_.scene().bodies()[b].kind == BodyKind::kRigid;
      const std::size_t first = std::size_t{3} * fuzz::kCorners * b;
      std::vector<double> square = fuzz::square_positions(b, choice / 4);
      if (choice % 4 == 1) {
        given[b] = true;
        Parts::put(parts.bodies, b);
        for (const double x : square) Parts::put(parts.body_positions, x);
      } else if (rigid) {
        const Pose pose = fuzz::any_pose(input_);
        poses.push_back({b, pose});
        Parts::put(parts.pose_bodies, b);
        for (const double x : pose.matrix) Parts::put(parts.poses, x);
        for (std::uint32_t corner = 0; corner < fuzz::kCorners; ++corner)
          std::ranges::copy(pose.place(model_.rest().data() + first + 3 * corner),
                            square.begin() + 3 * corner);
      } else {
        for (std::uint32_t corner = 0; corner < fuzz::kCorners; ++corner) {
          if ((choice >> corner) % 2 == 0) {
            std::copy_n(next.begin() + static_cast<std::ptrdiff_t>(first + 3 * corner), 3,
                        square.begin() + 3 * corner);
            continue;
          }
          Parts::put(parts.vertices, fuzz::kCorners * b + corner);
          for (int axis = 0; axis < 3; ++axis) Parts::put(parts.vertex_positions, square[3 * corner + axis]);
        }
      }
      std::ranges::copy(square, next.begin() + static_cast<std::ptrdiff_t>(first));
    }
    FrameBuffer contents = empty_buffer();
    parts.append_to(contents, std::size_t{1} + input_.next());
    const StepOutcome outcome = step(model_.expected(), contents);
    if (!closed_) expect(model_.step(next, given, poses), "the model takes what moved");
    expect_answer(outcome);
    last_ = std::move(contents);
  }
  /// Fields of any bytes: a frame that does not fit the scene is refused, and one that happens to is not
  /// looked into further.
  void frame_of_any_parts() {
    Parts parts;
    for (std::string* field : parts.fields()) *field = input_.take(input_.next() % 64);
    FrameBuffer contents = empty_buffer();
    parts.append_to(contents, std::size_t{1} + input_.next());
    FrameBuffer copy = contents;
    if (copy.complete(model_.scene()).ok() && !parts.names_nobody(model_.scene())) return;
    expect_fault(step(model_.expected(), std::move(contents)), ErrorCode::kInvalidArgument);
  }

  void add_body() {
    if (model_.scene().body_count() >= 6) return;
    BodyAddition addition{fuzz::any_body(input_), fuzz::square_faces(input_.next() % 8 == 0 ? 1 : 0)};
    const std::uint8_t made_of = input_.next();
    if (made_of % 4 == 1) addition.faces.clear();                                      // points, or
    if (made_of % 4 == 2) addition.faces.resize(1);                                    // a face, and a point
    if (made_of % 8 >= 4) addition.edges = {{0, 3}, {1, made_of % 32 == 31 ? 4 : 3}};  // the last is refused
    const std::vector<double> positions = fuzz::square_positions(model_.scene().body_count(), input_.next());
    const std::uint64_t early = input_.next() % 8 == 0 ? 1 : 0;
    const std::optional<Fault> fault = change(early, AddBody{addition, positions});
    expect_changed(fault, early, [&] { return model_.add(addition, positions); });
  }
  void change_body() {
    const std::uint32_t index = input_.next() % (model_.scene().body_count() + 1);
    const Body body = fuzz::any_body(input_);
    const std::uint64_t early = input_.next() % 8 == 0 ? 1 : 0;
    const std::optional<Fault> fault = change(early, ChangeBody{index, body});
    expect_changed(fault, early, [&] { return model_.change(index, body); });
  }
  std::optional<Fault> change(std::uint64_t early, SceneChange what) {
    auto promise = std::make_shared<std::promise<std::optional<Fault>>>();
    session_->change({model_.expected() + early, {std::move(what)}},
                     test::tell_change([promise](const Outcome<SessionState>& outcome) {
                       promise->set_value(outcome ? std::nullopt : std::optional<Fault>(outcome.fault()));
                     }));
    return promise->get_future().get();
  }
  template <class Apply>
  void expect_changed(const std::optional<Fault>& fault, std::uint64_t early, const Apply& apply) {
    if (closed_)
      return expect(fault && fault->code == ErrorCode::kNotFound, "a closed session is not changed");
    if (early != 0)
      return expect(fault && fault->code == ErrorCode::kFailedPrecondition, "changes have their turn");
    const bool taken = apply();
    expect(taken == !fault, "a change is taken when it makes a scene");
    expect(!fault || (fault->code == ErrorCode::kInvalidArgument && !fault->message.empty()),
           "and refused with words");
    expect(session_->scene()->body_count() == model_.scene().body_count() &&
               std::ranges::equal(session_->scene()->bodies(), model_.scene().bodies()),
           "the scene says what was changed");
  }

  /// A turn about one axis, and a shift.
  void several_at_once() {
    struct Pending {
      std::uint64_t frame;
      std::vector<double> positions;
      std::future<StepOutcome> outcome;
    };
    std::vector<Pending> pending;
    const int count = input_.next() % 6;
    for (int i = 0; i < count; ++i) {
      const std::uint8_t choice = input_.next();
      std::vector<double> positions = model_.positions_for(choice);
      // Some are out of turn: those after them must not notice.
      const std::uint64_t frame = model_.expected() + static_cast<std::uint64_t>(i) + (choice > 200 ? 7 : 0);
      std::future<StepOutcome> outcome = post(frame, buffer(positions));
      pending.push_back({frame, std::move(positions), std::move(outcome)});
    }
    for (Pending& one : pending) {
      const StepOutcome outcome = one.outcome.get();
      if (closed_ || one.frame != model_.expected()) {
        expect_fault(outcome, ErrorCode::kFailedPrecondition);
        continue;
      }
      expect(model_.step(one.positions), "the model takes it");
      expect_answer(outcome);
      last_ = buffer(one.positions);
    }
  }

  void attach(bool takeover) {
    auto expected = std::make_shared<std::promise<Outcome<Standing>>>();
    const auto evicted = std::make_shared<int>(0);
    const auto attachment = session_->attach(
        {.takeover = takeover}, [evicted](const Fault&) { ++*evicted; },
        [expected](const Outcome<Standing>& standing) { expected->set_value(standing); });
    if (closed_)
      return expect(!attachment.ok() && attachment.fault().code == ErrorCode::kNotFound,
                    "a closed session has no stream");
    if (attachment_ && !takeover)
      return expect(!attachment.ok() && attachment.fault().code == ErrorCode::kAborted,
                    "a session has one stream");
    expect(attachment.ok(), "a free session can be attached");
    if (evicted_) expect(*evicted_ == 1, "the one before is told, once");
    const Outcome<Standing> standing = expected->get_future().get();
    expect(standing.ok() && standing.value().now.frame + 1 == model_.expected(),
           "a stream hears the frame expected");
    left_ = std::exchange(attachment_, attachment.value());
    evicted_ = evicted;
    expect(session_->snapshot().attached, "and holds the session");
  }
  void detach() {
    // A stream that was taken over leaves later: nothing may come of it.
    if (left_) session_->detach(*left_);
    expect(session_->snapshot().attached == attachment_.has_value(), "a stream of the past frees nothing");
    if (!attachment_ || input_.next() % 2 == 0) return;
    session_->detach(*attachment_);
    left_ = std::exchange(attachment_, std::nullopt);
    evicted_ = nullptr;
    expect(!session_->snapshot().attached, "a stream that left holds nothing");
  }
  void close_sometimes() {
    if (input_.next() % 8 != 0) return;
    session_->close(kGone);
    if (evicted_ && !closed_) expect(*evicted_ == 1, "the stream of a closed session is told, once");
    closed_ = true;
  }

  inline static const Fault kGone{ErrorCode::kNotFound, Reason::kSessionNotFound, "gone; create it again"};

  std::optional<FrameBuffer> last_;  // the frame that was answered last
  bool closed_ = false;
  std::optional<Session::Attachment> attachment_;
  std::optional<Session::Attachment> left_;
  std::shared_ptr<int> evicted_;  // of the attachment
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes input(data, size);
  Driver(input).run();
  return 0;
}
