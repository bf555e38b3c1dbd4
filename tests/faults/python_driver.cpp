// SPDX-License-Identifier: Apache-2.0
// A Python process that is told what to do, line by line: see python_driver.py.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "tests/faults/hex.h"
#include "tests/faults/session_driver.h"

extern char** environ;

namespace warmfront::test {
namespace {

using nlohmann::json;
using testing::AddOperation;
using testing::StepOperation;

json told(const Body& body) {
  constexpr const char* kKinds[] = {"deformable", "rigid", "static", "removed"};
  json half_space;  // null: none
  if (body.half_space)
    half_space = {hex(body.half_space->point.data(), 3), hex(body.half_space->normal.data(), 3)};
  return {{"name", body.name},
          {"half_space", half_space},
          {"first_vertex", body.first_vertex},
          {"vertex_count", body.vertex_count},
          {"kind", kKinds[static_cast<int>(body.kind)]},
          {"self_collision", body.self_collision},
          {"group", body.group},
          {"mask", body.mask},
          {"thickness", body.thickness},
          {"world", body.world},
          {"screw", body.screw}};
}

json told(const StepOperation& step) {
  json frame{{"bodies", json::array()},
             {"poses", json::array()},
             {"vertices", hex(step.vertices)},
             {"vertex_positions", hex(step.vertex_positions)}};
  if (step.all) frame["all"] = hex(*step.all);
  for (const auto& rows : step.bodies)
    frame["bodies"].push_back({{"body", rows.body}, {"positions", hex(rows.positions)}});
  for (const BodyPose& pose : step.poses)
    frame["poses"].push_back({{"body", pose.body}, {"pose", hex(pose.pose.matrix.data(), 12)}});
  return frame;
}

json told(const ContactFields& asked) {
  json fields = json::array();
  if (asked.weights) fields.push_back("weights");
  if (asked.normal) fields.push_back("normal");
  if (asked.points) fields.push_back("points");
  if (asked.direction) fields.push_back("direction");
  if (asked.squared_distance) fields.push_back("squared_distance");
  if (asked.closest) fields.push_back("closest");
  return fields;
}

// As the keyword arguments of the question.
json told(const QuestionOptions& options) {
  json question = json::object();
  if (options.tier) question["tier"] = to_string(*options.tier);
  if (options.tolerance) question["tolerance"] = *options.tolerance;
  if (options.min_separation) question["min_separation"] = *options.min_separation;
  if (options.report) question["report"] = to_string(*options.report);
  if (options.fields) question["fields"] = told(*options.fields);
  if (options.max_contacts) question["max_contacts"] = *options.max_contacts;
  if (options.reduced) question["reduced"] = true;
  return question;
}

json question_of(const StepOperation& operation) {
  json question = told(operation.options);
  if (operation.leave_out_overlaps) question["leave_out_overlaps"] = true;
  if (operation.options.keep_distance) question["keep_distance"] = *operation.options.keep_distance;
  return question;
}

const char* kind_of(const StepOperation& operation) {
  constexpr const char* kKinds[] = {"step", "trial", "max_step", "place"};
  return kKinds[static_cast<int>(operation.as)];
}

json told(const ColliderOptions& options) {
  return {{"tier", to_string(options.tier)},
          {"tolerance", options.tolerance},
          {"min_separation", options.min_separation},
          {"report", to_string(options.report)},
          {"front", to_string(options.front)},
          {"find_bodies", options.find_bodies},
          {"fields", told(options.fields)}};
}

ErrorCode code_of(int canonical) {
  static const std::map<int, ErrorCode> codes{
      {1, ErrorCode::kCancelled},         {3, ErrorCode::kInvalidArgument},
      {4, ErrorCode::kDeadlineExceeded},  {5, ErrorCode::kNotFound},
      {6, ErrorCode::kAlreadyExists},     {7, ErrorCode::kPermissionDenied},
      {8, ErrorCode::kResourceExhausted}, {9, ErrorCode::kFailedPrecondition},
      {10, ErrorCode::kAborted},          {12, ErrorCode::kUnimplemented},
      {14, ErrorCode::kUnavailable},      {15, ErrorCode::kDataLoss},
      {16, ErrorCode::kUnauthenticated}};
  const auto code = codes.find(canonical);
  return code == codes.end() ? ErrorCode::kInternal : code->second;
}

CommitResult commit_of(const json& reply) {
  CommitResult commit;
  commit.fraction = from_hex<double>(reply.at("fraction")).at(0);
  if (reply.contains("vf")) commit.vf = reply.at("vf");
  if (reply.contains("ee")) commit.ee = reply.at("ee");
  if (reply.contains("vh")) commit.vh = reply.at("vh");
  if (reply.contains("possible")) commit.possible = reply.at("possible");
  if (reply.contains("earliest_toi")) commit.earliest_toi = from_hex<double>(reply.at("earliest_toi")).at(0);
  return commit;
}

client::Answer answer_of(const json& reply) {
  client::Answer answer;
  if (reply.contains("fraction")) {
    answer.frame = reply.at("frame");
    answer.commit = commit_of(reply);
    return answer;
  }
  answer.frame = reply.at("frame");
  answer.vf = reply.at("vf");
  answer.ee = reply.at("ee");
  answer.possible = reply.at("possible");
  answer.ef = reply.value("ef", std::uint64_t{0});
  answer.vh = reply.value("vh", std::uint64_t{0});
  answer.vertex_distances = from_hex<double>(reply.value("vertex_distances", ""));
  if (reply.contains("earliest_toi")) answer.earliest_toi = from_hex<double>(reply.at("earliest_toi")).at(0);
  answer.contacts = {from_hex<ContactKind>(reply.at("kind")),
                     from_hex<ContactStatus>(reply.at("status")),
                     from_hex<std::array<std::uint32_t, 4>>(reply.at("v")),
                     from_hex<std::array<std::uint32_t, 5>>(reply.value("edge_faces", "")),
                     from_hex<double>(reply.at("toi")),
                     from_hex<std::array<double, 4>>(reply.at("weights")),
                     from_hex<std::array<double, 3>>(reply.at("normal")),
                     from_hex<std::array<double, 6>>(reply.at("points")),
                     from_hex<std::array<double, 3>>(reply.at("direction")),
                     from_hex<double>(reply.at("squared_distance")),
                     from_hex<ClosestFeatures>(reply.at("closest")),
                     from_hex<std::uint32_t>(reply.at("multiplicity")),
                     from_hex<std::uint8_t>(reply.at("stencil"))};
  return answer;
}

class PythonDriver final : public SessionDriver {
 public:
  explicit PythonDriver(std::string address) : address_(std::move(address)) {
    std::signal(SIGPIPE, SIG_IGN);  // a process that ended is told of by the reply that does not come
    std::array<int, 2> to_child{}, from_child{};
    if (pipe(to_child.data()) != 0 || pipe(from_child.data()) != 0) throw std::runtime_error("pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, to_child[0], 0);
    posix_spawn_file_actions_adddup2(&actions, from_child[1], 1);
    for (const int file : {to_child[0], to_child[1], from_child[0], from_child[1]})
      posix_spawn_file_actions_addclose(&actions, file);
    std::string python = WARMFRONT_PYTHON, script = WARMFRONT_PYTHON_DRIVER;
    std::string path = "PYTHONPATH=" WARMFRONT_PYTHON_PATH, no_cache = "PYTHONDONTWRITEBYTECODE=1";
    std::vector<char*> environment{path.data(), no_cache.data()};
    for (char** variable = environ; *variable != nullptr; ++variable) environment.push_back(*variable);
    environment.push_back(nullptr);
    char* arguments[] = {python.data(), script.data(), nullptr};
    const int failed = posix_spawn(&pid_, python.c_str(), &actions, nullptr, arguments, environment.data());
    posix_spawn_file_actions_destroy(&actions);
    ::close(to_child[0]);
    ::close(from_child[1]);
    to_ = fdopen(to_child[1], "w");
    from_ = fdopen(from_child[0], "r");
    if (failed != 0) throw std::runtime_error("python is not started");
  }
  ~PythonDriver() override {
    std::fclose(to_);  // the end of its input is the end of it
    std::fclose(from_);
    waitpid(pid_, nullptr, 0);
  }

  Status create(const testing::AcceptedState& state, const ColliderOptions& options) override {
    json request{{"address", address_},
                 {"positions", hex(state.positions)},
                 {"faces", hex(state.scene.faces)},
                 {"edges", hex(state.scene.edges)},
                 {"bodies", json::array()},
                 {"excluded_pairs", state.scene.excluded_pairs},
                 {"thickness", hex(state.scene.thickness)},
                 {"options", told(options)}};
    for (const Body& body : state.scene.bodies) request["bodies"].push_back(told(body));
    const Result<json> reply = ask("create", std::move(request));
    if (!reply) return reply.error();
    id_ = reply.value().at("id");
    window_ = reply.value().at("window");
    return {};
  }
  Result<client::Answer> step(const StepOperation& operation) override {
    json request = told(operation);
    request["question"] = question_of(operation);
    const Result<json> reply = ask(kind_of(operation), std::move(request));
    if (!reply) return reply.error();
    return answer_of(reply.value());
  }
  Status submit(const StepOperation& operation) override {
    json request = told(operation);
    request["question"] = question_of(operation);
    request["kind"] = kind_of(operation);
    return done(ask("submit", std::move(request)));
  }
  Result<client::Answer> proximity(const testing::NearOperation& near) override {
    json question = told(near.options);
    if (near.tangled) question["tangled"] = true;
    question["where"] = near.where == Where::kTrialEnd ? "trial_end" : "base";
    const Result<json> reply =
        ask("proximity", {{"distance", hex(&near.distance, 1)}, {"question", std::move(question)}});
    if (!reply) return reply.error();
    return answer_of(reply.value());
  }
  bool asks() const override { return true; }
  Result<CommitResult> commit(double fraction) override {
    const Result<json> reply = ask("commit", {{"fraction", hex(&fraction, 1)}});
    if (!reply) return reply.error();
    return commit_of(reply.value());
  }
  Status submit_commit(double fraction) override {
    return done(ask("submit", {{"kind", "commit"}, {"fraction", hex(&fraction, 1)}}));
  }
  Result<client::Answer> next_answer() override {
    const Result<json> reply = ask("next_answer", json::object());
    if (!reply) return reply.error();
    return answer_of(reply.value());
  }
  Result<std::uint32_t> add_body(const AddOperation& add) override {
    const Result<json> reply = ask("add_body", {{"body", told(add.addition.body)},
                                                {"faces", hex(add.addition.faces)},
                                                {"edges", hex(add.addition.edges)},
                                                {"thickness", hex(add.addition.thickness)},
                                                {"positions", hex(add.positions)}});
    if (!reply) return reply.error();
    return reply.value().at("index").get<std::uint32_t>();
  }
  Status change_body(std::uint32_t index, const Body& body) override {
    return done(ask("change_body", {{"index", index}, {"body", told(body)}}));
  }
  Status change_filters(const PairFilters& filters) override {
    return done(ask("change_filters", {{"within_edges", filters.within_edges},
                                       {"near_at_rest", hex(std::vector<double>{filters.near_at_rest})},
                                       {"rest_positions", hex(filters.rest_positions)},
                                       {"excluded_vertex_pairs", hex(filters.excluded_vertex_pairs)},
                                       {"patches", hex(filters.patches)}}));
  }
  Status change_excluded_pairs(const std::vector<std::array<std::uint32_t, 2>>& pairs) override {
    return done(ask("change_excluded_pairs", {{"pairs", pairs}}));
  }
  Status change_options(const ColliderOptions& options) override {
    return done(ask("change_options", {{"options", told(options)}}));
  }
  Status replace(const ReplaceElements& change) override {
    return done(ask("replace_elements",
                    {{"index", change.index}, {"faces", hex(change.faces)}, {"edges", hex(change.edges)}}));
  }
  Status replace(const ReplaceBody& change) override {
    return done(ask("replace_body", {{"index", change.index},
                                     {"body", told(change.addition.body)},
                                     {"faces", hex(change.addition.faces)},
                                     {"edges", hex(change.addition.edges)},
                                     {"thickness", hex(change.addition.thickness)},
                                     {"positions", hex(change.positions)}}));
  }
  Status close() override { return done(ask("close", json::object())); }
  Result<State> state() override {
    const Result<json> reply = ask("state", json::object());
    if (!reply) return reply.error();
    State state{from_hex<double>(reply.value().at("positions")), {}};
    const auto poses = from_hex<Pose>(reply.value().at("poses"));
    for (const std::uint32_t body : from_hex<std::uint32_t>(reply.value().at("bodies")))
      state.poses.push_back({body, poses[state.poses.size()]});
    return state;
  }
  std::string id() const override { return id_; }
  std::uint32_t window() const override { return window_; }

 private:
  static Status done(const Result<json>& reply) { return reply ? Status() : Status(reply.error()); }

  Result<json> ask(const char* what, json request) {
    request["do"] = what;
    const std::string line = request.dump() + "\n";
    std::fwrite(line.data(), 1, line.size(), to_);
    std::fflush(to_);
    std::string text;
    for (int c = std::fgetc(from_); c != EOF && c != '\n'; c = std::fgetc(from_))
      text += static_cast<char>(c);
    json reply = json::parse(text, nullptr, false);
    if (reply.is_discarded())
      return Error{ErrorCode::kInternal, "the Python process ended; see its traceback"};
    if (reply.contains("code"))
      return Error{code_of(reply.at("code")), reply.at("message").get<std::string>()};
    return reply;
  }

  const std::string address_;
  pid_t pid_ = -1;
  std::FILE* to_ = nullptr;
  std::FILE* from_ = nullptr;
  std::string id_;
  std::uint32_t window_ = 1;
};

}  // namespace

std::unique_ptr<SessionDriver> drive_python(const std::string& address) {
  return std::make_unique<PythonDriver>(address);
}

}  // namespace warmfront::test
