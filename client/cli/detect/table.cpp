// SPDX-License-Identifier: Apache-2.0
#include "client/cli/detect/table.h"

#include <cinttypes>
#include <cstdio>
#include <string>

#include "client/cli/print.h"

namespace warmfront::client {

void print_detect_header(bool half_spaces) {
  std::printf("%8s %9s %9s %s%9s %12s %10s %9s %9s %9s %9s %11s %s\n", "frame", "vf", "ee",
              half_spaces ? "       vh " : "", "possible", "earliest toi", "total ms", "refit", "front",
              "elem.", "adjacent", "tri. pairs", "front");
}

void print_detect_row(const FrameReport& frame, bool half_spaces) {
  char vh[32] = "";
  if (half_spaces) std::snprintf(vh, sizeof vh, "%9" PRIu64 " ", frame.vh);
  char toi[32] = "-";
  if (frame.earliest_toi) std::snprintf(toi, sizeof toi, "%.9f", *frame.earliest_toi);
  const StageTimes& ms = frame.statistics.ms;
  const std::string state(to_string(frame.statistics.front_state));
  std::printf("%8" PRIu64 " %9" PRIu64 " %9" PRIu64 " %s%9" PRIu64
              " %12s %10.3f %9.3f %9.3f %9.3f %9.3f %11" PRIu64 " %s\n",
              frame.frame, frame.vf, frame.ee, vh, frame.possible, toi, ms.total, ms.refit, ms.front,
              ms.elementary, ms.adjacent, frame.statistics.counts.triangle_pairs, state.c_str());
  std::fflush(stdout);
}

void print_detect_summary(const DetectReport& report) {
  std::uint64_t vf = 0, ee = 0, vh = 0, possible = 0;
  double ms = 0;
  for (const FrameReport& frame : report.frames) {
    vf += frame.vf;
    ee += frame.ee;
    vh += frame.vh;
    possible += frame.possible;
    ms += frame.statistics.ms.total;
  }
  const std::string edges = report.edges > 0 ? counted(report.edges, "edge") + ", " : "";
  const std::string of_half_spaces = vh > 0 ? ", " + std::to_string(vh) + " vh" : "";
  std::printf("%s of %s, %s%" PRIu64 " %s: %s (%" PRIu64 " vf, %" PRIu64 " ee%s; %" PRIu64
              " possible), %.3f ms a step on %s\n",
              counted(report.frames.size(), "step").c_str(), counted(report.triangles, "triangle").c_str(),
              edges.c_str(), report.vertices, report.vertices == 1 ? "vertex" : "vertices",
              counted(vf + ee + vh, "contact").c_str(), vf, ee, of_half_spaces.c_str(), possible,
              ms / static_cast<double>(report.frames.size()),
              counted(static_cast<std::uint64_t>(report.threads), "thread").c_str());
  if (!report.contacts_hash.empty()) std::printf("contacts hash %s\n", report.contacts_hash.c_str());
}

}  // namespace warmfront::client
