// SPDX-License-Identifier: Apache-2.0
// What of a recording nothing can be replayed of: a frame, or all of it.
#include "client/cli/recording/from_wire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "client/cli/recording/recorded_session.h"
#include "proto/recording/writer.h"
#include "tests/unit/client/temporary_folder.h"

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

TEST(RecordedSession, ThatWasStoppedBeforeOrWithinItsUploadSaysSo) {
  const TemporaryFolder folder;
  for (const char* when : {"before", "within"}) {
    const std::string path = folder.file(when);
    {
      const auto writer = recording::Writer::create(path, "test").value();
      v1::RecordedMessage upload;
      upload.mutable_create()->mutable_header()->set_face_count(7);
      if (when == std::string("within")) writer->write(std::move(upload));
      writer->stop("the bound is met");
    }
    EXPECT_THAT(
        RecordedSession::open(path).error().message,
        ::testing::HasSubstr(when + std::string(" the upload, and has nothing to replay: the bound is met")));
  }
}

}  // namespace
}  // namespace warmfront::client
