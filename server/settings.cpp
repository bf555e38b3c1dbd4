// SPDX-License-Identifier: Apache-2.0
// The settings' table: one row a setting. Constant.
#include "server/settings.h"

#include <array>
#include <charconv>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include "server/session/quota.h"
#include "server/units.h"

namespace warmfront::server {
namespace {

using Values = std::vector<std::string>;
using Kind = Setting::Kind;

/// The member's owner in a configuration.
template <class Owner, class C>
auto& part_of(C& config) {
  if constexpr (std::is_same_v<Owner, Limits>)
    return config.limits;
  else if constexpr (std::is_same_v<Owner, TlsFiles>)
    return config.tls;
  else if constexpr (std::is_same_v<Owner, TraceSettings>)
    return config.trace;
  else
    return config;
}

/// A setting of one value: `parse` makes it of a text, `format` a text of it.
template <class Owner, class T, class Parse, class Format>
Setting one_value(const char* name, T Owner::*member, const char* help, Parse parse, Format format,
                  Kind kind = Kind::kValue) {
  return {name, kind, help,
          [member, parse](Config& config, const Values& values) -> Status {
            Result<T> value = parse(values.back());
            if (!value) return value.error();
            part_of<Owner>(config).*member = std::move(value).value();
            return {};
          },
          [member, format](const Config& config) { return Values{format(part_of<Owner>(config).*member)}; }};
}

template <class Owner>
Setting text(const char* name, std::string Owner::*member, const char* help) {
  return one_value(
      name, member, help, [](const std::string& text) -> Result<std::string> { return text; },
      [](const std::string& value) { return value; });
}

/// Values as they are, after `check` has nothing to say against them.
Setting texts(
    const char* name, Values Config::*member, const char* help,
    Status (*check)(const Values& values) = [](const Values&) { return Status(); }) {
  return {name, Kind::kList, help,
          [member, check](Config& config, const Values& values) -> Status {
            if (const Status checked = check(values); !checked) return checked;
            config.*member = values;
            return {};
          },
          [member](const Config& config) { return config.*member; }};
}

Status check_quotas(const Values& values) {
  const Result<Quotas> quotas = parse_quotas(values);
  return quotas ? Status() : quotas.error();
}

Setting on_off(const char* name, bool Config::*member, const char* help) {
  return one_value(
      name, member, help,
      [](const std::string& text) -> Result<bool> {
        if (text != "true" && text != "false")
          return invalid_argument("\"" + text + "\": true or false is expected");
        return text == "true";
      },
      [](bool value) { return std::string(value ? "true" : "false"); }, Kind::kSwitch);
}

/// A word for each value.
template <class T, std::size_t N>
using Words = std::array<std::pair<std::string_view, T>, N>;

constexpr Words<LogLevel, 5> kLevels{{{"debug", LogLevel::kDebug},
                                      {"info", LogLevel::kInfo},
                                      {"warning", LogLevel::kWarning},
                                      {"error", LogLevel::kError},
                                      {"off", LogLevel::kOff}}};
constexpr Words<LogFormat, 2> kFormats{{{"text", LogFormat::kText}, {"json", LogFormat::kJson}}};

template <class T, std::size_t N>
Setting one_of(const char* name, T Config::*member, const Words<T, N>& words, const char* help) {
  return one_value(
      name, member, help,
      [&words](const std::string& text) -> Result<T> {
        std::string expected;
        for (const auto& [word, value] : words) {
          if (word == text) return value;
          expected.append(expected.empty() ? "" : ", ").append(word);
        }
        return invalid_argument("\"" + text + "\": one of " + expected + " is expected");
      },
      [&words](T value) {
        for (const auto& [word, candidate] : words)
          if (candidate == value) return std::string(word);
        return std::string();
      });
}

struct CountBounds {
  std::uint64_t least;
  std::uint64_t most = std::numeric_limits<std::int32_t>::max();
};
constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();

template <class Owner, class T>
Setting count(const char* name, T Owner::*member, CountBounds bounds, const char* help,
              const char* former_name = nullptr) {
  Setting setting = one_value(
      name, member, help,
      [bounds](const std::string& text) -> Result<T> {
        const Result<std::uint64_t> value = parse_integer(text, bounds.least, bounds.most);
        if (!value) return value.error();
        return static_cast<T>(value.value());
      },
      [](T value) { return std::to_string(value); });
  setting.former_name = former_name;
  return setting;
}

struct ByteBounds {
  std::uint64_t least;
  std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  bool or_zero = false;  ///< "0" is below `least`, and means something of its own
};

template <class Owner>
Setting bytes(const char* name, std::size_t Owner::*member, ByteBounds bounds, const char* help) {
  return one_value(
      name, member, help,
      [bounds](const std::string& text) -> Result<std::size_t> {
        if (bounds.or_zero && text == "0") return std::size_t{0};
        const Result<std::uint64_t> value = parse_bytes(text, bounds.least);
        if (!value) return value.error();
        if (value.value() > bounds.most)
          return invalid_argument("\"" + text + "\": at most " + format_bytes(bounds.most) + " is expected");
        return std::size_t{value.value()};
      },
      [](std::size_t value) { return format_bytes(value); });
}

template <class Owner>
Setting share(const char* name, double Owner::*member, const char* help) {
  return one_value(
      name, member, help,
      [](const std::string& text) -> Result<double> {
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || end != text.data() + text.size() || !(value >= 0 && value <= 1))
          return invalid_argument("\"" + text + "\": a number in [0, 1] is expected");
        return value;
      },
      [](double value) {
        std::array<char, 32> text{};
        return std::string(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
      });
}

template <class Owner>
Setting duration(const char* name, std::chrono::milliseconds Owner::*member, const char* help) {
  return one_value(name, member, help, parse_duration, format_duration);
}

std::vector<Setting> table() {
  return {
      texts("listen", &Config::listen,
            "Address to listen on, HOST:PORT or unix:PATH; several with commas, or repeated"),
      on_off("insecure", &Config::insecure,
             "Allow addresses beyond this machine although nothing is encrypted"),
      text("tls-cert", &TlsFiles::certificate,
           "Certificate of the daemon, PEM, chain included; TCP addresses are served with TLS then"),
      text("tls-key", &TlsFiles::key, "Key of the certificate, PEM"),
      text("tls-client-ca", &TlsFiles::client_ca,
           "Signers of client certificates, PEM; each client must show one then"),
      text("token-file", &Config::token_file,
           "File of who may call: lines of TOKEN PRINCIPAL, then admin for an administrator, then what it "
           "may have (see --quotas); read again on SIGHUP"),
      texts("admins", &Config::admins,
            "Principals that administer, besides those of the token file; several with commas, or repeated"),
      on_off("reflection", &Config::reflection,
             "Serve gRPC reflection, so that generic tools can call the daemon"),
      on_off("channelz", &Config::channelz,
             "Serve gRPC channelz, which shows connections and calls to whoever can connect"),
      on_off(
          "no-shared-memory", &Config::no_shared_memory,
          "Share no memory with clients that come over a Unix socket: positions and answers go through it"),
      count(
          "spin-microseconds", &Config::spin_microseconds, {.least = 0, .most = 100'000},
          "How long a thread that serves shared memory waits for a session's next frame before it sleeps, in "
          "microseconds; more saves solvers a wake-up a frame, and keeps cores busy between frames"),
      text("metrics-listen", &Config::metrics_listen,
           "HOST:PORT of /metrics (Prometheus), /healthz and /readyz over plain HTTP; none by default"),
      text(
          "record-dir", &Config::record_dir,
          "Folder, which must exist, to record sessions into, a .wfrec each, with all positions that clients "
          "send; none by default"),
      bytes("record-max-bytes", &Config::record_max_bytes, {.least = 1 << 16},
            "What recordings in that folder may hold in all, above which they stop and sessions go on"),
      bytes("record-queue-bytes", &Config::record_queue_bytes, {.least = 1 << 16},
            "What of all recordings may wait for the disk, above which a recording stops and its session "
            "goes on"),
      count("threads", &Config::threads, {.least = 0, .most = 1024},
            "Threads that steps run on; 0: as many as the machine has"),
      one_of("log-level", &Config::log_level, kLevels, "debug, info, warning, error or off"),
      one_of("log-format", &Config::log_format, kFormats, "text or json, one event a line on standard error"),
      text("trace-file", &TraceSettings::file,
           "File that traces of frames are appended to, as OTLP's JSON, a request a line; none by default"),
      text("trace-endpoint", &TraceSettings::endpoint,
           "Collector that traces of frames are sent to, http://HOST:PORT/v1/traces (OTLP over HTTP, JSON); "
           "none by default"),
      share("trace-sample", &TraceSettings::sample,
            "Share of frames that is traced, of calls without a traceparent; where a call has one, its flag "
            "decides"),
      text("audit-file", &Config::audit_file,
           "File that what administrators do is appended to, as JSON, an event a line, besides the log; none "
           "by default"),
      count("max-sessions", &Limits::max_sessions, {.least = 1}, "Sessions open at once"),
      count("max-sessions-per-principal", &Limits::max_sessions_per_principal, {.least = 0},
            "Sessions of one principal open at once; 0, here and below: three quarters of the daemon's limit "
            "where principals are told apart, else all"),
      count("max-vertices", &Limits::max_vertices, {.least = 1, .most = kMost32}, "Vertices in a session"),
      count("max-triangles", &Limits::max_triangles, {.least = 1, .most = kMost32}, "Triangles in a session"),
      count("max-contacts", &Limits::max_contacts, {.least = 1, .most = kMost32},
            "Contacts in an answer; a step with more fails"),
      bytes("max-front-bytes", &Limits::max_front_bytes, {.least = 1},
            "Memory of a session's front; above it steps traverse from the root"),
      bytes("max-session-bytes", &Limits::max_session_bytes, {.least = 1 << 16},
            "Memory of a session: scene, hierarchy, front, waiting frames and answers; by default 8GiB, and "
            "never more than --max-total-bytes or than this process may use, to which it is lowered, with a "
            "line in the log"),
      bytes("max-total-bytes", &Limits::max_total_bytes, {.least = 1 << 20},
            "Memory of all sessions; by default three quarters of what this process may use"),
      bytes("max-principal-bytes", &Limits::max_principal_bytes, {.least = 1 << 16, .or_zero = true},
            "Memory of all sessions of a principal; 0: three quarters where principals are told apart, else "
            "all"),
      count("max-streams-per-principal", &Limits::max_streams_per_principal, {.least = 0},
            "Streams of one principal open at once; 0: three quarters where principals are told apart, else "
            "all"),
      count("max-frames-per-principal", &Limits::max_frames_per_principal, {.least = 0},
            "Frames of one principal accepted and not yet computed; 0: three quarters where principals are "
            "told apart, "
            "else all"),
      count("max-uploads-per-principal", &Limits::max_uploads_per_principal, {.least = 0},
            "Sessions that one principal uploads at once; 0: a quarter of --max-sessions where principals "
            "are told apart, else all"),
      texts("quotas", &Config::quotas,
            "What single principals may have: \"PRINCIPAL sessions=8 bytes=4GiB streams=8 frames=32 "
            "uploads=2 weight=2\", each part optional; several with commas, or repeated. Words like these "
            "may also end a line of the token file, which overrides this setting",
            check_quotas),
      count("max-open-streams", &Limits::max_open_streams, {.least = 1},
            "Streams open at once, over all connections"),
      count("max-frames-in-flight", &Limits::max_frames_in_flight, {.least = 1},
            "Frames accepted and not yet computed, over all sessions"),
      bytes("max-queued-bytes", &Limits::max_queued_bytes, {.least = 1},
            "Answers that wait for a stream's client, above which no frames are read from it"),
      count("window", &Limits::window, {.least = 1, .most = 64},
            "Frames of a stream that may be unanswered; more are left unread"),
      bytes("answer-chunk-bytes", &Limits::answer_chunk_bytes, {.least = 64},
            "Contact bytes in one message of a streamed answer"),
      bytes("max-message-bytes", &Limits::max_message_bytes,
            {.least = 64 << 10, .most = std::size_t{1} << 30},
            "Size of one message; larger uploads, frames and answers come in parts"),
      duration("idle-timeout", &Limits::idle_timeout,
               "Time after which a session is closed without a stream, a request, or one being carried out"),
      duration("upload-timeout", &Limits::upload_timeout,
               "Time for a scene to arrive, for the parts of a frame, and for a stream to attach"),
      duration(
          "write-stall-timeout", &Limits::write_stall_timeout,
          "Time in which a client must take a message of an answer, or send one of an upload, or be cut off"),
      count(
          "self-check-steps", &Limits::self_check_steps, {.least = 0},
          "Steps of a session from one self-check of its hierarchy and front to the next; 0: only on demand"),
      bytes("transport-memory", &Config::transport_memory_bytes, {.least = 1 << 20},
            "Memory for messages in transit, over all connections"),
      count("max-streams-per-connection", &Limits::max_streams_per_connection, {.least = 1},
            "Calls at once on one connection; our clients open another for more", "max-streams"),
      count("max-connections-per-address", &Config::max_connections_per_address, {.least = 0},
            "TCP connections at once from one address (of IPv6, its first 64 bits), and a tenth of that to "
            "begin a second; 0: any number, for daemons behind a proxy that counts them"),
      count("max-metadata-bytes", &Config::max_metadata_bytes, {.least = 1024, .most = 1 << 20},
            "Headers of a call, in bytes"),
      duration("drain-timeout", &Config::drain_timeout,
               "Time that frames in hand get after SIGTERM or SIGINT")};
}

}  // namespace

std::span<const Setting> settings() {
  static const std::vector<Setting> all = table();
  return all;
}

}  // namespace warmfront::server
