// SPDX-License-Identifier: Apache-2.0
// The verb `near`: see near.h.
#include "client/cli/states/near.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/contact_fields.h"
#include "client/cli/exit_codes.h"
#include "client/cli/frames/model_summary.h"
#include "client/cli/html/html_options.h"
#include "client/cli/interrupt.h"
#include "client/cli/print.h"
#include "client/cli/states/page.h"
#include "client/cli/states/states.h"
#include "client/io/contact_writer.h"
#include "client/io/file.h"
#include "engine/contact_hash.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// The arguments as given.
struct NearArguments {
  StateArguments states;
  double distance = 0;
  bool of_diagonal = false;
  std::string tier{to_string(ColliderOptions{}.tier)};
  bool count = false;
  bool reduced = false;
  std::vector<std::string> fields;
  std::string contacts_file;
  std::string distances_file;
  std::string json_file;
  HtmlArguments html;
};

/// One frame's answer.
struct NearFrame {
  std::uint64_t frame;
  std::uint64_t vf;
  std::uint64_t ee;
  std::uint64_t vh;
  std::uint64_t possible;
  std::size_t rows;
  std::optional<double> least;  ///< distance, of the pairs that are listed
  double ms;
};

Status check_usage(const NearArguments& arguments) {
  if (!(arguments.distance >= 0 && std::isfinite(arguments.distance)))
    return invalid_argument("--distance: give a finite length >= 0");
  if (arguments.count && !arguments.contacts_file.empty())
    return invalid_argument("--count lists no pairs for --contacts; leave one of them out");
  if (arguments.count && !arguments.html.file.empty())
    return invalid_argument("--count lists no pairs for --html; leave one of them out");
  if (arguments.count && arguments.reduced)
    return invalid_argument("--count lists no pairs for --reduced; leave one of them out");
  if (!arguments.fields.empty() && arguments.contacts_file.empty())
    return invalid_argument("--fields are of --contacts, which is not given");
  if (!arguments.contacts_file.empty() && !is_contact_file_name(arguments.contacts_file))
    return invalid_argument("--contacts " + arguments.contacts_file +
                            ": give a .csv, .jsonl or .vtp file, or -");
  if (Status status = check_one_stdout({{"--json", arguments.json_file},
                                        {"--contacts", arguments.contacts_file},
                                        {"--vertex-distances", arguments.distances_file},
                                        {"--html", arguments.html.file}});
      !status)
    return status;
  return arguments.states.check();
}

/// Of the box around all positions.
double diagonal(const Positions& positions) {
  std::array<double, 3> least{};
  std::array<double, 3> greatest{};
  std::visit(
      [&](auto values) {
        for (std::size_t i = 0; i < values.size(); ++i) {
          const auto x = static_cast<double>(values[i]);
          least[i % 3] = i < 3 ? x : std::min(least[i % 3], x);
          greatest[i % 3] = i < 3 ? x : std::max(greatest[i % 3], x);
        }
      },
      positions);
  return std::hypot(greatest[0] - least[0], greatest[1] - least[1], greatest[2] - least[2]);
}

/// Asks the session about every frame, and writes what it answers.
class Listing {
 public:
  Listing(const NearArguments& arguments, double distance, ContactFields fields,
          std::unique_ptr<ContactWriter> writer, StatesPage* page)
      : distance_(distance), wanted_(fields), writer_(std::move(writer)), page_(page) {
    question_.tier = parse_tier(arguments.tier).value();
    if (arguments.count) question_.report = Report::kCount;
    if (!arguments.count) fields.squared_distance = true;
    question_.reduced = arguments.reduced;
    question_.fields = fields;
  }

  Status look(AnySession& session, const States& states) {
    const auto start = std::chrono::steady_clock::now();
    const Result<Answer> answer = session.proximity(distance_, Where::kBase, question_);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    if (!answer) return answer.error();
    const ContactTable& table = answer.value().contacts;
    NearFrame frame{states.number(),
                    answer.value().vf,
                    answer.value().ee,
                    answer.value().vh,
                    answer.value().possible,
                    table.size(),
                    {},
                    ms.count()};
    if (table.size() > 0) frame.least = std::sqrt(*std::ranges::min_element(table.squared_distance));
    frames_.push_back(frame);
    hash_.begin_step(table.size());
    for (std::size_t i = 0; i < table.size(); ++i)
      hash_.add(table.kind[i], table.status[i], table.vertices[i], table.toi[i]);
    for (std::size_t i = 0; i < table.multiplicity.size(); ++i) hash_.add_closest_pair(table.closest_pair(i));
    if (page_) {
      if (Status status = page_->add_near(states, distance_, answer.value(), ms.count()); !status)
        return status;
    }
    const Positions at = states.positions();
    return writer_ ? writer_->write(states.number(), at, at, records_of(table), geometry_of(table))
                   : Status{};
  }

  Status close() { return writer_ ? writer_->close() : Status{}; }

  const std::vector<NearFrame>& frames() const { return frames_; }
  std::string hash() const { return hash_.hex(); }

 private:
  static std::vector<ContactRecord> records_of(const ContactTable& table) {
    std::vector<ContactRecord> records;
    records.reserve(table.size());
    for (std::size_t i = 0; i < table.size(); ++i)
      records.push_back(
          {table.kind[i], table.status[i], table.vertices[i], table.toi[i], table.closest_pair(i)});
    return records;
  }
  std::vector<ContactGeometry> geometry_of(const ContactTable& table) const {
    std::vector<ContactGeometry> geometry(wanted_.any() ? table.size() : 0);
    for (std::size_t i = 0; i < geometry.size(); ++i) geometry[i] = table.geometry(i);
    return geometry;
  }

  double distance_;
  QuestionOptions question_;
  ContactFields wanted_;
  std::unique_ptr<ContactWriter> writer_;
  StatesPage* page_;  // may be null
  std::vector<NearFrame> frames_;
  ContactHash hash_;
};

/// Writes how far each vertex is from anything, frame by frame.
class DistanceFile {
 public:
  static Result<DistanceFile> create(const std::string& path) {
    Result<OutputFile> file = OutputFile::create_whole(path);
    if (!file) return file.error();
    file.value().write("frame,vertex,distance\n");
    return DistanceFile(std::move(file).value());
  }

  Status look(AnySession& session, std::uint64_t number, double distance, const QuestionOptions& question) {
    const Result<Answer> answer = session.vertex_distances(distance, Where::kBase, question);
    if (!answer) return answer.error();
    const std::vector<double>& distances = answer.value().vertex_distances;
    std::string lines;
    for (std::size_t v = 0; v < distances.size(); ++v) {
      lines.append(std::to_string(number)).append(",").append(std::to_string(v)).append(",");
      append_round_trip(lines, distances[v]);
      lines += '\n';
      if (lines.size() <= kBlock && v + 1 < distances.size()) continue;
      file_.write(lines);
      lines.clear();
    }
    return file_.flush();
  }
  Status close() { return file_.close(); }

 private:
  explicit DistanceFile(OutputFile file) : file_(std::move(file)) {}

  static constexpr std::size_t kBlock = std::size_t{1} << 16;
  OutputFile file_;
};

Json format_json(const NearArguments& arguments, const ModelSummary& model, double distance,
                 const Listing& listing) {
  Json frames = Json::array();
  for (const NearFrame& frame : listing.frames()) {
    Json& told = frames.emplace_back(Json{{"frame", frame.frame},
                                          {"vf", frame.vf},
                                          {"ee", frame.ee},
                                          {"vh", frame.vh},
                                          {"possible", frame.possible}});
    if (arguments.reduced) told["rows"] = frame.rows;
    told["least_distance"] = frame.least ? Json(*frame.least) : Json(nullptr);
    told["ms"] = frame.ms;
  }
  Json root{{"tier", arguments.tier}, {"distance", distance}};
  if (!arguments.count) root["contacts_hash"] = listing.hash();
  add_to(root, model);
  root["frames"] = std::move(frames);
  return root;
}

// With a column for half-spaces where there are any.
void print_frame(const NearFrame& frame, bool reduced, bool half_spaces) {
  char least[32] = "-";
  if (frame.least) std::snprintf(least, sizeof least, "%.6g", *frame.least);
  const WholeRow row;
  std::printf("%8" PRIu64 " %10" PRIu64 " %10" PRIu64, frame.frame, frame.vf, frame.ee);
  if (half_spaces) std::printf(" %10" PRIu64, frame.vh);
  std::printf(" %10" PRIu64, frame.possible);
  if (reduced) std::printf(" %10zu", frame.rows);
  std::printf(" %14s %10.3f\n", least, frame.ms);
  std::fflush(stdout);
}

int near(const NearArguments& arguments) {
  if (Status status = check_usage(arguments); !status) return usage_error(status.error().message);
  if (Status status = check_writable(std::array{arguments.json_file, arguments.html.file}); !status)
    return failure(status.error().message);
  States states;
  if (const std::optional<int> failed = states.open(arguments.states)) return *failed;
  const double distance =
      arguments.of_diagonal ? arguments.distance * diagonal(states.positions()) : arguments.distance;
  const ContactFields fields = fields_named(arguments.fields);
  WrittenFields written = fields;
  written.closest_pair = arguments.reduced;
  std::unique_ptr<ContactWriter> writer;
  if (!arguments.contacts_file.empty()) {
    Result<std::unique_ptr<ContactWriter>> made = open_contact_writer(arguments.contacts_file, written);
    if (!made) return failure(made.error().message);
    writer = std::move(made).value();
  }
  std::optional<DistanceFile> distances;
  if (!arguments.distances_file.empty()) {
    Result<DistanceFile> made = DistanceFile::create(arguments.distances_file);
    if (!made) return failure(made.error().message);
    distances.emplace(std::move(made).value());
  }
  std::optional<StatesPage> page;
  if (!arguments.html.file.empty()) {
    Result<StatesPage> started =
        StatesPage::start(arguments.html, arguments.reduced ? PageOf::kClosestPairs : PageOf::kNear,
                          arguments.states.inputs.front(), states);
    if (!started) return failure(started.error().message);
    page.emplace(std::move(started).value());
  }
  Listing listing(arguments, distance, fields, std::move(writer), page ? &*page : nullptr);
  const std::array written_files{arguments.json_file, arguments.contacts_file, arguments.distances_file,
                                 arguments.html.file};
  const bool table = std::ranges::find(written_files, "-") == written_files.end();
  const bool half_spaces = has_half_spaces(states.scene());
  if (table)
    std::printf("%8s %10s %10s%s %10s%s %14s %10s\n", "frame", "vf", "ee", half_spaces ? "         vh" : "",
                "possible", arguments.reduced ? "       rows" : "", "least distance", "ms");
  const int looked = states.each([&](AnySession& session) -> Status {
    Status status = listing.look(session, states);
    if (status && distances)
      status =
          distances->look(session, states.number(), distance, {.tier = parse_tier(arguments.tier).value()});
    if (status && table) print_frame(listing.frames().back(), arguments.reduced, half_spaces);
    return status;
  });
  if (looked != kExitOk) return looked;
  if (Status status = listing.close(); !status) return failure(status.error().message);
  if (distances) {
    if (Status status = distances->close(); !status) return failure(status.error().message);
  }
  if (page) {
    const Json question{{"tier", arguments.tier}, {"distance", distance}, {"contacts_hash", listing.hash()}};
    if (Status status = page->write(question); !status) return failure(status.error().message);
  }
  if (!arguments.json_file.empty()) {
    const std::string text =
        format_json(arguments, summary_of(states.scene()), distance, listing).dump(1) + "\n";
    if (Status status = write_text(arguments.json_file, text); !status)
      return failure(status.error().message);
  }
  if (table) {
    const WholeRow row;
    std::printf("within %.9g: %s", distance, counted(listing.frames().size(), "frame").c_str());
    if (!arguments.count) std::printf(", contacts hash %s", listing.hash().c_str());
    std::printf("\n");
  }
  return finish_output();
}

}  // namespace

Verb add_near(CLI::App& app) {
  auto arguments = std::make_shared<NearArguments>();
  NearArguments& a = *arguments;
  add_state_arguments(app, a.states);
  app.add_option("--distance", a.distance, "List the pairs within this distance, in the scene's unit")
      ->required();
  app.add_flag("--of-diagonal", a.of_diagonal,
               "--distance is a share of the diagonal of the first frame's bounding box");
  app.add_option("--tier", a.tier,
                 "Certified misses no pair, and may list some by a rounding farther apart; exact decides the "
                 "distance exactly")
      ->check(CLI::IsMember({"certified", "exact"}))
      ->capture_default_str();
  app.add_flag("--count", a.count, "Count the pairs and list none");
  app.add_flag(
      "--reduced", a.reduced,
      "List each closest pair once (two vertices; an edge and a vertex; two edges; a face and a vertex), "
      "with its multiplicity: how many pairs have it. Counts stay those of all pairs; nearly parallel "
      "edges stay pairs of their own");
  add_fields_option(app, a.fields);
  app.add_option("--contacts", a.contacts_file,
                 "Write the pairs: .csv, .jsonl, or .vtp (one file per frame, and a .pvd that lists them); - "
                 "for stdout, as CSV and without other output")
      ->type_name("FILE");
  app.add_option("--vertex-distances", a.distances_file,
                 "Write how far each vertex is from anything, at most --distance, as CSV: frame, vertex, "
                 "distance; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--json", a.json_file, "Write the report as JSON; - for stdout, without other output")
      ->type_name("FILE");
  add_html_options(app, a.html,
                   "the meshes in each frame, its pairs by their distance (with --reduced its closest "
                   "pairs), counts and times");
  return [arguments] { return near(*arguments); };
}

}  // namespace warmfront::client
