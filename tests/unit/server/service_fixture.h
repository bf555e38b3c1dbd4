// SPDX-License-Identifier: Apache-2.0
// What tests of the service share: a daemon in this process and a bare client of it. Used by one thread at a
// time.
#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "tests/unit/server/bare_client.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {

class ServiceTest : public ::testing::Test, protected BareClient {
 protected:
  explicit ServiceTest(server::Config config = {}) : daemon_(std::move(config)) {
    connect(daemon_.address());
  }

  LocalDaemon daemon_;
};

class SmallLimitsTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_sessions = 1;
    config.limits.max_triangles = 100;
    config.limits.answer_chunk_bytes = 64;
    config.limits.window = 1;
    config.limits.max_message_bytes = 64 << 10;
    return config;
  }
  SmallLimitsTest() : ServiceTest(config()) {}
};

}  // namespace warmfront::test
