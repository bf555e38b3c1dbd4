// SPDX-License-Identifier: Apache-2.0
// The settings' table. Constant.
#include "server/settings.h"

#include <array>
#include <limits>
#include <string_view>
#include <utility>

#include "server/session/quota.h"
#include "server/units.h"

namespace warmfront::server {
namespace {

using Values = std::vector<std::string>;
using Kind = Setting::Kind;

constexpr std::array<std::pair<std::string_view, LogLevel>, 5> kLevels{{{"debug", LogLevel::kDebug},
                                                                        {"info", LogLevel::kInfo},
                                                                        {"warning", LogLevel::kWarning},
                                                                        {"error", LogLevel::kError},
                                                                        {"off", LogLevel::kOff}}};
constexpr std::array<std::pair<std::string_view, LogFormat>, 2> kFormats{
    {{"text", LogFormat::kText}, {"json", LogFormat::kJson}}};

template <class T, std::size_t N>
Status set_named(T& target, const std::array<std::pair<std::string_view, T>, N>& names,
                 const std::string& text) {
  std::string expected;
  for (const auto& [name, value] : names) {
    if (name == text) {
      target = value;
      return {};
    }
    expected.append(expected.empty() ? "" : ", ").append(name);
  }
  return invalid_argument("\"" + text + "\": one of " + expected + " is expected");
}

template <class T, std::size_t N>
Values get_named(T value, const std::array<std::pair<std::string_view, T>, N>& names) {
  for (const auto& [name, candidate] : names)
    if (candidate == value) return {std::string(name)};
  return {};
}

Status set_switch(bool& target, const std::string& text) {
  if (text != "true" && text != "false")
    return invalid_argument("\"" + text + "\": true or false is expected");
  target = text == "true";
  return {};
}

Values get_switch(bool value) {
  return {value ? "true" : "false"};
}

template <class T>
Status set_integer(T& target, const std::string& text, std::uint64_t least,
                   std::uint64_t most = std::numeric_limits<std::int32_t>::max()) {
  const Result<std::uint64_t> value = parse_integer(text, least, most);
  if (!value) return value.error();
  target = static_cast<T>(value.value());
  return {};
}

Status set_bytes(std::size_t& target, const std::string& text, std::uint64_t least) {
  const Result<std::uint64_t> value = parse_bytes(text, least);
  if (!value) return value.error();
  target = value.value();
  return {};
}

Status set_duration(std::chrono::milliseconds& target, const std::string& text) {
  const Result<std::chrono::milliseconds> value = parse_duration(text);
  if (!value) return value.error();
  target = value.value();
  return {};
}

constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();

const Setting kSettings[] = {
    {"listen", Kind::kList, "Address to listen on, HOST:PORT or unix:PATH; several with commas, or repeated",
     [](Config& c, const Values& v) -> Status {
       c.listen = v;
       return {};
     },
     [](const Config& c) { return c.listen; }},
    {"insecure", Kind::kSwitch, "Allow addresses beyond this machine although nothing is encrypted",
     [](Config& c, const Values& v) { return set_switch(c.insecure, v.back()); },
     [](const Config& c) { return get_switch(c.insecure); }},
    {"tls-cert", Kind::kValue,
     "Certificate of the daemon, PEM, chain included; TCP addresses are served with TLS then",
     [](Config& c, const Values& v) -> Status {
       c.tls.certificate = v.back();
       return {};
     },
     [](const Config& c) { return Values{c.tls.certificate}; }},
    {"tls-key", Kind::kValue, "Key of the certificate, PEM",
     [](Config& c, const Values& v) -> Status {
       c.tls.key = v.back();
       return {};
     },
     [](const Config& c) { return Values{c.tls.key}; }},
    {"tls-client-ca", Kind::kValue, "Signers of client certificates, PEM; each client must show one then",
     [](Config& c, const Values& v) -> Status {
       c.tls.client_ca = v.back();
       return {};
     },
     [](const Config& c) { return Values{c.tls.client_ca}; }},
    {"token-file", Kind::kValue,
     "File of who may call: lines of TOKEN PRINCIPAL, then admin for an administrator, then what it may have (see "
     "--quotas); read again on SIGHUP",
     [](Config& c, const Values& v) -> Status {
       c.token_file = v.back();
       return {};
     },
     [](const Config& c) { return Values{c.token_file}; }},
    {"admins", Kind::kList,
     "Principals that administer, besides those of the token file; several with commas, or repeated",
     [](Config& c, const Values& v) -> Status {
       c.admins = v;
       return {};
     },
     [](const Config& c) { return c.admins; }},
    {"reflection", Kind::kSwitch, "Serve gRPC reflection, so that generic tools can call the daemon",
     [](Config& c, const Values& v) { return set_switch(c.reflection, v.back()); },
     [](const Config& c) { return get_switch(c.reflection); }},
    {"channelz", Kind::kSwitch,
     "Serve gRPC channelz, which shows connections and calls to whoever can connect",
     [](Config& c, const Values& v) { return set_switch(c.channelz, v.back()); },
     [](const Config& c) { return get_switch(c.channelz); }},
    {"metrics-listen", Kind::kValue,
     "HOST:PORT of /metrics (Prometheus), /healthz and /readyz over plain HTTP; none by default",
     [](Config& c, const Values& v) -> Status {
       c.metrics_listen = v.back();
       return {};
     },
     [](const Config& c) { return Values{c.metrics_listen}; }},
    {"record-dir", Kind::kValue,
     "Folder to record sessions into, a .wfrec each, with all positions that clients send; none by default",
     [](Config& c, const Values& v) -> Status {
       c.record_dir = v.back();
       return {};
     },
     [](const Config& c) { return Values{c.record_dir}; }},
    {"record-max-bytes", Kind::kValue,
     "What recordings in that folder may hold in all, above which they stop and sessions go on",
     [](Config& c, const Values& v) { return set_bytes(c.record_max_bytes, v.back(), 1 << 16); },
     [](const Config& c) { return Values{format_bytes(c.record_max_bytes)}; }},
    {"record-queue-bytes", Kind::kValue,
     "What of all recordings may wait for the disk, above which a recording stops and its session goes on",
     [](Config& c, const Values& v) { return set_bytes(c.record_queue_bytes, v.back(), 1 << 16); },
     [](const Config& c) { return Values{format_bytes(c.record_queue_bytes)}; }},
    {"threads", Kind::kValue, "Threads that steps run on; 0: as many as the machine has",
     [](Config& c, const Values& v) { return set_integer(c.threads, v.back(), 0, 1024); },
     [](const Config& c) { return Values{std::to_string(c.threads)}; }},
    {"log-level", Kind::kValue, "debug, info, warning, error or off",
     [](Config& c, const Values& v) { return set_named(c.log_level, kLevels, v.back()); },
     [](const Config& c) { return get_named(c.log_level, kLevels); }},
    {"log-format", Kind::kValue, "text or json, one event a line on standard error",
     [](Config& c, const Values& v) { return set_named(c.log_format, kFormats, v.back()); },
     [](const Config& c) { return get_named(c.log_format, kFormats); }},
    {"max-sessions", Kind::kValue, "Sessions open at once",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_sessions, v.back(), 1); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_sessions)}; }},
    {"max-sessions-per-principal", Kind::kValue,
     "Sessions of one principal open at once; 0, here and below: three quarters of the daemon's limit where "
     "principals are told apart, else all",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_sessions_per_principal, v.back(), 0); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_sessions_per_principal)}; }},
    {"max-vertices", Kind::kValue, "Vertices in a session",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_vertices, v.back(), 1, kMost32); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_vertices)}; }},
    {"max-triangles", Kind::kValue, "Triangles in a session",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_triangles, v.back(), 1, kMost32); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_triangles)}; }},
    {"max-contacts", Kind::kValue, "Contacts in an answer; a step with more fails",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_contacts, v.back(), 1, kMost32); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_contacts)}; }},
    {"max-front-bytes", Kind::kValue, "Memory of a session's front; above it steps traverse from the root",
     [](Config& c, const Values& v) { return set_bytes(c.limits.max_front_bytes, v.back(), 1); },
     [](const Config& c) { return Values{format_bytes(c.limits.max_front_bytes)}; }},
    {"max-session-bytes", Kind::kValue,
     "Memory of a session: scene, hierarchy, front, waiting frames and answers; by default 8GiB, and never more "
     "than --max-total-bytes or than this process may use, to which it is lowered, with a line in the log",
     [](Config& c, const Values& v) { return set_bytes(c.limits.max_session_bytes, v.back(), 1 << 16); },
     [](const Config& c) { return Values{format_bytes(c.limits.max_session_bytes)}; }},
    {"max-total-bytes", Kind::kValue,
     "Memory of all sessions; by default three quarters of what this process may use",
     [](Config& c, const Values& v) { return set_bytes(c.limits.max_total_bytes, v.back(), 1 << 20); },
     [](const Config& c) { return Values{format_bytes(c.limits.max_total_bytes)}; }},
    {"max-principal-bytes", Kind::kValue,
     "Memory of all sessions of a principal; 0: as said of its sessions",
     [](Config& c, const Values& v) -> Status {
       if (v.back() != "0") return set_bytes(c.limits.max_principal_bytes, v.back(), 1 << 16);
       c.limits.max_principal_bytes = 0;
       return {};
     },
     [](const Config& c) { return Values{format_bytes(c.limits.max_principal_bytes)}; }},
    {"max-streams-per-principal", Kind::kValue, "Streams of one principal open at once; 0: as said of its sessions",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_streams_per_principal, v.back(), 0); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_streams_per_principal)}; }},
    {"max-frames-per-principal", Kind::kValue,
     "Frames of one principal accepted and not yet computed; 0: as said of its sessions",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_frames_per_principal, v.back(), 0); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_frames_per_principal)}; }},
    {"max-uploads-per-principal", Kind::kValue,
     "Sessions that one principal uploads at once; 0: a quarter of --max-sessions where principals are told "
     "apart, else all",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_uploads_per_principal, v.back(), 0); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_uploads_per_principal)}; }},
    {"quotas", Kind::kList,
     "What single principals may have: \"PRINCIPAL sessions=8 bytes=4GiB streams=8 frames=32 uploads=2 weight=2\", "
     "each part optional; several with commas, or repeated. Words like these may also end a line of the token "
     "file, which goes before",
     [](Config& c, const Values& v) -> Status {
       const Result<Quotas> quotas = parse_quotas(v);
       if (!quotas) return quotas.error();
       c.quotas = v;
       return {};
     },
     [](const Config& c) { return c.quotas; }},
    {"max-open-streams", Kind::kValue, "Streams open at once, over all connections",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_open_streams, v.back(), 1); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_open_streams)}; }},
    {"max-frames-in-flight", Kind::kValue, "Frames accepted and not yet computed, over all sessions",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_frames_in_flight, v.back(), 1); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_frames_in_flight)}; }},
    {"max-queued-bytes", Kind::kValue,
     "Answers that wait for a stream's client, above which no frames are read from it",
     [](Config& c, const Values& v) { return set_bytes(c.limits.max_queued_bytes, v.back(), 1); },
     [](const Config& c) { return Values{format_bytes(c.limits.max_queued_bytes)}; }},
    {"window", Kind::kValue, "Frames of a stream that may be unanswered; more are left unread",
     [](Config& c, const Values& v) { return set_integer(c.limits.window, v.back(), 1, 64); },
     [](const Config& c) { return Values{std::to_string(c.limits.window)}; }},
    {"answer-chunk-bytes", Kind::kValue, "Contact bytes in one message of a streamed answer",
     [](Config& c, const Values& v) { return set_bytes(c.limits.answer_chunk_bytes, v.back(), 64); },
     [](const Config& c) { return Values{format_bytes(c.limits.answer_chunk_bytes)}; }},
    {"max-message-bytes", Kind::kValue,
     "Size of one message; larger uploads, frames and answers come in parts",
     [](Config& c, const Values& v) -> Status {
       const Status set = set_bytes(c.limits.max_message_bytes, v.back(), 64 << 10);
       if (set && c.limits.max_message_bytes > std::size_t{1} << 30)
         return invalid_argument("\"" + v.back() + "\": at most 1GiB is expected");
       return set;
     },
     [](const Config& c) { return Values{format_bytes(c.limits.max_message_bytes)}; }},
    {"idle-timeout", Kind::kValue,
     "Time after which a session is closed without a stream, a request, or one being carried out",
     [](Config& c, const Values& v) { return set_duration(c.limits.idle_timeout, v.back()); },
     [](const Config& c) { return Values{format_duration(c.limits.idle_timeout)}; }},
    {"upload-timeout", Kind::kValue,
     "Time for a scene to arrive, for the parts of a frame, and for a stream to attach",
     [](Config& c, const Values& v) { return set_duration(c.limits.upload_timeout, v.back()); },
     [](const Config& c) { return Values{format_duration(c.limits.upload_timeout)}; }},
    {"write-stall-timeout", Kind::kValue,
     "Time in which a client must take a message of an answer, or send one of an upload, or be cut off",
     [](Config& c, const Values& v) { return set_duration(c.limits.write_stall_timeout, v.back()); },
     [](const Config& c) { return Values{format_duration(c.limits.write_stall_timeout)}; }},
    {"self-check-steps", Kind::kValue,
     "Steps of a session from one self-check of its hierarchy and front to the next; 0: only on demand",
     [](Config& c, const Values& v) { return set_integer(c.limits.self_check_steps, v.back(), 0); },
     [](const Config& c) { return Values{std::to_string(c.limits.self_check_steps)}; }},
    {"transport-memory", Kind::kValue, "Memory for messages in transit, over all connections",
     [](Config& c, const Values& v) { return set_bytes(c.transport_memory_bytes, v.back(), 1 << 20); },
     [](const Config& c) { return Values{format_bytes(c.transport_memory_bytes)}; }},
    {"max-streams", Kind::kValue, "Calls at once on one connection; our clients open another for more",
     [](Config& c, const Values& v) { return set_integer(c.limits.max_streams, v.back(), 1); },
     [](const Config& c) { return Values{std::to_string(c.limits.max_streams)}; }},
    {"max-metadata-bytes", Kind::kValue, "Headers of a call, in bytes",
     [](Config& c, const Values& v) { return set_integer(c.max_metadata_bytes, v.back(), 1024, 1 << 20); },
     [](const Config& c) { return Values{std::to_string(c.max_metadata_bytes)}; }},
    {"drain-timeout", Kind::kValue, "Time that frames in hand get after SIGTERM or SIGINT",
     [](Config& c, const Values& v) { return set_duration(c.drain_timeout, v.back()); },
     [](const Config& c) { return Values{format_duration(c.drain_timeout)}; }},
};

}  // namespace

std::span<const Setting> settings() {
  return kSettings;
}

}  // namespace warmfront::server
