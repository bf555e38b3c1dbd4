// SPDX-License-Identifier: Apache-2.0
// Fixture of all rows of the fault table: a real daemon, a misbehaving client, an untouched session, and
// final checks: the daemon is healthy, the untouched session's next step has the right contacts, memory is
// bounded, and SIGTERM ends the daemon with exit code 0. Used by one thread at a time.
#pragma once

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>

#include <chrono>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "tests/faults/daemon_process.h"
#include "tests/unit/server/bare_client.h"

namespace warmfront::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;  ///< memory is the sanitizer's then
#else
inline constexpr bool kSanitized = false;
#endif

inline constexpr std::size_t kMiB = std::size_t{1} << 20;

class FaultTable : public ::testing::Test, protected BareClient {
 protected:
  void SetUp() override { begin({}); }
  void TearDown() override;

  /// Restarts the daemon with other flags; see DaemonProcess.
  void begin(std::vector<std::string> flags, std::vector<std::string> environment = {}, std::string log = {});
  /// Records the memory in use, and creates the untouched session, for a daemon that was just started.
  void begin_untouched();
  /// The untouched session's next frame, compared with the engine in this process.
  void step_untouched();

  /// Before an attack, where WARMFRONT_P99_BUDGET is set: steps the untouched session, and keeps how long the
  /// steps took. Then steps it while this process computes on every core, and prints that, too: what the
  /// system's scheduler does to a daemon that nobody attacks.
  void steps_alone();
  /// Steps it beside an attack, `count` times and until `enough` says so, and prints how long the steps took.
  /// With WARMFRONT_P99_BUDGET=3 in the environment, also how many times as long as alone, and it is a
  /// failure when the p99 is more than three times as long: not for a machine that does other work.
  void steps_beside(
      const char* what, int count, const std::function<bool()>& enough = [] { return true; });

  /// grpc.health.v1's answer for the service: 1 is SERVING; -1 without an answer.
  int health(std::chrono::seconds patience = std::chrono::seconds(30));
  /// health() of a daemon that was just started, once it reports SERVING: it listens slightly before.
  int health_at_start();

  /// A call of any of the service's methods with any bytes as messages, compressed or not: how it ended.
  grpc::Status raw_call(const std::string& method, const std::vector<std::string>& messages,
                        bool compressed = false);

  static void expect_fault(const grpc::Status& status, grpc::StatusCode code, v1::ErrorReason reason,
                           const std::string& words) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(detail_of(status).reason(), reason);
    EXPECT_THAT(status.error_message(), ::testing::HasSubstr(words));
  }

  std::optional<DaemonProcess> daemon_;
  /// The daemon's growth in memory since it created the untouched session, once it is at most `allowed`;
  /// freed memory takes a few seconds to be returned.
  std::size_t growth_once_within(std::size_t allowed) const;

  /// Allowed memory of a row: peak, and growth after it.
  std::size_t allowed_peak_ = 64 * kMiB;
  std::size_t allowed_growth_ = 32 * kMiB;

 private:
  std::size_t more_than_before(std::size_t bytes) const;
  /// How long each took, in ms and in order.
  std::vector<double> time_steps(
      int count, const std::function<bool()>& enough = [] { return true; });
  void print_steps(const char* what, const std::vector<double>& took) const;

  std::vector<double> alone_;

  static constexpr const char* kUntouched = "31234567-89ab-cdef-0123-456789abcdef";
  std::size_t resident_before_ = 0;
  std::uint64_t untouched_frame_ = 0;
};

}  // namespace warmfront::test
