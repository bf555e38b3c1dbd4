// SPDX-License-Identifier: Apache-2.0
// Any bytes as a recording: refused with the byte, or replayed through the engine, for as many steps as a
// few seconds allow, and placed frame by frame as a load would stream it. One thread.
#include <chrono>

#include "client/cli/recording/recorded_input.h"
#include "client/cli/recording/replay_run.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace warmfront;
using namespace warmfront::client;
using fuzz::expect;

bool names_the_file(const Error& error, const std::string& path) {
  return error.code == ErrorCode::kInvalidArgument && error.message.starts_with(path + ": ");
}

// A step with a separation of 2^-1000 may take seconds here, where the sanitizers watch each long integer. Many
// such steps are a long recording, not a fault; one step must end in the time that a fuzzer allows.
class Enough {};

void check_replay(const std::string& path) {
  Result<RecordedSession> recorded = RecordedSession::open(path);
  if (!recorded)
    return expect(names_the_file(recorded.error(), path), "a bad recording is named with the byte");
  const auto target = make_engine_target(recorded.value(), 1);
  if (!target)
    return expect(target.error().code == ErrorCode::kInvalidArgument,
                  "a scene is taken, or refused as bad input");
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(2);
  const auto result = replay(recorded.value(), *target.value(), [until](std::uint64_t) {
    if (std::chrono::steady_clock::now() > until) throw Enough();
  });
  if (!result) return expect(!result.error().message.empty(), "a replay that ends says why");
  expect(result.value().difference.empty() || result.value().compared > 0, "a difference is of an outcome");
}

void check_input(const std::string& path) {
  const auto scene = open_recorded_scene(path);
  if (!scene) return expect(names_the_file(scene.error(), path), "what is no load is named with the file");
  Input& input = *scene.value().input;
  PositionBuffer positions;
  for (std::uint32_t i = 0; i < input.frame_count(); ++i) {
    expect(input.read_frame(i, positions).ok(), "each frame can be read");
    expect(vertex_count(positions) == input.scene().vertex_count, "a frame has all vertices");
  }
  expect(input.frame_count() >= 2, "an input has two frames");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::MemoryFile file({reinterpret_cast<const char*>(data), size});
  try {
    check_replay(file.path());
  } catch (const Enough&) {
  }
  check_input(file.path());
  return 0;
}
