// SPDX-License-Identifier: Apache-2.0
// What verbs leave that fail or are ended by a signal: nothing half written, and what was there before.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

extern char** environ;

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// `warmfront` with its stdout in a pipe, of which nothing is read before read_until().
class Running {
 public:
  explicit Running(std::vector<std::string> arguments, const std::string& stderr_file = "/dev/null") {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
    output_ = ends[0];
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, stderr_file.c_str(), O_WRONLY | O_CREAT, 0600);
    // Whoever runs the tests in the background, or under nohup, has these ignored.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t signals;
    sigemptyset(&signals);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) sigaddset(&signals, number);
    posix_spawnattr_setsigdefault(&attributes, &signals);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    arguments.insert(arguments.begin(), WARMFRONT_BINARY);
    std::vector<char*> words;
    for (std::string& word : arguments) words.push_back(word.data());
    words.push_back(nullptr);
    EXPECT_EQ(posix_spawn(&process_, words[0], &actions, &attributes, words.data(), environ), 0);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
  }
  ~Running() { ::close(output_); }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  void read_until(std::size_t bytes) {
    while (text_.size() < bytes && read_more()) {
    }
  }
  void signal(int number) const { ::kill(process_, number); }
  /// The signal that ended it; 0 where it ended by itself. The rest of its output is read first.
  int ended_by() {
    while (read_more()) {
    }
    int status = 0;
    EXPECT_EQ(::waitpid(process_, &status, 0), process_);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  }
  const std::string& text() const { return text_; }

 private:
  bool read_more() {
    std::array<char, 4096> block;
    const ssize_t got = ::read(output_, block.data(), block.size());
    if (got > 0) text_.append(block.data(), static_cast<std::size_t>(got));
    return got > 0;
  }

  pid_t process_ = 0;
  int output_ = -1;
  std::string text_;
};

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

constexpr const char* kLong = "builtin:cloth-ball?triangles=4000&frames=2000";

TEST(CliInterrupt, WhatIsThereStaysWholeAndNothingElseIsLeft) {
  for (const auto& [number, name] : {std::pair{SIGINT, "c.csv"}, {SIGTERM, "c.jsonl"}, {SIGHUP, "c.vtp"}}) {
    SCOPED_TRACE(name);
    const TemporaryFolder folder, said;
    const std::string file = folder.write(name, "mine\n");
    Running detect({"detect", kLong, "--contacts", file}, said.file("stderr"));
    detect.read_until(500);
    EXPECT_EQ(names_in(folder.path()).size(), 2u) << "what is written is beside it";
    detect.signal(number);
    EXPECT_EQ(detect.ended_by(), number);
    EXPECT_EQ(folder.read(name), "mine\n");
    EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{name});
    EXPECT_EQ(detect.text().back(), '\n') << "the table's rows are whole";
    EXPECT_THAT(said.read("stderr"), HasSubstr(std::string("warmfront: ended by SIG") + sigabbrev_np(number) +
                                               "; not written: " + file + "\n"));
  }
}

TEST(CliInterrupt, WhatAKilledProcessLeavesTheNextOneRemoves) {
  const TemporaryFolder folder;
  const std::string file = folder.file("c.csv");
  const std::vector<std::string> words{"detect", kLong, "--contacts", file};
  Running killed(words), other(words);
  killed.read_until(500);
  other.read_until(500);
  killed.signal(SIGKILL);
  EXPECT_EQ(killed.ended_by(), SIGKILL);
  EXPECT_EQ(names_in(folder.path()).size(), 2u);
  fs::create_directory(folder.file(".c.csv.mine"));
  fs::create_directory(folder.file(".c.csv.backup"));
  folder.write(".c.csv.backup/c.csv", "mine\n");
  EXPECT_EQ(run("detect 'builtin:cloth-ball?triangles=1000&frames=3' --contacts " + file).code, 0);
  EXPECT_EQ(names_in(folder.path()).size(), 4u) << "the other one's, and what are no folders of ours, stay";
  const std::string written = folder.read("c.csv");
  EXPECT_FALSE(written.empty());
  other.signal(SIGINT);
  EXPECT_EQ(other.ended_by(), SIGINT);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{".c.csv.backup", ".c.csv.mine", "c.csv"}));
  EXPECT_EQ(folder.read(".c.csv.backup/c.csv"), "mine\n");
  EXPECT_EQ(folder.read("c.csv"), written);
}

TEST(CliInterrupt, RowsOnStdoutAreWhole) {
  for (const int number : {SIGINT, SIGTERM}) {
    Running detect({"detect", "builtin:cloth-ball?triangles=4000&frames=60", "--contacts", "-", "--fields",
                    "weights,points", "--min-separation", "0.05"});
    detect.read_until(4096);
    // The pipe is full by now, or soon: the process is in the middle of a block of rows.
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    detect.signal(number);
    EXPECT_EQ(detect.ended_by(), number);
    const std::string& text = detect.text();
    ASSERT_FALSE(text.empty());
    EXPECT_EQ(text.back(), '\n');
    const std::string last = text.substr(text.rfind('\n', text.size() - 2) + 1);
    EXPECT_EQ(std::ranges::count(last, ','), std::ranges::count(text.substr(0, text.find('\n')), ','))
        << last;
  }
}

TEST(CliInterrupt, AReaderThatLeavesEndsItTidily) {
  const TemporaryFolder folder;
  // Often, because a row may follow at once: it found the pipe closed, too, and ended the process.
  for (int i = 0; i < 20; ++i) {
    const Outcome outcome =
        run("detect '" + std::string(kLong) + "' --contacts " + folder.file("c.csv"), "2>&1 | head -2");
    EXPECT_EQ(outcome.code, 0) << "of head";
    EXPECT_THAT(outcome.out, HasSubstr("frame"));
    ASSERT_EQ(names_in(folder.path()), std::vector<std::string>());
  }
}

TEST(CliInterrupt, AMergeLeavesNothingBeside) {
  const TemporaryFolder folder;
  for (const std::string range : {"0:2", "2:4"}) {
    const std::string stem = folder.file(range.substr(0, 1));
    ASSERT_EQ(run("detect 'builtin:cloth-ball?triangles=1000&frames=5' --frames " + range + " --json " +
                  stem + ".json --contacts " + stem + ".csv")
                  .code,
              0);
  }
  // A part of the contacts that does not come.
  fs::remove(folder.file("2.csv"));
  ASSERT_EQ(mkfifo(folder.file("2.csv").c_str(), 0600), 0);
  Running merge(
      {"merge", folder.file("0.json"), folder.file("2.json"), "--contacts", folder.file("all.csv")});
  while (names_in(folder.path()).size() < 5) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  merge.signal(SIGTERM);
  EXPECT_EQ(merge.ended_by(), SIGTERM);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"0.csv", "0.json", "2.csv", "2.json"}));
}

/// A scene of which the last of five frames has a coordinate that is no number.
class CliFailure : public ::testing::Test {
 protected:
  CliFailure() {
    EXPECT_EQ(run("scene cloth-ball --triangles 1000 --frames 5 --out " + folder_.file("in")).code, 0);
    std::fstream cache(folder_.file("in/frames.pc2"), std::ios::in | std::ios::out | std::ios::binary);
    const std::uint32_t no_number = 0x7fc00000;
    cache.seekp(-4, std::ios::end);
    cache.write(reinterpret_cast<const char*>(&no_number), sizeof no_number);
    fs::create_directory(out());
  }
  std::string out() const { return folder_.file("out"); }
  Outcome detect(const std::string& more) const { return run("detect " + folder_.file("in") + " " + more); }

  TemporaryFolder folder_;
};

TEST_F(CliFailure, LeavesNoPartOfItsOutputs) {
  for (const std::string name : {"c.csv", "c.jsonl", "c.vtp"}) {
    SCOPED_TRACE(name);
    const std::string file = out() + "/" + name;
    const Outcome outcome = detect("--contacts " + file + " --meshes " + out() + "/m.vtp");
    EXPECT_EQ(outcome.code, 2);
    EXPECT_THAT(outcome.out, HasSubstr("is not a number"));
    EXPECT_EQ(names_in(out()), std::vector<std::string>());
    folder_.write("out/" + name, "mine\n");
    EXPECT_EQ(detect("--contacts " + file).code, 2);
    EXPECT_EQ(names_in(out()), std::vector<std::string>{name});
    EXPECT_EQ(folder_.read("out/" + name), "mine\n");
    fs::remove(file);
  }
}

TEST_F(CliFailure, ARecordingOfFramesStaysAndOneOfNoneDoesNot) {
  const std::string recording = out() + "/r.wfrec";
  const Outcome outcome = detect("--record " + recording + " --contacts /nonexistent/c.csv");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.out, HasSubstr("/nonexistent/c.csv"));
  EXPECT_EQ(names_in(out()), std::vector<std::string>());
  EXPECT_EQ(detect("--record " + recording).code, 2);
  const Outcome again = run("replay " + recording + " --in-process");
  EXPECT_EQ(again.code, 0) << again.out;
  EXPECT_THAT(again.out, HasSubstr("4 steps and 0 changes, 4 outcomes compared, all equal"));
}

TEST_F(CliFailure, AFileThatMayNotBeWrittenIsNotReplaced) {
  const std::string file = folder_.write("out/c.csv", "mine\n");
  fs::permissions(folder_.path(), fs::perms::all);
  fs::permissions(out(), fs::perms::all);
  fs::permissions(file, fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read);
  // Whoever may write everything is somebody else for this.
  const std::string as = ::geteuid() == 0 ? "setpriv --reuid=65534 --clear-groups " : "";
  const Outcome outcome =
      test::run_command(as + WARMFRONT_BINARY +
                        " detect 'builtin:cloth-ball?triangles=1000&frames=3' --contacts " + file + " 2>&1");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.out, HasSubstr(file + ": cannot write: Permission denied"));
  EXPECT_EQ(folder_.read("out/c.csv"), "mine\n");
  EXPECT_EQ(names_in(out()), std::vector<std::string>{"c.csv"});
}

TEST_F(CliFailure, PermissionsOfWhatIsReplacedStay) {
  const std::string file = folder_.write("out/c.csv", "old\n");
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(run("detect 'builtin:cloth-ball?triangles=1000&frames=3' --contacts " + file).code, 0);
  EXPECT_THAT(folder_.read("out/c.csv"), HasSubstr("frame,type,v0,v1,v2,v3,toi,status\n"));
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

}  // namespace
}  // namespace warmfront::client
