// SPDX-License-Identifier: Apache-2.0
// Configuration files: what is no regular file, or too large, is refused, and one that is being written is
// read whole.
#include "server/process/small_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <string>
#include <thread>

#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;

TEST(SmallFileTest, DevicesPipesAndEndlessFilesAreRefused) {
  using server::read_small_file;
  const TemporaryFolder folder;
  const std::string pipe = (folder.path() / "pipe").string(), large = (folder.path() / "large").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {std::string("/dev/zero"), std::string("/dev/null"), pipe, std::string("/")})
    EXPECT_THAT(read_small_file("config", path).error().message, HasSubstr("a regular file is expected"))
        << path;
  EXPECT_THAT(read_small_file("config", "/nonexistent").error().message,
              HasSubstr("config /nonexistent: it cannot be read (No such file"));
  std::ofstream(large) << std::string(2 << 20, ' ');
  EXPECT_THAT(read_small_file("token-file", large).error().message, HasSubstr("at most 1048576 bytes"));
}

TEST(SmallFileTest, AFileThatIsBeingWrittenIsReadWhole) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "tokens").string();
  // Half of the file is written, and the writer continues.
  std::atomic<bool> begun{false};
  std::thread writer([&] {
    std::ofstream file(path);
    for (int piece = 0; piece < 20; ++piece) {
      file << "0123456789abcdef" << piece << " p" << piece << "\n" << std::flush;
      begun = true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  while (!begun) std::this_thread::yield();
  const Result<std::string> text = server::read_small_file("token-file", path);
  writer.join();
  // Whole, unless the machine paused the writer for longer than the reader waits.
  if (text.ok()) {
    EXPECT_EQ(text.value().back(), '\n');
  } else {
    EXPECT_EQ(text.error().code, ErrorCode::kUnavailable);
  }
}

}  // namespace
}  // namespace warmfront::test
