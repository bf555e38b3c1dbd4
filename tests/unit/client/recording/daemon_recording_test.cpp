// SPDX-License-Identifier: Apache-2.0
// What bounds a recording of a daemon, and what leaves none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "client/cli/recording/recorded_input.h"
#include "client/lib/client.h"
#include "proto/recording/reader.h"
#include "proto/recording/writer.h"
#include "tests/unit/server/heap.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

using test::Heap;
using ::testing::HasSubstr;

/// A daemon that records into a folder, and its client.
struct RecordingDaemon {
  explicit RecordingDaemon(std::size_t most_bytes = server::Config().record_max_bytes)
      : config(recording_into(folder, most_bytes)) {}
  static server::Config recording_into(const test::TemporaryFolder& folder, std::size_t most_bytes) {
    server::Config config;
    config.record_dir = folder.path();
    config.record_max_bytes = most_bytes;
    return config;
  }

  const test::TemporaryFolder folder;
  server::Config config;
  test::LocalDaemon daemon{config};
  Client client = Client::connect(daemon.address()).value();
};

TEST(DaemonRecording, StopsAtItsBoundAndTheSessionGoesOn) {
  RecordingDaemon recording(64 << 10);
  auto& [folder, config, daemon, client] = recording;
  Heap<double> heap;
  {
    Session session = client.create_session(heap.description, std::span<const double>(heap.x)).value();
    for (int k = 1; k <= 200; ++k) ASSERT_TRUE(session.step(std::span<const double>(heap.x)).ok());
    // Of what is left some may begin still; in the end there is no room for that either.
    for (int k = 0; k < 8; ++k) {
      Session another = client.create_session(heap.description, std::span<const double>(heap.x)).value();
      ASSERT_TRUE(another.step(std::span<const double>(heap.x)).ok());
    }
  }
  daemon.stop();  // all is written by then
  EXPECT_THAT(daemon.log(), HasSubstr("recording_stopped"));
  EXPECT_THAT(daemon.log(), HasSubstr("recording_refused"));
  std::uintmax_t bytes = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder.path()))
    if (file.path().extension() == ".wfrec") bytes += file.file_size();
  EXPECT_GT(bytes, 0u);
  EXPECT_LE(bytes, config.record_max_bytes);
}

// Between before and after a placement nothing moves: as a sequence of frames it would be a motion.
TEST(DaemonRecording, OfAPlacementIsNoSequenceOfFrames) {
  RecordingDaemon recording;
  Client& client = recording.client;
  Heap<double> heap;
  const std::span<const double> x(heap.x);
  for (const bool places : {false, true}) {
    Session session = client.create_session(heap.description, x).value();
    ASSERT_TRUE(session.step(x).ok());
    if (places) {
      ASSERT_TRUE(session.place(x).ok());
    }
    ASSERT_TRUE(session.step(x).ok());
  }
  recording.daemon.stop();
  std::vector<std::string> told;
  for (const auto& file : std::filesystem::directory_iterator(recording.folder.path())) {
    const auto scene = open_recorded_scene(file.path());
    told.push_back(scene ? "" : scene.error().message);
  }
  EXPECT_THAT(told, ::testing::UnorderedElementsAre("", HasSubstr("frame 2 is no motion: it is placed")));
}

TEST(DaemonRecording, AnUploadThatFailsLeavesNoFileAndABadFolderNoDaemon) {
  RecordingDaemon recording;
  auto& [folder, config, daemon, client] = recording;
  Heap<double> heap;
  heap.description.faces[0] = {0, 1, 1'000'000};
  EXPECT_FALSE(client.create_session(heap.description, std::span<const double>(heap.x)).ok());
  daemon.stop();  // all is done by then
  for (const auto& file : std::filesystem::directory_iterator(folder.path()))
    EXPECT_NE(file.path().extension(), ".wfrec");
  config.record_dir = folder.path() / "none";
  config.listen = {"unix:" + (folder.path() / "other.sock").string()};
  std::ostringstream text;
  server::Log log(server::LogLevel::kInfo, server::LogFormat::kText, &text);
  const auto started = server::Daemon::start(config, log);
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message, HasSubstr("record-dir"));
}

}  // namespace
}  // namespace warmfront::client
