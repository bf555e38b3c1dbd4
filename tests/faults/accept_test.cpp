// SPDX-License-Identifier: Apache-2.0
// Connections while the process has no files left, and another thread takes the one that was set aside for
// them.
#include "server/process/accept.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <vector>

#include "tests/unit/server/local_daemon.h"

namespace {

// Another thread at the worst moment: takes a descriptor as soon as it is closed.
std::atomic<bool> snatching{false};
std::atomic<int> snatched{-1};

}  // namespace

extern "C" int close(int file) {
  const int result = static_cast<int>(syscall(SYS_close, file));
  if (snatching.exchange(false)) snatched = open("/dev/null", O_RDONLY | O_CLOEXEC);
  return result;
}

namespace warmfront::test {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kLooksNeedFiles = true;
#else
constexpr bool kLooksNeedFiles = false;
#endif

/// A listening Unix socket, and as few files as are open.
class AcceptTest : public ::testing::Test {
 protected:
  AcceptTest() {
    address_.sun_family = AF_UNIX;
    const std::string path = folder_.path() / "s";
    path.copy(address_.sun_path, sizeof address_.sun_path - 1);
    listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address_), sizeof address_), 0);
    EXPECT_EQ(listen(listener_, 8), 0);
    server::refuse_connections_without_files();
    for (int i = 0; i < 3; ++i) clients_.push_back(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    getrlimit(RLIMIT_NOFILE, &before_);
    // The lowest file that is free is the first that is not allowed.
    const int next = dup(listener_);
    rlimit few = before_;
    few.rlim_cur = static_cast<rlim_t>(next);
    close(next);
    if (!kLooksNeedFiles) setrlimit(RLIMIT_NOFILE, &few);
  }
  ~AcceptTest() override {
    setrlimit(RLIMIT_NOFILE, &before_);
    for (const int client : clients_) close(client);
    close(listener_);
  }

  bool connect(int client) const {
    return ::connect(client, reinterpret_cast<const sockaddr*>(&address_), sizeof address_) == 0;
  }
  int accept() const { return accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC); }
  /// Whether the other side has closed the connection.
  static bool refused(int client) {
    char byte = 0;
    return recv(client, &byte, 1, MSG_DONTWAIT) == 0;
  }

  const TemporaryFolder folder_;
  sockaddr_un address_{};
  int listener_ = -1;
  std::vector<int> clients_;
  rlimit before_{};
};

TEST_F(AcceptTest, AFileLostToAnotherThreadIsTakenBack) {
  if (kLooksNeedFiles) GTEST_SKIP() << "the sanitizer needs a file for each look at an object's type";
  const std::uint64_t before = server::connections_without_files();
  ASSERT_TRUE(connect(clients_[0]));
  EXPECT_EQ(accept(), -1);
  EXPECT_EQ(errno, EAGAIN);
  EXPECT_TRUE(refused(clients_[0])) << "by means of the file set aside";
  EXPECT_EQ(server::connections_without_files(), before + 1) << "for the log";

  ASSERT_TRUE(connect(clients_[1]));
  snatching = true;
  EXPECT_EQ(accept(), -1);
  EXPECT_EQ(errno, EAGAIN);
  ASSERT_GE(snatched, 0);
  EXPECT_FALSE(refused(clients_[1])) << "nothing can be done as long as there is no file";
  server::refuse_connections_left_waiting();
  EXPECT_FALSE(refused(clients_[1]));

  close(snatched);
  server::refuse_connections_left_waiting();
  EXPECT_TRUE(refused(clients_[1])) << "the client is told as soon as a file is free";
  ASSERT_TRUE(connect(clients_[2]));
  EXPECT_EQ(accept(), -1);
  EXPECT_TRUE(refused(clients_[2])) << "and a file is set aside again";
}

}  // namespace
}  // namespace warmfront::test
