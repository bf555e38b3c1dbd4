// SPDX-License-Identifier: Apache-2.0
// The verb `tangled`: see tangled.h.
#include "client/cli/states/tangled.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/frames/model_summary.h"
#include "client/cli/html/html_options.h"
#include "client/cli/interrupt.h"
#include "client/cli/print.h"
#include "client/cli/states/page.h"
#include "client/cli/states/states.h"
#include "client/cli/states/tangle.h"
#include "client/io/contact_writer.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// The arguments as given.
struct TangledArguments {
  StateArguments states;
  bool any = false;
  std::string pairs_file;
  std::string json_file;
  HtmlArguments html;
};

/// One frame's answer.
struct TangledFrame {
  std::uint64_t frame;
  std::uint64_t pairs;
  std::optional<EdgeFace> first;
  double ms;
};

Status check_usage(const TangledArguments& arguments) {
  if (arguments.any && !arguments.pairs_file.empty())
    return invalid_argument("--any lists no pairs for --pairs; leave one of them out");
  if (arguments.any && !arguments.html.file.empty())
    return invalid_argument("--any lists no pairs for --html; leave one of them out");
  if (Status status = check_one_stdout({{"--json", arguments.json_file},
                                        {"--pairs", arguments.pairs_file},
                                        {"--html", arguments.html.file}});
      !status)
    return status;
  return arguments.states.check();
}

/// A line a pair: frame,e0,e1,f0,f1,f2,x,y,z.
void append_lines(std::string& lines, std::uint64_t frame, const std::vector<EdgeFace>& pairs,
                  const Positions& at) {
  for (const EdgeFace& pair : pairs) {
    lines += std::to_string(frame);
    for (const std::uint32_t vertex : pair) lines.append(",").append(std::to_string(vertex));
    for (const double x : place_of(pair, at)) append_round_trip(lines += ',', x);
    lines += '\n';
  }
}

Json format_json(const ModelSummary& model, const std::vector<TangledFrame>& frames) {
  std::uint64_t tangled = 0;
  Json list = Json::array();
  for (const TangledFrame& frame : frames) {
    tangled += frame.pairs > 0 ? 1 : 0;
    list.push_back({{"frame", frame.frame},
                    {"pairs", frame.pairs},
                    {"first", frame.first ? Json(*frame.first) : Json(nullptr)},
                    {"ms", frame.ms}});
  }
  Json root{{"tangled_frames", tangled}};
  add_to(root, model);
  root["frames"] = std::move(list);
  return root;
}

void print_frame(const TangledFrame& frame, const Positions& at) {
  const WholeRow row;
  std::printf("%8" PRIu64 " %10" PRIu64 " %10.3f", frame.frame, frame.pairs, frame.ms);
  if (frame.first) std::printf("  %s", describe(*frame.first, at).c_str());
  std::printf("\n");
  std::fflush(stdout);
}

int tangled(const TangledArguments& arguments) {
  if (Status status = check_usage(arguments); !status) return usage_error(status.error().message);
  const std::array written_files{arguments.json_file, arguments.pairs_file, arguments.html.file};
  if (Status status = check_writable(written_files); !status) return failure(status.error().message);
  States states;
  if (const std::optional<int> failed = states.open(arguments.states)) return *failed;
  std::optional<StatesPage> page;
  if (!arguments.html.file.empty()) {
    Result<StatesPage> started =
        StatesPage::start(arguments.html, PageOf::kTangled, arguments.states.inputs.front(), states);
    if (!started) return failure(started.error().message);
    page.emplace(std::move(started).value());
  }
  const bool table = std::ranges::find(written_files, "-") == written_files.end();
  if (table) std::printf("%8s %10s %10s\n", "frame", "pairs", "ms");
  std::vector<TangledFrame> frames;
  std::string lines = "frame,e0,e1,f0,f1,f2,x,y,z\n";
  const QuestionOptions question{.report = arguments.any ? Report::kAny : Report::kAll};
  const int looked = states.each([&](AnySession& session) -> Status {
    const auto start = std::chrono::steady_clock::now();
    const Result<Answer> answer = session.intersections(Where::kBase, question);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    if (!answer) return answer.error();
    const std::vector<EdgeFace>& pairs = answer.value().contacts.edge_faces;
    frames.push_back({states.number(), answer.value().ef, {}, ms.count()});
    if (!pairs.empty()) frames.back().first = pairs.front();
    if (!arguments.pairs_file.empty()) append_lines(lines, states.number(), pairs, states.positions());
    if (table) print_frame(frames.back(), states.positions());
    return page ? page->add_tangled(states, answer.value(), ms.count()) : Status();
  });
  if (looked != kExitOk) return looked;
  if (!arguments.pairs_file.empty()) {
    if (Status status = write_text(arguments.pairs_file, lines); !status)
      return failure(status.error().message);
  }
  if (page) {
    if (Status status = page->write(Json::object()); !status) return failure(status.error().message);
  }
  const Json json = format_json(summary_of(states.scene()), frames);
  if (!arguments.json_file.empty()) {
    if (Status status = write_text(arguments.json_file, json.dump(1) + "\n"); !status)
      return failure(status.error().message);
  }
  const auto bad = json["tangled_frames"].get<std::uint64_t>();
  if (table) std::printf("%" PRIu64 " of %s tangled\n", bad, counted(frames.size(), "frame").c_str());
  const int written = finish_output();
  return written != kExitOk ? written : bad > 0 ? kExitNo : kExitOk;
}

}  // namespace

Verb add_tangled(CLI::App& app) {
  auto arguments = std::make_shared<TangledArguments>();
  TangledArguments& a = *arguments;
  add_state_arguments(app, a.states);
  app.add_flag("--any", a.any, "Only whether there are any in a frame: stop at the first");
  app.add_option("--pairs", a.pairs_file,
                 "Write the pairs as CSV, a line each: the vertices of edge and face, and the middle of the "
                 "edge; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--json", a.json_file, "Write the report as JSON; - for stdout, without other output")
      ->type_name("FILE");
  add_html_options(app, a.html, "the meshes in each frame, the edges that meet faces, counts and times");
  app.footer("Exit code 1: an edge meets a face that it shares no vertex with.");
  return [arguments] { return tangled(*arguments); };
}

}  // namespace warmfront::client
