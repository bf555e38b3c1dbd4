// SPDX-License-Identifier: Apache-2.0
#include "server/observe/otlp.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/version.h"

namespace warmfront::server {
namespace {

using nlohmann::json;
using Clock = FrameTrace::Clock;

std::string hexadecimal(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text.push_back("0123456789abcdef"[byte >> 4]);
    text.push_back("0123456789abcdef"[byte & 15]);
  }
  return text;
}

json attribute(const char* name, std::string value) {
  return {{"key", name}, {"value", {{"stringValue", std::move(value)}}}};
}
/// 64-bit integers are strings in Protocol Buffers' JSON.
json attribute(const char* name, std::uint64_t value) {
  return {{"key", name}, {"value", {{"intValue", std::to_string(value)}}}};
}

/// The spans of one frame.
class Spans {
 public:
  Spans(const FrameTrace& frame, json& to) : frame_(frame), to_(to) {
    // A frame that failed early did not pass the later places: their spans are empty.
    arrived_ = std::max(frame.received, frame.arrived);
    begun_ = std::max(arrived_, frame.begun);
    computed_ = std::max(begun_, frame.computed);
    encoded_ = std::max(computed_, frame.encoded);
    sent_ = std::max(encoded_, frame.sent);
  }

  void add() {
    json root = span(std::string("warmfront.v1.CollisionService/") + frame_.method + " frame", frame_.span,
                     frame_.context.parent, frame_.received, sent_);
    root["kind"] = 2;  // SERVER
    root["attributes"] = {attribute("rpc.system", std::string("grpc")),
                          attribute("rpc.service", std::string("warmfront.v1.CollisionService")),
                          attribute("rpc.method", std::string(frame_.method)),
                          attribute("rpc.grpc.status_code", static_cast<std::uint64_t>(frame_.code)),
                          attribute("warmfront.session", std::string(frame_.session.data())),
                          attribute("warmfront.frame", frame_.frame),
                          attribute("warmfront.contacts", frame_.rows)};
    if (frame_.code != 0)
      root["status"] = {{"code", 2}, {"message", std::string(frame_.message.data())}};  // ERROR
    to_.push_back(std::move(root));
    child("receive", frame_.span, frame_.received, arrived_);
    child("queue", frame_.span, arrived_, begun_);
    const SpanId step = child("step", frame_.span, begun_, computed_);
    if (frame_.code == 0) stages(step);
    child("encode", frame_.span, computed_, encoded_);
    child("send", frame_.span, encoded_, sent_);
  }

 private:
  json span(const std::string& name, const SpanId& id, const SpanId& parent, Clock::time_point from,
            Clock::time_point to) const {
    json result{{"traceId", hexadecimal(frame_.context.trace)},
                {"spanId", hexadecimal(id)},
                {"name", name},
                {"kind", 1},  // INTERNAL
                {"startTimeUnixNano", unix_nanoseconds(from)},
                {"endTimeUnixNano", unix_nanoseconds(to)}};
    if (parent != SpanId{}) result["parentSpanId"] = hexadecimal(parent);
    return result;
  }

  SpanId child(const char* name, const SpanId& parent, Clock::time_point from, Clock::time_point to) {
    // Distinct within the frame, whose own is random.
    SpanId id = frame_.span;
    id.back() ^= ++children_;
    to_.push_back(span(name, id, parent, from, to));
    return id;
  }

  void stages(const SpanId& step) {
    const StageTimes& ms = frame_.stages_ms;
    Clock::time_point at = begun_;
    for (const auto& [name, took] : {std::pair{"refit", ms.refit},
                                     {"front", ms.front},
                                     {"elementary", ms.elementary},
                                     {"adjacent", ms.adjacent}}) {
      const Clock::time_point end =
          std::min(computed_, at + std::chrono::duration_cast<Clock::duration>(
                                       std::chrono::duration<double, std::milli>(std::max(took, 0.0))));
      child(name, step, at, end);
      at = end;
    }
  }

  std::string unix_nanoseconds(Clock::time_point at) const {
    const auto since = std::chrono::duration_cast<std::chrono::nanoseconds>(at - frame_.received);
    const auto start =
        std::chrono::duration_cast<std::chrono::nanoseconds>(frame_.started.time_since_epoch());
    return std::to_string((start + since).count());
  }

  const FrameTrace& frame_;
  json& to_;
  Clock::time_point arrived_, begun_, computed_, encoded_, sent_;
  std::uint8_t children_ = 0;
};

}  // namespace

std::string otlp_json(std::span<const FrameTrace> frames, std::string_view instance) {
  json spans = json::array();
  for (const FrameTrace& frame : frames) Spans(frame, spans).add();
  const json resource{{"attributes",
                       {attribute("service.name", std::string("warmfrontd")),
                        attribute("service.version", std::string(kVersion)),
                        attribute("service.instance.id", std::string(instance))}}};
  const json request{
      {"resourceSpans", json::array({{{"resource", resource},
                                      {"scopeSpans", json::array({{{"scope", {{"name", "warmfront.server"}}},
                                                                   {"spans", std::move(spans)}}})}}})}};
  return request.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace warmfront::server
