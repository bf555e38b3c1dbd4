// SPDX-License-Identifier: Apache-2.0
// A session of the tiny scene and its model, to which frames are sent in pieces of an input's choosing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "server/session/session.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/session_model.h"
#include "tests/support/observers.h"

namespace warmfront::fuzz {

class FuzzedSession {
 public:
  using StepOutcome = server::Outcome<std::shared_ptr<const server::Answer>>;

  explicit FuzzedSession(Bytes& input)
      : input_(input),
        first_(input.next()),
        ways_(input.next()),
        second_(static_cast<BodyKind>(ways_ % 3)),
        model_(workers(), first_, second_) {
    server::PositionBuffer start(server::Dtype::kFloat64, tiny_scene().vertex_count);
    append(start, tiny_positions(0));
    session_ =
        server::Session::create(
            {server::SessionId::parse("01234567-89ab-cdef-0123-456789abcdef").value(),
             tiny_scene(second_),
             {},
             server::Dtype::kFloat64,
             first_,
             {}},
            start,
            {workers(), runner(ways_ / 3 % 2 != 0), limits(),
             server::Account::open(budget(), 1 << 30, 0).value(),
             [](server::Session&, const server::Fault&) { expect(false, "the engine does not fail"); }})
            .value();
  }

 protected:
  static std::shared_ptr<Workers> workers() {
    static const auto shared = std::make_shared<Workers>(1);
    return shared;
  }
  static server::Budget& budget() {
    static server::Budget shared(std::size_t{1} << 40);
    return shared;
  }
  static const server::Limits& limits() {
    static const server::Limits shared;
    return shared;
  }
  // With guests, brief steps are taken by the thread that sends them.
  static server::Runner& runner(bool guests) {
    static server::Runner of_its_own(2);
    static server::Runner with_guests(2, {1});
    return guests ? with_guests : of_its_own;
  }

  /// The bytes in pieces of the input's choosing.
  template <class Buffer>
  void append(Buffer& buffer, const std::vector<double>& positions) {
    const std::string_view bytes(reinterpret_cast<const char*>(positions.data()),
                                 positions.size() * sizeof(double));
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t piece = std::size_t{1} + input_.next();
      expect(buffer.append(bytes.substr(at, piece)).ok(), "pieces of positions are taken");
      at += piece;
    }
  }
  server::FrameBuffer empty_buffer() const { return {server::Dtype::kFloat64, model_.scene()}; }
  server::FrameBuffer buffer(const std::vector<double>& positions) {
    server::FrameBuffer result = empty_buffer();
    append(result, positions);
    expect(result.complete(model_.scene()).ok(), "and are complete together");
    return result;
  }

  std::future<StepOutcome> post(std::uint64_t frame, server::FrameBuffer contents) {
    auto promise = std::make_shared<std::promise<StepOutcome>>();
    // A second answer would throw from set_value() on the runner's thread and end the run.
    server::FramePass pass;
    pass.memory = server::Holding(session_->account(), contents.expected_bytes());
    session_->submit(
        {frame, server::FrameQuestion{std::move(contents)}, std::move(pass),
         test::tell_frame([promise](const StepOutcome& outcome) { promise->set_value(outcome); })},
        server::Session::Admission::kAlways);
    return promise->get_future();
  }
  StepOutcome step(std::uint64_t frame, server::FrameBuffer contents) {
    return post(frame, std::move(contents)).get();
  }

  Bytes& input_;
  const std::uint64_t first_;
  const std::uint8_t ways_;  // of working: what the second body is, whose threads step
  const BodyKind second_;
  SessionModel model_;
  std::shared_ptr<server::Session> session_;
};

}  // namespace warmfront::fuzz
