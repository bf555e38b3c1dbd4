// SPDX-License-Identifier: Apache-2.0
// The verb `detect`: see detect.h. Its arguments: arguments.h; what it does with them: run.h.
#include "client/cli/detect/detect.h"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "client/cli/detect/arguments.h"
#include "client/cli/detect/run.h"
#include "client/cli/exit_codes.h"
#include "client/cli/frames/frame_steps.h"
#include "client/cli/recording/recorded_input.h"
#include "client/io/file.h"
#include "client/io/input.h"

namespace warmfront::client {
namespace {

Result<std::unique_ptr<Input>> open(const DetectArguments& arguments) {
  if (arguments.inputs.size() > 1 || !is_recording_name(arguments.inputs.front()))
    return open_input(arguments.inputs, 2,
                      arguments.remeshed ? TopologyChanges::kAny : TopologyChanges::kBuiltin);
  Result<RecordedScene> recorded = open_recorded_scene(arguments.inputs.front());
  if (!recorded) return recorded.error();
  return std::move(recorded.value().input);
}

int detect(DetectArguments arguments) {
  if (Status status = check_usage(arguments); !status) {
    // A tier that this build lacks is not a usage error.
    const bool missing = status.error().code == ErrorCode::kUnimplemented;
    return missing ? failure(status.error().message) : usage_error(status.error().message);
  }
  if (Status status = check_writable(std::array{arguments.json_file, arguments.files.html.file}); !status)
    return failure(status.error().message);
  Result<std::unique_ptr<Input>> opened = open(arguments);
  if (!opened) return failure(opened.error().message);
  Input& input = *opened.value();
  for (const Input* part = &input; part != nullptr; part = part->next()) print_notes(part->notes());

  FrameRange range{0, frames_of_all_parts(input) - 1};
  if (!arguments.frames.empty()) {
    const Result<FrameRange> parsed = parse_frame_range(arguments.frames, range.last + 1);
    if (!parsed) return usage_error(parsed.error().message);
    range = parsed.value();
  }
  const std::vector<PartRange> parts = parts_in(input, range);
  if (parts.size() > 1)
    if (Status status = check_topology_changes(arguments); !status)
      return usage_error(status.error().message);
  if (parts.size() > 1)
    std::fprintf(stderr,
                 "warmfront: the topology changes %zu time%s, first at frame %u (%s): there the new mesh "
                 "stands for the "
                 "same moment, and nothing is tested between the two\n",
                 parts.size() - 1, parts.size() == 2 ? "" : "s", parts[1].input->first_number(),
                 parts[1].input->name().c_str());
  DetectRun run(arguments, input, range);
  for (const PartRange& part : parts)
    if (Status status = run.part(part); !status) return failure(status.error().message);
  if (Status status = run.finish(); !status) return failure(status.error().message);
  return finish_output();
}

}  // namespace

Verb add_detect(CLI::App& app) {
  auto arguments = std::make_shared<DetectArguments>();
  add_detect_options(app, *arguments);
  return [arguments] { return detect(*arguments); };
}

}  // namespace warmfront::client
