// SPDX-License-Identifier: Apache-2.0
#include "server/observe/tracer.h"

#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <exception>
#include <limits>
#include <mutex>
#include <new>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "server/observe/http_post.h"
#include "server/observe/otlp.h"
#include "server/observe/private_file.h"

namespace warmfront::server {
namespace {

using Clock = std::chrono::steady_clock;

std::mt19937_64& random_bits() {
  thread_local std::mt19937_64 random{std::random_device{}()};
  return random;
}

template <std::size_t kSize>
std::array<std::uint8_t, kSize> random_id() {
  std::array<std::uint8_t, kSize> id;
  do {
    for (std::size_t i = 0; i < kSize; i += 8) {
      std::uint64_t bits = random_bits()();
      for (std::size_t k = i; k < i + 8; ++k, bits >>= 8) id[k] = static_cast<std::uint8_t>(bits);
    }
  } while (id == std::array<std::uint8_t, kSize>{});  // which stands for none
  return id;
}

/// Host and process: what OpenTelemetry's service.instance.id asks for, unique among the daemons of a
/// cluster.
std::string instance() {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  return std::string(host.data()) + ":" + std::to_string(getpid());
}

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

struct Tracer::Impl {
  // Constant after start().
  double sample = 0;
  std::unique_ptr<std::FILE, Close> file;  // written by the sending thread
  std::optional<HttpTarget> endpoint;
  std::function<void(const std::string&)> warn;
  const std::string name = instance();

  std::mutex mutex;
  std::condition_variable wake;
  std::vector<FrameTrace> waiting;  // room for kMostWaiting: what comes in needs no memory
  bool ending = false;

  // Used by the sending thread.
  std::vector<FrameTrace> batch;
  Clock::time_point warned = Clock::time_point::min();
  std::uint64_t unsaid = 0;  // frames since then
  std::thread thread;

  /// Why not all of it went; none if it did.
  std::optional<std::string> send(const std::string& request) {
    std::optional<std::string> failed;
    if (file && (std::fwrite(request.data(), 1, request.size(), file.get()) != request.size() ||
                 std::fputc('\n', file.get()) == EOF || std::fflush(file.get()) != 0))
      failed = "trace-file: it cannot be written";
    if (!endpoint) return failed;
    if (auto why = http_post(*endpoint, "application/json", request)) failed = "trace-endpoint: " + *why;
    return failed;
  }

  void report(const std::string& why, std::size_t frames) {
    unsaid += frames;
    constexpr std::chrono::minutes kBetween{1};
    const Clock::time_point now = Clock::now();
    if (warned != Clock::time_point::min() && now - warned < kBetween) return;
    warned = now;
    warn(why + ": " + std::to_string(unsaid) + " frames' traces did not go there");
    unsaid = 0;
  }
};

Tracer::Tracer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<Tracer>> Tracer::start(const TraceSettings& settings,
                                              std::function<void(const std::string&)> warn) {
  auto impl = std::make_unique<Impl>();
  impl->sample = settings.sample;
  impl->warn = std::move(warn);
  if (!settings.endpoint.empty()) {
    Result<HttpTarget> target = HttpTarget::parse(settings.endpoint);
    if (!target) return invalid_argument("trace-endpoint " + target.error().message);
    impl->endpoint = std::move(target).value();
  }
  if (!settings.file.empty()) {
    const Result<int> opened = open_private_file("trace-file", settings.file);
    if (!opened) return opened.error();
    impl->file.reset(::fdopen(opened.value(), "a"));
    if (!impl->file) {
      ::close(opened.value());
      return invalid_argument("trace-file " + settings.file + ": it cannot be opened for writing");
    }
  }
  impl->waiting.reserve(kMostWaiting);
  impl->batch.reserve(kMostWaiting);
  std::unique_ptr<Tracer> tracer(new Tracer(std::move(impl)));
  tracer->impl_->thread = std::thread([&tracer = *tracer] {
    Impl& impl = *tracer.impl_;
    constexpr std::chrono::seconds kMostWait{1};
    for (bool ending = false; !ending;) {
      {
        std::unique_lock lock(impl.mutex);
        impl.wake.wait_for(lock, kMostWait,
                           [&] { return impl.ending || impl.waiting.size() >= kMostWaiting / 4; });
        ending = impl.ending;
        std::swap(impl.batch, impl.waiting);
      }
      if (impl.batch.empty()) continue;
      std::optional<std::string> failed;
      try {
        failed = impl.send(otlp_json(impl.batch, impl.name));
      } catch (const std::exception&) {  // no memory for it now
        failed = "traces: no memory to write them";
      }
      (failed ? tracer.dropped_ : tracer.sent_).fetch_add(impl.batch.size(), std::memory_order_relaxed);
      const std::size_t frames = impl.batch.size();
      impl.batch.clear();
      if (!failed) continue;
      try {
        impl.report(*failed, frames);
      } catch (const std::exception&) {  // a line of the log
      }
    }
  });
  return tracer;
}

Tracer::~Tracer() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
  }
  impl_->wake.notify_one();
  if (impl_->thread.joinable()) impl_->thread.join();
}

std::unique_ptr<FrameTrace> Tracer::begin(const std::optional<TraceContext>& caller, const char* method,
                                          std::string_view session, std::uint64_t frame) noexcept try {
  if (caller ? !caller->sampled
             : static_cast<double>(random_bits()()) >=
                   impl_->sample * static_cast<double>(std::numeric_limits<std::uint64_t>::max()))
    return nullptr;
  std::unique_ptr<FrameTrace> trace(new (std::nothrow) FrameTrace);
  if (!trace) {
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return nullptr;
  }
  if (caller) {
    trace->context = *caller;
  } else {
    trace->context.trace = random_id<16>();
    trace->context.sampled = true;
  }
  trace->span = random_id<8>();
  trace->method = method;
  trace->set_session(session);
  trace->frame = frame;
  return trace;
} catch (const std::exception&) {  // std::random_device, of a thread's first trace
  dropped_.fetch_add(1, std::memory_order_relaxed);
  return nullptr;
}

void Tracer::finish(std::unique_ptr<FrameTrace> trace) noexcept {
  if (!trace) return;
  bool wake = false;
  {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->waiting.size() == kMostWaiting) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    impl_->waiting.push_back(*trace);
    wake = impl_->waiting.size() == kMostWaiting / 4;
  }
  if (wake) impl_->wake.notify_one();
}

}  // namespace warmfront::server
