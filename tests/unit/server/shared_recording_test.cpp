// SPDX-License-Identifier: Apache-2.0
// What a recording has of frames that came by shared memory.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "proto/recording/reader.h"
#include "tests/unit/server/packet_client.h"
#include "tests/unit/server/shared_memory_fixture.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::test {
namespace {

class SharedRecordingTest : public SharedMemoryTest {
 protected:
  SharedRecordingTest() : SharedMemoryTest(config()) {}
  static server::Config config() {
    server::Config config;
    config.record_dir = folder().path();
    return config;
  }
  static const TemporaryFolder& folder() {
    static const TemporaryFolder folder;
    return folder;
  }
};

// The refused one would replay as one that is answered, were it recorded without what it was refused for.
TEST_F(SharedRecordingTest, HasWhatWasTakenAndWhatAFrameWasRefusedFor) {
  ASSERT_TRUE(create().ok());
  {
    AttachedStream attached(*stub_, kId);
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
    v1::StreamStepsRequest both = put(packets, 1);
    both.mutable_step()->set_positions(frame(1));
    expect_refused(packets, both, "give either");
    ASSERT_TRUE(packets.send(put(packets, 1)));
    ASSERT_TRUE(packets.receive());
  }
  daemon_.stop();  // all is written by then
  std::vector<v1::RecordedMessage> steps;
  for (const auto& file : std::filesystem::directory_iterator(folder().path())) {
    recording::Reader reader = recording::Reader::open(file.path()).value();
    for (auto record = reader.next(); record.ok() && record.value(); record = reader.next())
      if (record.value()->has_step()) steps.push_back(*std::move(record).value());
  }
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_TRUE(steps[0].step().has_shared_positions());
  EXPECT_EQ(steps[0].step().positions(), frame(1));
  EXPECT_FALSE(steps[1].step().has_shared_positions() || steps[1].step().has_answer_room());
  EXPECT_EQ(steps[1].step().positions(), frame(1));
}

}  // namespace
}  // namespace warmfront::test
