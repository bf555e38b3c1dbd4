// SPDX-License-Identifier: Apache-2.0
// What a daemon adds to a step of a solver that waits for each answer: the same frames stepped by a collider
// in this process and by sessions behind a daemon, in turn. Prints a table, and passes no verdict.
//   lockstep_bench ADDRESS INPUT [STEPS [SEPARATION [THREADS]]]
// An input is a folder, or builtin:NAME, and is played forward and backward: 200 steps, no separation, and
// all threads of the machine in this process, unless given.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/io/input.h"
#include "client/lib/client.h"
#include "engine/collider.h"
#include "tests/bench/timing.h"

namespace warmfront {
namespace {

using client::Answer;
using client::view;
using testing::median;
using testing::timed;

double least(const std::vector<double>& values) {
  return *std::ranges::min_element(values);
}

/// A session behind the daemon, and where the time of its steps goes.
struct Remote {
  const char* name;
  client::Session session;
  std::vector<double> ms = {};
  std::vector<double> encode = {}, queue = {}, step = {}, decode = {};

  void took(const Answer& answer) {
    encode.push_back(answer.travel.encode_ms);
    queue.push_back(answer.travel.queue_ms);
    step.push_back(answer.statistics.ms.total);
    decode.push_back(answer.travel.decode_ms);
  }
};

int run(const std::string& address, const std::string& name, int steps, double separation, int threads) {
  auto input = client::open_input(std::span(&name, 1));
  if (!input) {
    std::fprintf(stderr, "%s\n", input.error().message.c_str());
    return 2;
  }
  std::vector<client::PositionBuffer> frames(std::min(input.value()->frame_count(), 100U));
  for (std::uint32_t f = 0; f < frames.size(); ++f)
    if (const Status read = input.value()->read_frame(f, frames[f]); !read) {
      std::fprintf(stderr, "%s\n", read.error().message.c_str());
      return 2;
    }
  const SceneDescription& description = input.value()->scene();
  ColliderOptions options;
  options.min_separation = separation;
  Collider here = Collider::create(std::make_shared<const Scene>(Scene::create(description).value()),
                                   view(frames[0]), options, std::make_shared<Workers>(threads))
                      .value();
  std::vector<client::Client> clients;
  std::vector<Remote> remotes;
  const auto connect = [&](const char* title, const client::ClientOptions& how) {
    clients.push_back(client::Client::connect(address, how).value());
    remotes.push_back({title, clients.back().create_session(description, view(frames[0]), options).value()});
  };
  connect("stream", {.shared_memory = false});
  connect("shared", {});

  std::vector<double> in_process;
  std::vector<double> engine;
  std::uint64_t contacts = 0;
  constexpr int kUnmeasured = 5;  // which build the front
  for (int i = 1; i <= steps + kUnmeasured; ++i) {
    const auto period = static_cast<int>(2 * (frames.size() - 1));
    const int at = i % period;
    const auto f = static_cast<std::size_t>(std::min(at, period - at));
    std::vector<double> ms;
    const auto one = timed(ms, [&] { return here.step(view(frames[f])).value(); });
    const bool measured = i > kUnmeasured;
    if (measured) {
      in_process.push_back(ms[0]);
      engine.push_back(one.statistics.ms.total);
      contacts += one.contacts.size();
    }
    for (Remote& remote : remotes) {
      ms.clear();
      const Answer answer = timed(ms, [&] { return remote.session.step(Frame(view(frames[f]))).value(); });
      if (answer.contacts.size() != one.contacts.size() || answer.earliest_toi != one.earliest_toi)
        std::printf("frame %d: another answer behind the daemon\n", i);
      if (!measured) continue;
      remote.ms.push_back(ms[0]);
      remote.took(answer);
    }
  }
  std::printf("%s: %u vertices, %d steps, %.0f contacts a step; in process %.3f ms a step (least %.3f)\n",
              name.c_str(), description.vertex_count, steps, static_cast<double>(contacts) / steps,
              median(in_process), least(in_process));
  for (const Remote& remote : remotes) {
    std::vector<double> ratios;
    std::vector<double> more;
    std::vector<double> around;
    for (std::size_t i = 0; i < in_process.size(); ++i) {
      ratios.push_back(remote.ms[i] / in_process[i]);
      more.push_back(1e3 * (remote.ms[i] - in_process[i]));
      around.push_back(1e3 * (remote.ms[i] - remote.step[i]));
    }
    std::printf(
        "  %-8s %.3f ms (least %.3f): %.3f of in process (of medians %.3f), %.0f us more; engine there %.3f "
        "ms, "
        "around it %.0f us (least %.0f): encode %.0f, queue %.0f, decode %.0f, the rest %.0f\n",
        remote.name, median(remote.ms), least(remote.ms), median(ratios),
        median(remote.ms) / median(in_process), median(more), median(remote.step), median(around),
        least(around), 1e3 * median(remote.encode), 1e3 * median(remote.queue), 1e3 * median(remote.decode),
        median(around) - 1e3 * (median(remote.encode) + median(remote.queue) + median(remote.decode)));
  }
  return 0;
}

}  // namespace
}  // namespace warmfront

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: lockstep_bench ADDRESS INPUT [STEPS [SEPARATION [THREADS]]]\n");
    return 2;
  }
  const auto number = [&](int i, double otherwise) { return argc > i ? std::atof(argv[i]) : otherwise; };
  return warmfront::run(argv[1], argv[2], static_cast<int>(number(3, 200)), number(4, 0),
                        static_cast<int>(number(5, 0)));
}
