// SPDX-License-Identifier: Apache-2.0
// Bytes as what clients do to a session: frames right, wrong, repeated, early, late, in pieces and several at
// once, streams that attach, take over and leave, and a close at any moment. After each, the session says
// what its contract says, every request is answered exactly once and in order, and a good frame still gets
// the right answer. The session works on threads of its own.
#include <cstring>
#include <future>
#include <limits>

#include "server/session/session.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/session_model.h"

namespace {

using namespace warmfront;
using namespace warmfront::server;
using fuzz::expect;

using StepOutcome = Outcome<std::shared_ptr<const Answer>>;

class Driver {
 public:
  explicit Driver(fuzz::Bytes& input) : input_(input), first_(input.next()), model_(workers(), first_) {
    PositionBuffer start(Dtype::kFloat64, fuzz::tiny_scene().vertex_count);
    append(start, fuzz::tiny_positions(0));
    session_ = Session::create({SessionId::parse("01234567-89ab-cdef-0123-456789abcdef").value(),
                                fuzz::tiny_scene(),
                                {},
                                Dtype::kFloat64,
                                first_},
                               start,
                               {workers(), runner(), 4, Account::open(budget(), 1 << 30, 0).value(),
                                [](Session&, const Fault&) { expect(false, "the engine does not fail"); }})
                   .value();
  }

  void run() {
    while (!input_.empty()) act();
    // Whatever happened before: an open session steps on rightly.
    right_frame();
    session_->close(kGone);
  }

 private:
  static std::shared_ptr<Workers> workers() {
    static const auto shared = std::make_shared<Workers>(1);
    return shared;
  }
  static Budget& budget() {
    static Budget shared(std::size_t{1} << 40);
    return shared;
  }
  static Runner& runner() {
    static Runner shared(2);
    return shared;
  }

  void act() {
    switch (input_.next() % 12) {
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
    }
  }

  /// The bytes in pieces of the input's choosing.
  void append(PositionBuffer& buffer, const std::vector<double>& positions) {
    const std::string_view bytes(reinterpret_cast<const char*>(positions.data()),
                                 positions.size() * sizeof(double));
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t piece = std::size_t{1} + input_.next();
      expect(buffer.append(bytes.substr(at, piece)).ok(), "pieces of positions are taken");
      at += piece;
    }
    expect(buffer.complete().ok(), "and are complete together");
  }
  PositionBuffer buffer(const std::vector<double>& positions) {
    PositionBuffer result(Dtype::kFloat64, fuzz::tiny_scene().vertex_count);
    append(result, positions);
    return result;
  }

  std::future<StepOutcome> post(std::uint64_t frame, PositionBuffer positions) {
    auto promise = std::make_shared<std::promise<StepOutcome>>();
    // A second answer would throw from set_value() on the runner's thread and end the run.
    FramePass pass;
    pass.memory = Holding(session_->account(), positions.expected_bytes());
    session_->step(frame, std::move(positions), std::move(pass), Session::Admission::kAlways,
                   [promise](const StepOutcome& outcome) { promise->set_value(outcome); });
    return promise->get_future();
  }
  StepOutcome step(std::uint64_t frame, PositionBuffer positions) {
    return post(frame, std::move(positions)).get();
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
    const std::vector<double> positions = fuzz::tiny_positions(input_.next());
    const std::uint64_t frame = model_.expected();
    const StepOutcome outcome = step(frame, buffer(positions));
    if (!closed_) expect(model_.step(positions), "the model takes it");
    expect_answer(outcome);
  }
  void repeated_frame() {
    const StepOutcome outcome = step(model_.expected() - 1, buffer(model_.last_positions()));
    model_.stepped() ? expect_answer(outcome) : expect_fault(outcome, ErrorCode::kFailedPrecondition);
  }
  void changed_frame() {
    std::vector<double> positions = model_.last_positions();
    double& changed = positions[input_.next() % positions.size()];
    // Another zero is another frame: sameness is of bits.
    changed = changed == 0 && !std::signbit(changed) ? -0.0 : changed + 1;
    if (positions == model_.last_positions() && changed != 0) return;
    expect_fault(step(model_.expected() - 1, buffer(positions)),
                 model_.stepped() ? ErrorCode::kAborted : ErrorCode::kFailedPrecondition);
  }
  void frame_out_of_order() {
    const std::uint64_t expected = model_.expected();
    const std::uint64_t distance = std::uint64_t{input_.next()} << (input_.next() % 56);
    const std::uint64_t frame = input_.next() % 2 == 0 ? expected + 1 + distance : expected - 2 - distance;
    if (frame == expected || frame + 1 == expected) return;
    const StepOutcome outcome = step(frame, buffer(fuzz::tiny_positions(1)));
    expect_fault(outcome, ErrorCode::kFailedPrecondition);
    if (!closed_) expect(outcome.fault().expected_frame == expected, "a gap says what is expected");
  }
  void frame_of_wrong_length() {
    PositionBuffer wrong(Dtype::kFloat64, fuzz::tiny_scene().vertex_count);
    const std::size_t length = input_.next() * std::size_t{2};
    const bool fits = length <= fuzz::tiny_scene().vertex_count * 24;
    expect(wrong.append(std::string(length, 'x')).ok() == fits, "too many bytes are refused");
    if (length == fuzz::tiny_scene().vertex_count * 24) return;
    expect_fault(step(model_.expected(), std::move(wrong)), ErrorCode::kInvalidArgument);
  }
  void frame_with_a_number_that_is_none() {
    std::vector<double> positions = fuzz::tiny_positions(2);
    const std::uint8_t which = input_.next();
    const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()};
    positions[which % positions.size()] = bad[which % 3];
    expect_fault(step(model_.expected(), buffer(positions)), ErrorCode::kInvalidArgument);
  }
  void frame_of_any_positions() {
    std::vector<double> positions = fuzz::tiny_positions(3);
    for (double& x : positions) {
      const std::string_view bytes = input_.take(sizeof(double));
      std::memcpy(&x, bytes.data(), bytes.size());
    }
    const StepOutcome outcome = step(model_.expected(), buffer(positions));
    if (closed_ || !model_.step(positions)) return expect_fault(outcome, ErrorCode::kInvalidArgument);
    expect_answer(outcome);
  }

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
      std::vector<double> positions = fuzz::tiny_positions(choice);
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
    }
  }

  void attach(bool takeover) {
    auto expected = std::make_shared<std::promise<Outcome<std::uint64_t>>>();
    const auto evicted = std::make_shared<int>(0);
    const auto attachment = session_->attach(
        takeover, [evicted](const Fault&) { ++*evicted; },
        [expected](const Outcome<std::uint64_t>& frame) { expected->set_value(frame); });
    if (closed_)
      return expect(!attachment.ok() && attachment.fault().code == ErrorCode::kNotFound,
                    "a closed session has no stream");
    if (attachment_ && !takeover)
      return expect(!attachment.ok() && attachment.fault().code == ErrorCode::kAborted,
                    "a session has one stream");
    expect(attachment.ok(), "a free session can be attached");
    if (evicted_) expect(*evicted_ == 1, "the one before is told, once");
    const Outcome<std::uint64_t> frame = expected->get_future().get();
    expect(frame.ok() && frame.value() == model_.expected(), "a stream hears the frame expected");
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

  fuzz::Bytes& input_;
  const std::uint64_t first_;
  fuzz::SessionModel model_;
  std::shared_ptr<Session> session_;
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
