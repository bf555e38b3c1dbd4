// SPDX-License-Identifier: Apache-2.0
// Trials and commits by bare messages.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {

inline v1::Question question(v1::Question::Kind kind) {
  v1::Question question;
  question.set_kind(kind);
  return question;
}
inline v1::Question trial() {
  return question(v1::Question::KIND_TRIAL);
}

inline v1::StreamStepsRequest commit_message(std::uint64_t frame, double fraction) {
  v1::StreamStepsRequest request;
  request.mutable_commit()->set_frame(frame);
  request.mutable_commit()->set_fraction(fraction);
  return request;
}

inline bool same(const v1::SessionState& a, const v1::SessionState& b) {
  return a.frame() == b.frame() && a.revision() == b.revision() && a.digest() == b.digest();
}

class TrialsTest : public ServiceTest {
 protected:
  explicit TrialsTest(server::Config config = {}) : ServiceTest(std::move(config)) {}

  v1::StreamStepsRequest ask(std::uint64_t number, const v1::Question& question,
                             const std::string& positions) {
    v1::StreamStepsRequest request = frame_message(number, positions);
    *request.mutable_step()->mutable_question() = question;
    return request;
  }
  v1::SessionState state(const std::string& id = kId) { return session_info(id).state(); }
  /// Sends a request and returns the answer.
  static v1::StreamStepsResponse exchange(Stream& stream, const v1::StreamStepsRequest& request) {
    EXPECT_TRUE(stream.Write(request));
    v1::StreamStepsResponse response;
    EXPECT_TRUE(stream.Read(&response));
    return response;
  }
  static grpc::StatusCode code_of(const v1::StreamStepsResponse& response) {
    return static_cast<grpc::StatusCode>(response.error().status().code());
  }
  static const std::string& words_of(const v1::StreamStepsResponse& response) {
    return response.error().status().message();
  }
};

}  // namespace warmfront::test
