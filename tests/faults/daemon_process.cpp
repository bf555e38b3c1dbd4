// SPDX-License-Identifier: Apache-2.0
// Starting, watching and ending the daemon. Thread safety as stated in the header.
#include "tests/faults/daemon_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>
#include <utility>

extern char** environ;

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (std::string& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

}  // namespace

DaemonProcess::DaemonProcess(std::vector<std::string> flags, std::vector<std::string> environment,
                             std::string log)
    : flags_(std::move(flags)),
      environment_(std::move(environment)),
      log_(log.empty() ? (folder_.path() / "log").string() : std::move(log)) {
  start();
}

DaemonProcess::~DaemonProcess() {
  if (pid_ > 0) kill_hard();
  // A sanitizer's report stays in the log, and after a kill no exit status tells of it.
  if (!log_.starts_with(folder_.path().string())) return;
  const std::string text = log();
  EXPECT_EQ(text.find("Sanitizer:"), std::string::npos) << text;
}

std::string DaemonProcess::socket() const {
  return "unix:" + (folder_.path() / "d.sock").string();
}

std::string DaemonProcess::log() const {
  std::stringstream text;
  text << std::ifstream(log_).rdbuf();
  return text.str();
}

int DaemonProcess::port() const {
  return port_after("\"listening\",\"address\":\"127.0.0.1:");
}
int DaemonProcess::metrics_port() const {
  return port_after("\"metrics_listening\",\"address\":\"127.0.0.1:");
}

int DaemonProcess::port_after(const std::string& marker) const {
  for (int i = 0; i < 1000; ++i) {
    const std::string text = log();
    const std::size_t at = text.rfind(marker);
    if (at != std::string::npos && text.find('\n', at) != std::string::npos)
      return std::stoi(text.substr(at + marker.size()));
    std::this_thread::sleep_for(10ms);
  }
  return -1;
}

void DaemonProcess::start() {
  std::vector<std::string> arguments{WARMFRONTD,     "--listen", socket(),    "--listen", "127.0.0.1:0",
                                     "--log-format", "json",     "--threads", "2"};
  if (std::ranges::count(flags_, "--transport-memory") == 0)
    arguments.insert(arguments.end(), {"--transport-memory", "64MiB"});
  for (const std::string& flag : flags_) arguments.push_back(flag);
  std::vector<std::string> environment = environment_;
  for (char** variable = environ; *variable != nullptr; ++variable) environment.emplace_back(*variable);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 2, log_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ASSERT_EQ(posix_spawn(&pid_, WARMFRONTD, &actions, nullptr, pointers(arguments).data(),
                        pointers(environment).data()),
            0);
  posix_spawn_file_actions_destroy(&actions);
}

std::size_t DaemonProcess::status_bytes(const char* field) const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  std::size_t kibibytes = 0;
  for (std::string word; status >> word;)
    if (word == field) status >> kibibytes;
  return kibibytes << 10;
}

std::size_t DaemonProcess::resident_bytes() const {
  return status_bytes("VmRSS:");
}
std::size_t DaemonProcess::peak_bytes() const {
  return status_bytes("VmHWM:");
}

std::size_t DaemonProcess::data_bytes() const {
  return status_bytes("VmData:");
}

std::string DaemonProcess::threads() const {
  std::ostringstream text;
  std::error_code gone;
  for (const auto& task :
       std::filesystem::directory_iterator("/proc/" + std::to_string(pid_) + "/task", gone)) {
    std::string stat, waits_in;
    std::getline(std::ifstream(task.path() / "stat"), stat);
    std::ifstream(task.path() / "wchan") >> waits_in;
    // The name, in parentheses, may have blanks: fields are counted from its end (proc(5)).
    const std::size_t open = stat.find('('), close = stat.rfind(')');
    if (close == std::string::npos) continue;
    std::istringstream rest(stat.substr(close + 1));
    const std::vector<std::string> fields{std::istream_iterator<std::string>(rest), {}};
    constexpr std::size_t kState = 0, kUser = 11, kSystem = 12, kNice = 16;
    if (fields.size() <= kNice) continue;
    const double ticks = std::stod(fields[kUser]) + std::stod(fields[kSystem]);
    text << "  " << stat.substr(open + 1, close - open - 1) << " " << fields[kState] << ", nice "
         << fields[kNice] << ", " << ticks / static_cast<double>(sysconf(_SC_CLK_TCK)) << " s, " << waits_in
         << "\n";
  }
  return text.str();
}

std::size_t DaemonProcess::open_files() const {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry :
       std::filesystem::directory_iterator("/proc/" + std::to_string(pid_) + "/fd"))
    ++count;
  return count;
}

void DaemonProcess::limit(int resource, std::size_t value) const {
  rlimit wanted{};
  ASSERT_EQ(prlimit(pid_, static_cast<__rlimit_resource>(resource), nullptr, &wanted), 0);
  wanted.rlim_cur = value;
  ASSERT_EQ(prlimit(pid_, static_cast<__rlimit_resource>(resource), &wanted, nullptr), 0);
}

void DaemonProcess::terminate() const {
  for (int i = 0; i < 1000 && !hears(SIGTERM); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  kill(pid_, SIGTERM);
}

// A thread that waits for a signal does not block it meanwhile: any thread that blocks it inherited that from
// the first, before which there is only one.
bool DaemonProcess::hears(int signal) const {
  std::error_code gone;
  for (const auto& task :
       std::filesystem::directory_iterator("/proc/" + std::to_string(pid_) + "/task", gone)) {
    std::ifstream status(task.path() / "status");
    std::string word, mask;
    while (status >> word) {
      if (word != "SigBlk:" && word != "SigCgt:") continue;
      status >> mask;
      if ((std::stoull(mask, nullptr, 16) >> (signal - 1) & 1U) != 0) return true;
    }
  }
  return false;
}

void DaemonProcess::kill_hard() {
  kill(pid_, SIGKILL);
  wait();
}

bool DaemonProcess::running() const {
  siginfo_t state{};
  return pid_ > 0 && waitid(P_PID, static_cast<id_t>(pid_), &state, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         state.si_pid == 0;
}

bool DaemonProcess::ends_within(std::chrono::seconds patience) const {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (running() && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(10ms);
  return !running();
}

int DaemonProcess::wait() {
  int status = 0;
  for (int i = 0; i < 6000; ++i) {
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      return status;
    }
    std::this_thread::sleep_for(10ms);
  }
  return -1;
}

}  // namespace warmfront::test
