// SPDX-License-Identifier: Apache-2.0
// How heavy sessions affect light ones: a daemon in this process, LIGHT sessions that step at a steady
// rate, and the same beside HEAVY sessions that step without pause. Prints the light steps' latency, from the
// planned time of each, in both cases.
//   fairness_bench [LIGHT [HEAVY [SECONDS]]]
#include <stdlib.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "client/lib/client.h"
#include "server/daemon.h"
#include "tests/unit/server/moving_grids.h"

namespace {

using namespace warmfront;
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

constexpr auto kPeriod = std::chrono::milliseconds(50);  // of a light session: 20 steps a second

[[noreturn]] void fail(const Error& error) {
  std::fprintf(stderr, "fairness_bench: %s\n", error.message.c_str());
  std::exit(2);
}

template <class T>
T must(Result<T> result) {
  if (!result) fail(result.error());
  return std::move(result).value();
}

client::Session open(client::Client& client, const test::MovingGrids& grids) {
  const std::vector<double> start = grids.positions(0);
  return must(client.create_session(grids.scene(), std::span<const double>(start)));
}

// Steps to and fro between two frames, so that making positions costs nothing.
struct Frames {
  explicit Frames(const test::MovingGrids& grids) : at{grids.positions(1), grids.positions(2)} {}
  std::span<const double> next() { return at[count++ % 2]; }
  std::vector<double> at[2];
  std::size_t count = 0;
};

struct Percentiles {
  std::vector<double> ms;
  double at(double q) const { return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1))]; }
};

Percentiles run(const std::string& address, int light, int heavy, std::chrono::seconds duration) {
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> heavy_steps{0};
  std::vector<std::vector<double>> latencies(static_cast<std::size_t>(light));
  std::vector<std::thread> threads;
  const test::MovingGrids large(220), small(20);
  for (int i = 0; i < heavy; ++i)
    threads.emplace_back([&] {
      client::Client client = must(client::Client::connect(address));
      client::Session session = open(client, large);
      for (Frames frames(large); !stop; ++heavy_steps) must(session.step(frames.next()));
    });
  while (heavy > 0 && heavy_steps < static_cast<std::uint64_t>(heavy))
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  for (int i = 0; i < light; ++i)
    threads.emplace_back([&, i] {
      client::Client client = must(client::Client::connect(address));
      client::Session session = open(client, small);
      Frames frames(small);
      must(session.step(frames.next()));
      std::vector<double>& mine = latencies[static_cast<std::size_t>(i)];
      const auto end = Clock::now() + duration;
      // Latency counts from the planned time: a late step does not shift the planned times after it.
      for (auto planned = Clock::now(); planned < end; planned += kPeriod) {
        std::this_thread::sleep_until(planned);
        must(session.step(frames.next()));
        mine.push_back(Milliseconds(Clock::now() - planned).count());
      }
    });
  for (auto thread = threads.begin() + heavy; thread != threads.end(); ++thread) thread->join();
  const std::uint64_t done = heavy_steps;
  stop = true;
  for (auto thread = threads.begin(); thread != threads.begin() + heavy; ++thread) thread->join();
  Percentiles all;
  for (const auto& mine : latencies) all.ms.insert(all.ms.end(), mine.begin(), mine.end());
  std::ranges::sort(all.ms);
  std::printf("| %d | %d | %zu | %.2f | %.2f | %.2f | %.2f | %.1f |\n", light, heavy, all.ms.size(),
              all.at(0.5), all.at(0.9), all.at(0.99), all.ms.back(),
              static_cast<double>(done) / static_cast<double>(duration.count()));
  std::fflush(stdout);
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int index, int fallback) {
    return argc > index ? std::atoi(argv[index]) : fallback;
  };
  const int light = argument(1, 4), heavy = argument(2, 1), seconds = argument(3, 5);
  if (light < 1 || heavy < 1 || seconds < 1) {
    std::fprintf(stderr, "usage: fairness_bench [LIGHT [HEAVY [SECONDS]]]\n");
    return 3;
  }
  std::string folder = (std::filesystem::temp_directory_path() / "warmfront_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) return 2;
  server::Config config;
  config.listen = {"unix:" + folder + "/d.sock"};
  std::ostringstream text;
  server::Log log(server::LogLevel::kWarning, server::LogFormat::kText, &text);
  {
    const auto daemon = must(server::Daemon::start(config, log));
    std::printf(
        "| light | heavy | light steps | p50 ms | p90 | p99 | max | heavy steps a second |\n"
        "|---|---|---|---|---|---|---|---|\n");
    run(config.listen[0], light, 0, std::chrono::seconds(seconds));
    run(config.listen[0], light, heavy, std::chrono::seconds(seconds));
  }
  std::filesystem::remove_all(folder);
  return 0;
}
