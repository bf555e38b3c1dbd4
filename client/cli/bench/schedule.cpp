// SPDX-License-Identifier: Apache-2.0
#include "client/cli/bench/schedule.h"

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <queue>
#include <string_view>
#include <utility>

namespace warmfront::client {
namespace {

/// "engine/front/front.cpp:149", wherever the sources were built.
std::string place_of(const ForkTrace::Event& fork) {
  std::string_view file(fork.file);
  if (const std::size_t at = file.rfind("engine/"); at != std::string_view::npos) file.remove_prefix(at);
  return std::string(file) + ":" + std::to_string(fork.line);
}

}  // namespace

TaskGraph::TaskGraph(std::span<const ForkTrace::Event> events) {
  std::map<std::string, std::size_t> known;
  const auto place = [&](const std::string& name) {
    const auto [at, fresh] = known.try_emplace(name, places_.size());
    if (fresh) places_.push_back(name);
    return at->second;
  };
  const auto add = [&](double seconds, std::size_t at_place) {
    pieces_.push_back({seconds, 0, {}, at_place});
    work_ += seconds;
    return pieces_.size() - 1;
  };
  const auto link = [&](std::size_t from, std::size_t to) {
    pieces_[from].after.push_back(to);
    ++pieces_[to].before;
  };
  // A fork that is open: the piece it began behind, and the ends of its tasks so far.
  struct Open {
    std::string place;
    std::size_t began;
    std::vector<std::size_t> ends;
    std::size_t serial;  // the place of pieces outside
  };
  std::vector<Open> open;
  std::size_t last = kNone;  // of the task at hand
  std::size_t serial = place("before the first fork");
  for (const ForkTrace::Event& event : events) {
    switch (event.kind) {
      case ForkTrace::Kind::kStrand: {
        const std::size_t piece = add(event.seconds, serial);
        if (last != kNone) link(last, piece);
        last = piece;
        break;
      }
      case ForkTrace::Kind::kFork:
        open.push_back({place_of(event), last, {}, serial});
        break;
      case ForkTrace::Kind::kTask:
        last = open.back().began;
        serial = place("in " + open.back().place);
        break;
      case ForkTrace::Kind::kTaskEnd:
        open.back().ends.push_back(last);
        break;
      case ForkTrace::Kind::kJoin: {
        Open fork = std::move(open.back());
        open.pop_back();
        serial = open.empty() ? place("after " + fork.place) : fork.serial;
        const std::size_t join = add(0, serial);
        if (fork.ends.empty()) fork.ends.push_back(fork.began);
        for (const std::size_t end : fork.ends) link(end, join);
        last = join;
        break;
      }
    }
  }
  std::vector<double> begins(pieces_.size(), 0);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const double end = begins[i] + pieces_[i].seconds;
    span_ = std::max(span_, end);
    for (const std::size_t next : pieces_[i].after) begins[next] = std::max(begins[next], end);
  }
}

double TaskGraph::on_cores(std::size_t cores) const {
  std::vector<std::size_t> waits(pieces_.size());
  std::deque<std::size_t> ready;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    waits[i] = pieces_[i].before;
    if (waits[i] == 0) ready.push_back(i);
  }
  using Ending = std::pair<double, std::size_t>;
  std::priority_queue<Ending, std::vector<Ending>, std::greater<>> running;
  double now = 0;
  while (!ready.empty() || !running.empty()) {
    while (!ready.empty() && running.size() < cores) {
      const std::size_t piece = ready.front();
      ready.pop_front();
      running.push({now + pieces_[piece].seconds, piece});
    }
    const auto [end, piece] = running.top();
    running.pop();
    now = end;
    for (const std::size_t next : pieces_[piece].after)
      if (--waits[next] == 0) ready.push_back(next);
  }
  return now;
}

std::vector<TaskGraph::Share> TaskGraph::longest_chain() const {
  std::vector<double> ends(pieces_.size(), 0);
  std::vector<std::size_t> behind(pieces_.size(), kNone);
  std::size_t last = kNone;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    ends[i] = (behind[i] == kNone ? 0 : ends[behind[i]]) + pieces_[i].seconds;
    if (last == kNone || ends[i] > ends[last]) last = i;
    for (const std::size_t next : pieces_[i].after)
      if (behind[next] == kNone || ends[behind[next]] < ends[i]) behind[next] = i;
  }
  std::vector<Share> shares(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) shares[i].place = places_[i];
  for (std::size_t i = last; i != kNone; i = behind[i])
    shares[pieces_[i].place].seconds += pieces_[i].seconds;
  std::erase_if(shares, [](const Share& share) { return !(share.seconds > 0); });
  std::ranges::sort(shares, std::greater<>(), &Share::seconds);
  return shares;
}

}  // namespace warmfront::client
