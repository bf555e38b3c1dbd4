// SPDX-License-Identifier: Apache-2.0
// The fixture of the fault table. Thread safety as stated in the header.
#include "tests/faults/fault_table.h"

#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <utility>

namespace warmfront::test {
namespace {

constexpr const char* kBudget = "WARMFRONT_P99_BUDGET";

double percentile(const std::vector<double>& sorted, std::size_t percent) {
  return sorted[(sorted.size() - 1) * percent / 100];
}

}  // namespace

void FaultTable::begin(std::vector<std::string> flags, std::vector<std::string> environment,
                       std::string log) {
  daemon_.reset();
  daemon_.emplace(std::move(flags), std::move(environment), std::move(log));
  connect(daemon_->socket());
  untouched_frame_ = 0;
  begin_untouched();
}

void FaultTable::begin_untouched() {
  ASSERT_EQ(health_at_start(), 1) << daemon_->log();
  v1::SessionHeader wanted = header(kUntouched);
  wanted.set_first_frame(untouched_frame_);
  ASSERT_TRUE(create(wanted, faces(), frame(untouched_frame_)).ok());
  step_untouched();
  resident_before_ = daemon_->resident_bytes();
}

void FaultTable::step_untouched() {
  // Under load gRPC may close an idle connection (GOAWAY), and a call that begins just then fails: a client
  // tries again, as ours do, and there is one answer to a frame.
  v1::StepResponse response;
  grpc::Status status;
  for (int attempt = 0; attempt < 10; ++attempt) {
    response.Clear();
    status = step(untouched_frame_ + 1, frame(untouched_frame_ + 1), &response, kUntouched);
    // And one that it has no memory for, it resets (ENHANCE_YOUR_CALM).
    const bool reset = status.error_message().starts_with("Received RST_STREAM");
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE && !reset) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  ASSERT_TRUE(status.ok()) << "the untouched session: " << status.error_message();
  EXPECT_EQ(hash_of(response.contacts()),
            local_hashes(grids_, untouched_frame_, untouched_frame_ + 1).front());
  EXPECT_GT(response.summary().rows(), 0U) << "a test without contacts shows nothing";
  ++untouched_frame_;
}

std::vector<double> FaultTable::time_steps(int count, const std::function<bool()>& enough) {
  std::vector<double> took;
  for (int i = 0; (i < count || !enough()) && !HasFatalFailure(); ++i) {
    // Of what lasts for seconds, some hundred steps a second tell enough.
    if (i >= count) std::this_thread::sleep_for(std::chrono::milliseconds(8));
    const auto start = std::chrono::steady_clock::now();
    step_untouched();
    took.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::ranges::sort(took);
  return took;
}

void FaultTable::steps_alone() {
  if (std::getenv(kBudget) == nullptr) return;
  alone_ = time_steps(1000);
  print_steps("nothing", alone_);
  std::atomic<bool> ended{false};
  std::vector<std::thread> computing;
  for (unsigned i = 0; i < std::thread::hardware_concurrency(); ++i)
    computing.emplace_back([&ended] {
      while (!ended.load(std::memory_order_relaxed)) {
      }
    });
  print_steps("threads of another process that compute, one a core", time_steps(1000));
  ended = true;
  for (std::thread& thread : computing) thread.join();
}

void FaultTable::steps_beside(const char* what, int count, const std::function<bool()>& enough) {
  const std::vector<double> took = time_steps(count, enough);
  print_steps(what, took);
  const char* const budget = std::getenv(kBudget);
  if (budget == nullptr || alone_.empty() || took.empty()) return;
  EXPECT_LE(percentile(took, 99) / percentile(alone_, 99), std::stod(budget)) << what;
}

void FaultTable::print_steps(const char* what, const std::vector<double>& took) const {
  if (took.empty()) return;
  std::printf("%s: %zu steps beside it, p50 %.2f ms, p99 %.2f ms, worst %.1f ms; %.1f MiB resident", what,
              took.size(), percentile(took, 50), percentile(took, 99), took.back(),
              static_cast<double>(daemon_->resident_bytes()) / kMiB);
  if (!alone_.empty() && &took != &alone_)
    std::printf("; p50 %.2f, p99 %.2f times that beside nothing",
                percentile(took, 50) / percentile(alone_, 50), percentile(took, 99) / percentile(alone_, 99));
  std::printf("\n");
}

void FaultTable::TearDown() {
  if (IsSkipped()) return;
  // For the reader of a failure.
  const auto print_threads = [this] { std::printf("the daemon's threads:\n%s", daemon_->threads().c_str()); };
  if (HasFailure()) print_threads();
  // As in step_untouched().
  int answer = health();
  for (int i = 0; i < 10 && answer != 1; ++i) answer = health();
  EXPECT_EQ(answer, 1) << "the daemon serves";
  step_untouched();
  const std::size_t at_worst = more_than_before(daemon_->peak_bytes());
  const std::size_t now = more_than_before(daemon_->resident_bytes());
  const std::size_t later = kSanitized ? now : growth_once_within(allowed_growth_);
  std::printf(
      "memory: %.1f MiB before, %.1f more at the worst moment, %.1f more after, %.1f when freed memory was "
      "given back\n",
      static_cast<double>(resident_before_) / kMiB, static_cast<double>(at_worst) / kMiB,
      static_cast<double>(now) / kMiB, static_cast<double>(later) / kMiB);
  if (!kSanitized) {
    EXPECT_LE(at_worst, allowed_peak_);
    EXPECT_LE(later, allowed_growth_);
  }
  daemon_->terminate();
  // Well before it would be ended by force, and well after a drain takes.
  if (!daemon_->ends_within(std::chrono::seconds(20))) print_threads();
  const int status = daemon_->wait();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "SIGTERM is handled: exit status " << status;
  if (HasFailure()) std::printf("the daemon's log:\n%s", daemon_->log().c_str());
}

std::size_t FaultTable::more_than_before(std::size_t bytes) const {
  return bytes > resident_before_ ? bytes - resident_before_ : 0;
}

std::size_t FaultTable::growth_once_within(std::size_t allowed) const {
  std::size_t more = more_than_before(daemon_->resident_bytes());
  for (int i = 0; i < 150 && more > allowed; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    more = more_than_before(daemon_->resident_bytes());
  }
  return more;
}

int FaultTable::health_at_start() {
  int answer = -1;
  for (int i = 0; i < 3000 && answer != 1 && daemon_->running(); ++i) {
    answer = health(std::chrono::seconds(1));
    if (answer != 1) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return answer;
}

int FaultTable::health(std::chrono::seconds patience) {
  // Its messages are simple enough to write here: field 1 of the request is the name, field 1 of the answer
  // the status.
  std::string request = "\x0a ";
  request += "warmfront.v1.CollisionService";
  request[1] = static_cast<char>(request.size() - 2);
  const grpc::Slice slice(request);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + patience);
  context.set_wait_for_ready(true);
  grpc::CompletionQueue queue;
  grpc::GenericStub stub(channel_);
  const auto call =
      stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", grpc::ByteBuffer(&slice, 1), &queue);
  grpc::ByteBuffer response;
  grpc::Status status;
  call->StartCall();
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  grpc::Slice answer;
  if (!status.ok() || !response.DumpToSingleSlice(&answer).ok() || answer.size() != 2) return -1;
  return answer.begin()[1];
}

grpc::Status FaultTable::raw_call(const std::string& method, const std::vector<std::string>& messages,
                                  bool compressed) {
  Context context;
  if (compressed) context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  grpc::CompletionQueue queue;
  // Strangers have connections of their own.
  grpc::GenericStub stub(channel_to(address_));
  context.set_wait_for_ready(true);
  const auto call = stub.PrepareCall(&context, "/warmfront.v1.CollisionService/" + method, &queue);
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  bool writing = wait();
  for (std::size_t i = 0; writing && i < messages.size(); ++i) {
    const grpc::Slice slice(messages[i].data(), messages[i].size());
    call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
    writing = wait();
  }
  if (writing) {
    call->WritesDone(nullptr);
    wait();
  }
  grpc::ByteBuffer answer;
  do call->Read(&answer, nullptr);
  while (wait());
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return status;
}

}  // namespace warmfront::test
