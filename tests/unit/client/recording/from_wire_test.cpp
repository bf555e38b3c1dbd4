// SPDX-License-Identifier: Apache-2.0
// A recorded frame as the engine takes it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/cli/recording/from_wire.h"

namespace warmfront::client {
namespace {

// The daemon records what it took from there in its place: a frame that names it still was refused.
TEST(WireFrame, OfSharedMemoryIsRefusedAsTheDaemonDid) {
  SceneDescription description;
  description.vertex_count = 1;
  const Scene scene = Scene::create(description).value();
  v1::StepFrame step;
  step.set_positions(std::string(24, '\0'));
  const auto read = [&] { return WireFrame::read(std::vector{step}, false, scene); };
  ASSERT_TRUE(read().ok());
  step.mutable_shared_positions();
  EXPECT_THAT(read().error().message, ::testing::HasSubstr("shared memory"));
  step.clear_shared_positions();
  step.mutable_answer_room();
  EXPECT_EQ(read().error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace warmfront::client
