// SPDX-License-Identifier: Apache-2.0
// The verb `merge`: see merge.h.
#include "client/cli/merge/merge.h"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/merge/contacts.h"
#include "client/cli/merge/merged.h"
#include "client/cli/merge/part.h"
#include "client/io/contact_writer.h"
#include "client/io/file.h"
#include "client/io/staged_file.h"

namespace warmfront::client {
namespace {

struct MergeArguments {
  std::vector<std::string> reports;
  std::string frames;
  std::string contacts;
  std::string json_file;
  bool steps = false;
};

int say_missing(const Merged& merged) {
  std::string list;
  std::uint64_t frames = 0;
  for (const FrameRange gap : merged.missing) {
    list += (list.empty() ? "" : ", ") + to_text(gap);
    frames += gap.last - gap.first;
  }
  std::fflush(stdout);
  std::fprintf(stderr,
               "warmfront: no report has the steps of frames %s (%llu of %u missing); run 'warmfront detect "
               "--frames' for each, and merge again\n",
               list.c_str(), static_cast<unsigned long long>(frames),
               merged.frames.last - merged.frames.first);
  return kExitNo;
}

int merge(const MergeArguments& a) {
  if (!a.contacts.empty() && !is_contact_file_name(a.contacts))
    return usage_error("--contacts " + a.contacts +
                       ": the name must end in .csv, .jsonl or .vtp, or be - for CSV on stdout");
  if (Status status = check_one_stdout({{"--json", a.json_file}, {"--contacts", a.contacts}}); !status)
    return usage_error(status.error().message);
  if (Status status = check_writable(std::array{a.json_file, a.contacts}); !status)
    return failure(status.error().message);
  std::vector<Part> parts;
  for (const std::string& path : a.reports) {
    Result<Part> part = read_part(path);
    if (!part) return failure(part.error().message);
    parts.push_back(std::move(part).value());
  }
  if (Status status = order_parts(parts); !status) return failure(status.error().message);
  FrameRange frames{0, parts.front().range.last_of_input};
  if (!a.frames.empty()) {
    const Result<FrameRange> parsed = parse_frame_range(a.frames, frames.last + 1);
    if (!parsed) return usage_error(parsed.error().message);
    frames = parsed.value();
  }
  Result<std::vector<FrameRange>> missing = missing_ranges(parts, frames);
  if (!missing) return failure(missing.error().message);
  const Merged merged = merge_parts(parts, frames, std::move(missing).value());
  const bool whole = merged.missing.empty();
  std::optional<WrittenContacts> contacts;
  std::optional<StagedFile> contacts_file, json_file;
  if (whole && !a.contacts.empty()) {
    Result<StagedFile> staged = StagedFile::create(a.contacts);
    if (!staged) return failure(staged.error().message);
    contacts_file.emplace(std::move(staged).value());
    Result<WrittenContacts> written = merge_contacts(parts, a.contacts, contacts_file->path());
    if (!written) return failure(written.error().message);
    if (a.contacts != "-") {
      contacts = std::move(written).value();
      if (!a.json_file.empty()) contacts->file = beside_report(contacts->file, a.json_file);
    }
  }
  if (a.json_file != "-" && a.contacts != "-") {
    const Steps few = a.json_file.empty() ? Steps::kWorst : Steps::kNone;
    print(merged, parts, a.steps ? Steps::kAll : few);
  }
  if (!a.json_file.empty()) {
    Result<StagedFile> staged = StagedFile::create(a.json_file);
    if (!staged) return failure(staged.error().message);
    json_file.emplace(std::move(staged).value());
    if (Status status = write_text(json_file->path(), format_json(merged, parts, contacts)); !status)
      return failure(status.error().message);
  }
  // Only now, when nothing else can fail, do the files replace what was there.
  for (std::optional<StagedFile>* file : {&contacts_file, &json_file})
    if (file->has_value())
      if (Status status = (*file)->commit(); !status) return failure(status.error().message);
  const int printed = finish_output();
  return whole || printed != kExitOk ? printed : say_missing(merged);
}

}  // namespace

Verb add_merge(CLI::App& app) {
  auto arguments = std::make_shared<MergeArguments>();
  MergeArguments& a = *arguments;
  app.add_option(
         "REPORT", a.reports,
         "Reports of 'detect --json' over ranges of one input (--frames), in any order; or of this verb")
      ->required();
  app.add_option(
         "--frames", a.frames,
         "The steps that are to be there: from frame FIRST to frame LAST; all of the input if not given")
      ->type_name("FIRST:LAST");
  app.add_option(
         "--contacts", a.contacts,
         "Join the contacts that the runs wrote to files, as one run would have written them: .csv, .jsonl "
         "or .vtp, as they are; - for stdout, of .csv and without other output. Nothing is written when a "
         "step is missing")
      ->type_name("FILE");
  app.add_option("--json", a.json_file, "Write the merged report as JSON; - for stdout, without other output")
      ->type_name("FILE");
  app.add_flag("--steps", a.steps,
               "Print a line for each step, behind the totals; else for the " + std::to_string(kWorstLines) +
                   " with the most contacts, and with --json for none");
  app.footer(
      "Exit codes: 0 all steps are there, 1 some are missing (which, is said; --json is written with "
      "them in 'missing', --contacts is not), 2 failed: the reports are not "
      "of one "
      "run, or have frames in common, 3 usage.");
  return [arguments] { return merge(*arguments); };
}

}  // namespace warmfront::client
