// SPDX-License-Identifier: Apache-2.0
#include "client/cli/detect/arguments.h"

#include <CLI/CLI.hpp>

#include "client/cli/contact_fields.h"
#include "client/cli/frames/frame_model.h"
#include "client/cli/html/html_options.h"
#include "client/cli/server_options.h"
#include "client/cli/verb.h"
#include "client/io/file.h"
#include "client/io/input.h"

namespace warmfront::client {
namespace {

/// Parses the names into options; fails for the first invalid one.
Status read_names(DetectArguments& arguments) {
  const auto take = [](auto parsed, auto& field) -> Status {
    if (!parsed) return parsed.error();
    field = parsed.value();
    return {};
  };
  ColliderOptions& options = arguments.options;
  options.lazy_front = arguments.lazy == "on";
  options.normal_cones = arguments.normal_cones == "on";
  options.find_bodies = arguments.find_bodies == "on";
  options.find_rigid = arguments.find_rigid == "on";
  options.separate_parts = arguments.separate_parts == "on";
  options.fields = fields_named(arguments.fields);
  if (Status s = take(parse_tier(arguments.tier), options.tier); !s) return s;
  if (Status s = take(parse_report(arguments.report), options.report); !s) return s;
  if (Status s = take(parse_front_mode(arguments.front), options.front); !s) return s;
  if (Status s = take(parse_bounds_kind(arguments.bounds), options.bounds); !s) return s;
  return validate(options);
}

}  // namespace

Status check_usage(DetectArguments& arguments) {
  if (Status status = check_input_arguments(arguments.inputs); !status) return status;
  if (Status status = read_names(arguments); !status) return status;
  if (Result<BodiesMode> bodies = parse_bodies_mode(arguments.bodies); !bodies) return bodies.error();
  if (Result<SendMode> send = parse_send_mode(arguments.send); !send) return send.error();
  if (arguments.options.explain && arguments.options.report != Report::kAll)
    return invalid_argument("--explain needs --report all: it compares the contacts");
  if (arguments.record_file == "-")
    return invalid_argument("--record -: a recording is a file of its own; give it a name");
  if (arguments.threads != 0 && !arguments.server.empty() && !arguments.options.explain)
    return invalid_argument("--threads is for this process; with --server the daemon's --threads applies");
  if (Status status = check_one_stdout({{"--json", arguments.json_file},
                                        {"--contacts", arguments.files.contacts},
                                        {"--html", arguments.files.html.file}});
      !status)
    return status;
  return DetectOutputs::check(arguments.files, arguments.options);
}

Status check_topology_changes(const DetectArguments& arguments) {
  const auto refused = [](const char* option, const char* why) {
    return invalid_argument(std::string(option) + ": the input's topology changes, and " + why);
  };
  if (arguments.options.explain) return refused("--explain", "what is kept is not comparable then");
  if (arguments.filters.near_at_rest)
    return refused("--filter-near-at-rest", "what is near at rest is not known of the meshes to come");
  if (arguments.files.continuity || arguments.files.ended)
    return refused(arguments.files.ended ? "--ended" : "--continuity",
                   "vertices have other numbers then; give --frames between two changes");
  return {};
}

void add_detect_options(CLI::App& app, DetectArguments& a) {
  app.add_option("INPUT", a.inputs,
                 "A folder with mesh.ply and frames.pc2 (or frames.mdd), or t0.ply, t1.ply, ..., and perhaps "
                 "info.json; or "
                 "two or more mesh files (.ply, .obj, .stl) of one topology; or a mesh file and its cache "
                 "(.pc2, .mdd, "
                 ".npy); or a .npz with positions and faces; or a recording (.wfrec); or "
                 "builtin:NAME[?triangles=N&frames=N] (see 'scene --list')")
      ->required();
  app.add_flag(
      "--remeshed", a.remeshed,
      "Mesh files may differ in topology: one that does stands for the same moment as the file before "
      "it, so that nothing is tested between the two");
  add_server_options(app, a.server, a.connection,
                     "Step on the daemon at this address (HOST:PORT or unix:PATH), not in this process",
                     false);
  app.add_option("--tier", a.tier, "How an elementary test decides")
      ->check(CLI::IsMember({"fast", "certified", "exact"}))
      ->capture_default_str();
  app.add_option("--tolerance", a.options.tolerance,
                 "Certified tier: pairs this close, relative to the query's size, may be reported; in (0, 1]")
      ->capture_default_str();
  app.add_option("--min-separation", a.options.min_separation,
                 "Report pairs that come within this distance, in the scene's unit")
      ->capture_default_str();
  app.add_option(
         "--report", a.report,
         "All contacts, only those at the earliest time, only their number, or all pairs whose moving bounds "
         "overlap, untested. With --min-separation, pairs "
         "nearer than that at a step's start have time 0, and earliest then reports only these")
      ->check(CLI::IsMember({"all", "earliest", "count", "candidates"}))
      ->capture_default_str();
  app.add_option("--front", a.front, "How the traversal is cached between steps; the contacts are the same")
      ->check(CLI::IsMember({"none", "paper", "warm"}))
      ->capture_default_str();
  app.add_option("--bounds", a.bounds,
                 "Bounding volumes; auto chooses by the counts of the first steps; the contacts are the same")
      ->check(CLI::IsMember({"auto", "aabb", "kdop18"}))
      ->capture_default_str();
  app.add_option("--threads", a.threads, "Threads in this process; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--substeps", a.substeps,
                 "Split each step linearly into this many substeps, which 'frame' then counts")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--bodies", a.bodies,
                 "The scene's model: as the input declares it (info.json), all deformable as one, or its "
                 "connected components")
      ->check(CLI::IsMember({"declared", "deformable", "components"}))
      ->capture_default_str();
  app.add_option("--send", a.send,
                 "Content of a frame: all positions; only what moved; or poses fitted to rigid bodies, and "
                 "what else moved. Along a screw a body moves by poses alone")
      ->check(CLI::IsMember({"all", "moved", "poses"}))
      ->default_str("all, or poses where a body moves along a screw");
  app.add_option(
         "--in-flight", a.in_flight,
         "With --server: most unanswered frames, limited by the daemon's window; 1: each frame waits for the "
         "previous answer, as in many simulations, and always with output files, --explain or --record")
      ->check(CLI::Range(1, 1024))
      ->needs("--server")
      ->capture_default_str();
  app.add_option("--find-bodies", a.find_bodies,
                 "Without declared bodies, use the connected components as bodies; the contacts are the same")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--find-rigid", a.find_rigid,
                 "Find bodies that move rigidly, and skip testing them against themselves where the contacts "
                 "stay the same")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--separate-parts", a.separate_parts,
                 "Look for a plane between small near bodies; the contacts are the same")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  add_fields_option(app, a.fields);
  app.add_flag("--explain", a.options.explain,
               "Also step an all-deformable scene, compare the contacts (in this process), and print what "
               "the model saves");
  app.add_option("--frames", a.frames,
                 "Only the steps from frame FIRST to frame LAST; 'merge' joins the reports of ranges")
      ->type_name("FIRST:LAST");
  add_filter_options(app, a.filters);
  app.add_option("--contacts", a.files.contacts,
                 "Write the contacts: .csv, .jsonl, or .vtp (one file per frame, and a .pvd that lists "
                 "them); - for stdout, as CSV and without other output")
      ->type_name("FILE");
  app.add_flag("--continuity", a.files.continuity,
               "Write in --contacts whether each contact is new, or kept from the step before");
  app.add_flag(
      "--ended", a.files.ended,
      "--continuity, and write the contacts of the step before that ended, after those that there are");
  app.add_option("--meshes", a.files.meshes,
                 "Write the meshes for ParaView: .vtp (one file per frame, each vertex with its least time "
                 "of impact, and a .pvd that lists them)")
      ->type_name("FILE");
  add_html_options(app, a.files.html,
                   "the meshes moving, their contacts by time of impact, counts and stage times");
  app.add_option("--json", a.json_file, "Write the report as JSON; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--record", a.record_file,
                 "Record the session's frames and answers, for 'replay'; the file must not exist")
      ->type_name("FILE");
  app.add_option("--leaf-size", a.options.leaf_size, "Most triangles in a leaf of the hierarchy")
      ->check(CLI::IsMember({1, 2, 4, 8, 16, 32, 64}))
      ->capture_default_str();
  app.add_option("--rebuild-after", a.options.rebuild_after_stalled_steps,
                 "Front 'paper': rebuild after this many consecutive steps without growth; 0: never")
      ->capture_default_str();
  app.add_option("--rebuild-every", a.options.rebuild_every_steps,
                 "Front 'paper': rebuild every this many steps; 0: never")
      ->capture_default_str();
  app.add_option("--lazy", a.lazy, "Warm front: skip pairs that cannot have come together yet")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--normal-cones", a.normal_cones,
                 "Cull flat patches by normal cone and contour test (tier exact)")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
}

}  // namespace warmfront::client
