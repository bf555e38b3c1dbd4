// SPDX-License-Identifier: Apache-2.0
// Fault table, row 23 again: no files left where memory would be shared.
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>

#include "client/lib/client.h"
#include "tests/faults/fault_table.h"
#include "tests/unit/server/answer_hash.h"

namespace warmfront::test {
namespace {

/// The number that a file gets which is opened now, if `more` others are opened before it.
std::size_t next_file(pid_t process, std::size_t more = 0) {
  std::set<std::size_t> open;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/fd"))
    open.insert(std::stoul(entry.path().filename().string()));
  for (std::size_t number = 0;; ++number)
    if (!open.contains(number) && more-- == 0) return number;
}

bool shares_memory(pid_t process) {
  std::stringstream maps;
  maps << std::ifstream("/proc/" + std::to_string(process) + "/maps").rdbuf();
  return maps.str().find("/memfd:") != std::string::npos;
}

/// Steps of a new session have the right answers.
void expect_steps(client::Session& session, const MovingGrids& grids) {
  const std::vector<std::uint64_t> expected = local_hashes(grids, 0, 3);
  for (std::uint64_t k = 1; k <= 3; ++k) {
    const std::vector<double> next = grids.positions(k);
    const auto answer = session.step(Frame(std::span<const double>(next)));
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(test::hash_of(answer.value()), expected[k - 1]);
  }
}

// Found by a user: the signal that the system sends where a file would exceed the limit ended the daemon.
TEST_F(FaultTable, Row23_FilesMayNotGrowToShareMemory) {
  daemon_->limit(RLIMIT_FSIZE, 4096);
  client::Client client = client::Client::connect(daemon_->socket()).value();
  client::Session session =
      client.create_session(grids_.scene(), std::span<const double>(grids_.positions(0))).value();
  ASSERT_NO_FATAL_FAILURE(expect_steps(session, grids_));
  EXPECT_FALSE(shares_memory(daemon_->pid()));
}

TEST_F(FaultTable, Row23_NoFilesLeftToShareMemory) {
  if (kSanitized)
    GTEST_SKIP() << "the sanitizer opens a pipe to check an object, and reports it broken where it cannot";
  allowed_peak_ = 128 * kMiB;
  client::Client client = client::Client::connect(daemon_->socket()).value();
  // One at a time: each is the only one that could share anything. Its streams find their connection there.
  const auto steps_of_a_new_session = [&](bool shared) {
    client::Session session =
        client.create_session(grids_.scene(), std::span<const double>(grids_.positions(0))).value();
    ASSERT_NO_FATAL_FAILURE(expect_steps(session, grids_));
    EXPECT_EQ(shares_memory(daemon_->pid()), shared);
    EXPECT_TRUE(session.close().ok());
  };
  steps_of_a_new_session(true);
  const std::size_t usual = daemon_->open_files() + 1000;
  for (const std::size_t left : {0, 1}) {  // not even the connection of packets; that, and no memory
    SCOPED_TRACE(left);
    daemon_->limit(RLIMIT_NOFILE, next_file(daemon_->pid(), left));
    steps_of_a_new_session(false);
    step_untouched();
    daemon_->limit(RLIMIT_NOFILE, usual);
  }
  // With files to spare again, memory is shared again, once the daemon has looked.
  for (int i = 0; i < 1000; ++i) {
    client::Session session =
        client.create_session(grids_.scene(), std::span<const double>(grids_.positions(0))).value();
    const std::vector<double> next = grids_.positions(1);
    ASSERT_TRUE(session.step(Frame(std::span<const double>(next))).ok());
    if (shares_memory(daemon_->pid())) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  FAIL() << "no memory is shared any more";
}

}  // namespace
}  // namespace warmfront::test
