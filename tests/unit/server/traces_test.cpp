// SPDX-License-Identifier: Apache-2.0
// Traces of frames: what they say, where they go, and that nobody waits for them.
#include <civetweb.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/observe/http_post.h"
#include "server/observe/otlp.h"
#include "server/observe/tracer.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/trace_spans.h"

namespace warmfront::test {
namespace {

using nlohmann::json;
using server::FrameTrace;
using server::Tracer;
using server::TraceSettings;
using ::testing::HasSubstr;
using wire::TraceContext;

TEST(TraceContext, IsReadAsW3CSays) {
  const auto context = TraceContext::parse(kSampled);
  ASSERT_TRUE(context);
  EXPECT_TRUE(context->sampled);
  EXPECT_EQ(context->trace[0], 0x0a);
  EXPECT_EQ(context->trace[15], 0x9c);
  EXPECT_EQ(context->parent[7], 0x31);
  EXPECT_FALSE(TraceContext::parse(kNotSampled)->sampled);
  for (const std::string wrong : {"", "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331",
                                  "ff-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
                                  "0x-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
                                  "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01-more",
                                  "01-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01more",
                                  "01-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01-mo re",
                                  "00-0AF7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
                                  "00-00000000000000000000000000000000-b7ad6b7169203331-01",
                                  "00-0af7651916cd43dd8448eb211c80319c-0000000000000000-01",
                                  "00-0af7651916cd43dd8448eb211c80319cxb7ad6b7169203331-01",
                                  "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01 "})
    EXPECT_FALSE(TraceContext::parse(wrong)) << wrong;
}

TEST(TraceContext, OfALaterVersionIsReadAsFarAsItIsKnown) {
  for (const std::string later :
       {"01-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
        "cc-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-03-what-the-future-is"}) {
    const auto context = TraceContext::parse(later);
    ASSERT_TRUE(context) << later;
    EXPECT_TRUE(context->sampled);
    EXPECT_EQ(context->trace, TraceContext::parse(kSampled)->trace);
    EXPECT_EQ(context->parent, TraceContext::parse(kSampled)->parent);
  }
}

TEST(HttpTarget, IsAnAddressOfPlainHttp) {
  const auto target = server::HttpTarget::parse("http://collector:4999/v1/traces");
  ASSERT_TRUE(target.ok());
  EXPECT_EQ(target.value().host, "collector");
  EXPECT_EQ(target.value().port, 4999);
  EXPECT_EQ(target.value().path, "/v1/traces");
  EXPECT_EQ(server::HttpTarget::parse("http://[::1]/v1/traces").value().host, "::1");
  EXPECT_EQ(server::HttpTarget::parse("http://[::1]/v1/traces").value().port, 4318);
  for (const char* wrong : {"", "collector:4318", "https://collector:4318/v1/traces", "http://collector:4318",
                            "http:///x", "http://c:0/x", "http://c:99999/x", "http://c:x/x"})
    EXPECT_THAT(server::HttpTarget::parse(wrong).error().message, HasSubstr("is expected")) << wrong;
}

FrameTrace frame_trace() {
  FrameTrace trace;
  trace.context = *TraceContext::parse(kSampled);
  trace.span = {1, 2, 3, 4, 5, 6, 7, 8};
  trace.method = "StreamSteps";
  trace.frame = 7;
  trace.set_session("6f1c1b1e-8a77-4d4c-9d61-0d2f0f5a7c11");
  const auto after = [&](int ms) { return trace.received + std::chrono::milliseconds(ms); };
  trace.arrived = after(1);
  trace.begun = after(3);
  trace.computed = after(13);
  trace.encoded = after(14);
  trace.sent = after(20);
  trace.stages_ms.refit = 2;
  trace.stages_ms.front = 3;
  trace.stages_ms.elementary = 4;
  trace.stages_ms.adjacent = 100;  // longer than is left
  trace.rows = 5;
  return trace;
}

std::int64_t start_of(const json& span) {
  return std::stoll(span.at("startTimeUnixNano").get<std::string>());
}
std::int64_t end_of(const json& span) {
  return std::stoll(span.at("endTimeUnixNano").get<std::string>());
}

TEST(Otlp, AFramesWayIsASpanAPlaceOneAfterTheOther) {
  const FrameTrace trace = frame_trace();
  const std::vector<json> spans = spans_of(server::otlp_json({&trace, 1}, "host:1"));
  std::vector<std::string> names;
  std::vector<std::int64_t> took;
  std::set<std::string> ids;
  for (const json& span : spans) {
    names.push_back(span["name"]);
    took.push_back((end_of(span) - start_of(span)) / 1'000'000);
    ids.insert(span["spanId"]);
    EXPECT_EQ(span["traceId"], "0af7651916cd43dd8448eb211c80319c");
    EXPECT_GE(start_of(span), start_of(spans[0]));
    EXPECT_LE(end_of(span), end_of(spans[0]));
  }
  EXPECT_EQ(names,
            (std::vector<std::string>{"warmfront.v1.CollisionService/StreamSteps frame", "receive", "queue",
                                      "step", "refit", "front", "elementary", "adjacent", "encode", "send"}));
  EXPECT_EQ(took, (std::vector<std::int64_t>{20, 1, 2, 10, 2, 3, 4, 1, 1, 6}))
      << "a stage ends with the step";
  EXPECT_EQ(ids.size(), spans.size());
  EXPECT_EQ(spans[0]["parentSpanId"], "b7ad6b7169203331");
  EXPECT_EQ(spans[0]["kind"], 2);
  EXPECT_EQ(spans[3]["parentSpanId"], spans[0]["spanId"]);
  EXPECT_EQ(spans[4]["parentSpanId"], spans[3]["spanId"]);
}

TEST(Otlp, AFailedFrameSaysSoAndHasNoStages) {
  FrameTrace trace = frame_trace();
  trace.code = 3;
  trace.set_message("frame 7: positions[0].x: is not a number" + std::string(1000, '.'));
  trace.encoded = trace.received;  // an error's message is made at once
  const std::vector<json> spans = spans_of(server::otlp_json({&trace, 1}, "host:1"));
  EXPECT_EQ(spans[0]["status"]["code"], 2);
  const std::string message = spans[0]["status"]["message"];
  EXPECT_THAT(message, ::testing::StartsWith("frame 7: positions[0].x: is not a number..."));
  EXPECT_EQ(message.size(), 255u) << "as much as there is room for";
  EXPECT_EQ(spans.size(), 6u);
  for (const json& span : spans) EXPECT_LE(start_of(span), end_of(span)) << span["name"];
}

TEST(Tracer, TheCallersFlagDecidesElseTheShare) {
  const TemporaryFolder folder;
  const auto tracer = [&](double share) {
    return std::move(
        Tracer::start(TraceSettings{(folder.path() / "t").string(), "", share}, [](const std::string&) {
        }).value());
  };
  const auto traced = [](Tracer& tracer, const std::optional<TraceContext>& caller) {
    int count = 0;
    for (int i = 0; i < 1000; ++i) count += tracer.begin(caller, "Step", "s", 1) != nullptr ? 1 : 0;
    return count;
  };
  const auto none = tracer(0), all = tracer(1), some = tracer(0.5);
  EXPECT_EQ(traced(*none, std::nullopt), 0);
  EXPECT_EQ(traced(*all, std::nullopt), 1000);
  EXPECT_GT(traced(*some, std::nullopt), 300);
  EXPECT_LT(traced(*some, std::nullopt), 700);
  EXPECT_EQ(traced(*none, TraceContext::parse(kSampled)), 1000);
  EXPECT_EQ(traced(*all, TraceContext::parse(kNotSampled)), 0);
}

TEST(Tracer, WhatCannotBeSentIsCountedAndSaidOnce) {
  std::atomic<int> said{0};
  std::string words;
  std::mutex mutex;
  std::uint64_t dropped = 0;
  {
    // Nobody listens on port 1.
    auto tracer =
        std::move(Tracer::start({"", "http://127.0.0.1:1/v1/traces", 1}, [&](const std::string& why) {
                    const std::lock_guard lock(mutex);
                    words = why;
                    ++said;
                  }).value());
    for (int batch = 1; batch <= 3; ++batch) {
      tracer->finish(tracer->begin(std::nullopt, "Step", "s", 1));
      while (tracer->frames_dropped() < static_cast<std::uint64_t>(batch)) std::this_thread::yield();
    }
    dropped = tracer->frames_dropped();
    EXPECT_EQ(tracer->frames_sent(), 0u);
  }
  EXPECT_EQ(dropped, 3u);
  EXPECT_EQ(said.load(), 1);
  EXPECT_THAT(words, HasSubstr("trace-endpoint"));
  EXPECT_THAT(words, HasSubstr("1 frames"));
}

// A collector, of which the test is the operator.
class Collector {
 public:
  Collector() {
    const char* options[] = {"listening_ports", "127.0.0.1:0", "num_threads", "1", nullptr};
    server_ = mg_start(nullptr, nullptr, options);
    mg_set_request_handler(
        server_, "/v1/traces",
        [](mg_connection* connection, void* self) {
          std::string body(4 << 20, '\0');
          int size = 0;
          for (int more; (more = mg_read(connection, body.data() + size, body.size() - size)) > 0;)
            size += more;
          body.resize(static_cast<std::size_t>(size));
          auto& collector = *static_cast<Collector*>(self);
          const std::lock_guard lock(collector.mutex_);
          collector.bodies_.push_back(body);
          collector.type_ = mg_get_header(connection, "Content-Type");
          mg_printf(connection, "HTTP/1.1 %d Now\r\nContent-Length: 2\r\n\r\n{}", collector.status_);
          return collector.status_;
        },
        this);
  }
  ~Collector() { mg_stop(server_); }
  std::string address() const {
    mg_server_port port{};
    EXPECT_EQ(mg_get_server_ports(server_, 1, &port), 1);
    return "http://127.0.0.1:" + std::to_string(port.port) + "/v1/traces";
  }
  void answer(int status) {
    const std::lock_guard lock(mutex_);
    status_ = status;
  }
  std::vector<std::string> bodies() {
    const std::lock_guard lock(mutex_);
    return bodies_;
  }
  std::string type() {
    const std::lock_guard lock(mutex_);
    return type_;
  }

 private:
  mg_context* server_ = nullptr;
  std::mutex mutex_;
  std::vector<std::string> bodies_;
  std::string type_;
  int status_ = 200;
};

TEST(Tracer, SendsToACollectorAndNoticesWhatItRefuses) {
  Collector collector;
  const auto tracer =
      std::move(Tracer::start({"", collector.address(), 1}, [](const std::string&) {}).value());
  tracer->finish(tracer->begin(std::nullopt, "Step", "s", 1));
  while (tracer->frames_sent() < 1) std::this_thread::yield();
  ASSERT_EQ(collector.bodies().size(), 1u);
  EXPECT_EQ(spans_of(collector.bodies()[0])[0]["kind"], 2);
  EXPECT_EQ(collector.type(), "application/json");
  collector.answer(503);
  tracer->finish(tracer->begin(std::nullopt, "Step", "s", 2));
  while (tracer->frames_dropped() < 1) std::this_thread::yield();
  EXPECT_EQ(tracer->frames_sent(), 1u);
}

TEST(Tracer, FramesNeverWaitForAFullQueue) {
  const TemporaryFolder folder;
  std::uint64_t handed = 0;
  auto tracer =
      std::move(Tracer::start({(folder.path() / "t").string(), "", 1}, [](const std::string&) {}).value());
  for (; handed < 3 * Tracer::kMostWaiting; ++handed)
    tracer->finish(tracer->begin(std::nullopt, "Step", "s", handed));
  while (tracer->frames_sent() + tracer->frames_dropped() < handed) std::this_thread::yield();
  const std::uint64_t sent = tracer->frames_sent();
  EXPECT_GE(sent, Tracer::kMostWaiting / 4);
  tracer.reset();
  using std::filesystem::perms;
  EXPECT_EQ(
      std::filesystem::status(folder.path() / "t").permissions() & (perms::group_all | perms::others_all),
      perms::none);
  std::ifstream file(folder.path() / "t");
  std::uint64_t found = 0;
  for (std::string line; std::getline(file, line);)
    for (const json& span : spans_of(line)) found += span["kind"] == 2 ? 1 : 0;
  EXPECT_EQ(found, sent);
}

TEST(Tracer, BadPlacesAreRefusedByTheirSettingsNames) {
  EXPECT_THAT(Tracer::start({"/nowhere/at/all", "", 1}, {}).error().message,
              HasSubstr("trace-file /nowhere/at/all: it cannot be opened for writing (No such file"));
  EXPECT_THAT(Tracer::start({"", "https://x/v1/traces", 1}, {}).error().message,
              HasSubstr("trace-endpoint https"));
}

}  // namespace
}  // namespace warmfront::test
