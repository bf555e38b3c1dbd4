// SPDX-License-Identifier: Apache-2.0
// Recordings as bug reports and regression tests: recordings of a daemon and of the command line replay
// through the engine and through a daemon with the same answers, and a changed answer is found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "client/cli/exit_codes.h"
#include "client/cli/recording/replay_run.h"
#include "client/lib/client.h"
#include "proto/recording/reader.h"
#include "proto/recording/writer.h"
#include "tests/unit/client/command.h"
#include "tests/unit/server/heap.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

using test::Heap;
using test::Mixture;
using ::testing::HasSubstr;

class ReplayTest : public ::testing::Test {
 protected:
  static server::Config config(const std::filesystem::path& folder) {
    server::Config config;
    config.record_dir = folder;
    return config;
  }
  std::vector<std::string> recordings() const {
    std::vector<std::string> files;
    for (const auto& file : std::filesystem::directory_iterator(folder_.path()))
      if (file.path().extension() == ".wfrec") files.push_back(file.path());
    return files;
  }
  /// A session ends with the daemon's last job for it: slightly after its client is told.
  static void wait_for_end(const std::string& path) {
    for (int i = 0; i < 2000; ++i) {
      recording::Reader reader = recording::Reader::open(path).value();
      for (auto record = reader.next(); record.ok() && record.value(); record = reader.next())
        if (record.value()->has_end()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    FAIL() << path << " has no end";
  }
  static ReplayResult replay_here(const std::string& path) {
    Result<RecordedSession> recorded = RecordedSession::open(path);
    EXPECT_TRUE(recorded.ok()) << recorded.error().message;
    auto target = make_engine_target(recorded.value(), 1).value();
    const auto result = replay(recorded.value(), *target, [](std::uint64_t) {});
    EXPECT_TRUE(result.ok()) << result.error().message;
    return result.value();
  }
  void expect_replays(const std::string& path) {
    const Outcome here = run("replay " + path + " --in-process");
    EXPECT_EQ(here.code, kExitOk) << here.out;
    EXPECT_THAT(here.out, HasSubstr("all equal"));
    const Outcome there = run("replay " + path + " --server " + daemon_.address());
    EXPECT_EQ(there.code, kExitOk) << there.out;
  }
  /// The recording with the answer to `frame` changed.
  std::string tampered(const std::string& path, std::uint64_t frame) const {
    const std::string other = path + ".changed.wfrec";
    recording::Reader reader = recording::Reader::open(path).value();
    const auto writer = recording::Writer::create(other, "tampered").value();
    for (;;) {
      auto record = std::move(reader.next()).value();
      if (!record) return other;
      if (record->has_end()) continue;
      if (record->has_answer() && record->answer().frame() == frame)
        record->mutable_answer()->set_contacts_hash(~record->answer().contacts_hash());
      writer->write(*std::move(record));
    }
  }

  const test::TemporaryFolder folder_;
  test::LocalDaemon daemon_{config(folder_.path())};
};

/// A session with everything in it that a client can say: all positions, parts, poses, a body more, a body
/// changed, a frame that is refused, and a loss, after which the session begins with poses.
template <class Real>
void stream_everything(Client& client) {
  Heap<Real> heap;
  Session session = client.create_session(heap.description, std::span<const Real>(heap.x)).value();
  for (int k = 1; k <= 12; ++k) {
    const Mixture<Real> mixture(k, heap);
    ASSERT_TRUE(session.step(mixture.frame).ok());
    if (k == 3) {
      std::vector<Real> bad = heap.x;
      bad[7] = std::numeric_limits<Real>::quiet_NaN();
      EXPECT_EQ(session.step(std::span<const Real>(bad)).error().code, ErrorCode::kInvalidArgument);
      ASSERT_TRUE(session.step(std::span<const Real>(heap.x)).ok());
    }
    if (k == 5) {
      std::vector<Real> fresh;
      Heap<Real>::append_octahedron(0.5, 0.5, fresh);
      BodyAddition addition;
      addition.body.vertex_count = 6;
      addition.faces = testing::octahedron();
      const Result<std::uint32_t> added = session.add_body(addition, std::span<const Real>(fresh));
      ASSERT_TRUE(added.ok());
      testing::Faces torn = addition.faces;
      torn.resize(5);
      ASSERT_TRUE(session.replace_elements(added.value(), torn, {{0, 1}}).ok());
      Heap<Real>::append_octahedron(0.25, 0.5, fresh);
      ASSERT_TRUE(session.replace_body(added.value(), addition, std::span<const Real>(fresh).last(18)).ok());
      ASSERT_TRUE(session.change_body(0, {"", 0, 6, BodyKind::kDeformable}).ok());
      EXPECT_FALSE(session.change_body(2, {"", 0, 6, BodyKind::kRigid, true, 1, 0}).ok());
    }
    if (k == 8) {
      ASSERT_TRUE(client.delete_session(session.id()).ok());
    }
  }
}

TEST_F(ReplayTest, WhatADaemonRecordsReplaysThroughEngineAndDaemon) {
  Client client = Client::connect(daemon_.address()).value();
  stream_everything<float>(client);
  stream_everything<double>(client);
  // Files are made by a thread of their own.
  for (int i = 0; i < 2000 && recordings().size() < 4; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const auto files = recordings();
  ASSERT_EQ(files.size(), 4u) << "two sessions, each made twice";
  std::uint64_t steps = 0, changes = 0;
  for (const std::string& file : files) {
    wait_for_end(file);
    const ReplayResult result = replay_here(file);
    EXPECT_EQ(result.difference, "");
    EXPECT_EQ(result.defect, "");
    steps += result.steps;
    changes += result.changes;
    expect_replays(file);
  }
  EXPECT_EQ(steps, 2u * (12 + 2)) << "twelve frames, one of its own, and one that is refused";
  EXPECT_EQ(changes, 2u * 5);
}

template <class Real>
void solve_for_a_while(Client& client) {
  Heap<Real> heap;
  Session session = client.create_session(heap.description, std::span<const Real>(heap.x)).value();
  for (int k = 1; k <= 6; ++k) {
    const Mixture<Real> mixture(k, heap), other(k + 1, heap);
    ASSERT_TRUE(session.trial(other.frame, {.report = Report::kCount}).ok());
    EXPECT_EQ(session.trial(mixture.frame, {.tolerance = 3.0}).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(session.commit().error().code, ErrorCode::kFailedPrecondition);
    ASSERT_TRUE(session.max_step(mixture.frame, k % 2 == 0).ok());
    const auto near = session.proximity(0.5, Where::kTrialEnd, {.reduced = true});
    ASSERT_TRUE(near.ok());
    EXPECT_GT(near.value().contacts.multiplicity.size(), 0U);
    if (k % 3 == 0) {
      ASSERT_TRUE(session.step(mixture.frame, {.min_separation = 0.01}).ok());
    } else {
      EXPECT_EQ(session.commit(-1).error().code, ErrorCode::kInvalidArgument);
      ASSERT_TRUE(session.commit(k % 2 == 0 ? 1 : 0.5).ok());
    }
  }
}

TEST_F(ReplayTest, TrialsAndCommitsReplayAsWhatTheyAre) {
  Client client = Client::connect(daemon_.address()).value();
  solve_for_a_while<float>(client);
  solve_for_a_while<double>(client);
  for (int i = 0; i < 2000 && recordings().size() < 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const auto files = recordings();
  ASSERT_EQ(files.size(), 2u);
  for (const std::string& file : files) {
    wait_for_end(file);
    const ReplayResult result = replay_here(file);
    EXPECT_EQ(result.difference, "");
    EXPECT_EQ(result.defect, "");
    EXPECT_EQ(result.steps, 6u * 5 + 4)
        << "four questions and a frame each, and four commits that are refused";
    expect_replays(file);
  }
}

TEST_F(ReplayTest, FiltersAndThicknessReplayAsWhatTheyAre) {
  Client client = Client::connect(daemon_.address()).value();
  Heap<float> heap;
  SceneDescription filtered = heap.description;
  const std::uint32_t vertices = filtered.vertex_count;
  filtered.filters = {.within_edges = 1, .near_at_rest = 0.6, .excluded_vertex_pairs = {{0, vertices - 1}}};
  filtered.thickness.assign(vertices, 0.01);
  {
    Session session = client.create_session(filtered, std::span<const float>(heap.x)).value();
    for (int k = 1; k <= 6; ++k) {
      ASSERT_TRUE(session.step(Mixture<float>(k, heap).frame).ok());
      if (k == 2) {
        ASSERT_TRUE(session.change_filters({.patches = std::vector<std::uint32_t>(vertices, 1)}).ok());
      }
      if (k == 3) {
        EXPECT_EQ(session.change_filters({.within_edges = 9}).error().code, ErrorCode::kInvalidArgument);
        ASSERT_TRUE(session.change_filters({.within_edges = 3}).ok());
      }
      if (k == 4) {
        ASSERT_TRUE(client.delete_session(session.id()).ok());  // and so it is made again
      }
    }
  }
  for (int i = 0; i < 2000 && recordings().size() < 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const auto files = recordings();
  ASSERT_EQ(files.size(), 2u);
  std::uint64_t changes = 0;
  for (const std::string& file : files) {
    wait_for_end(file);
    EXPECT_TRUE(RecordedSession::open(file).value().scene().filters.any());
    EXPECT_EQ(RecordedSession::open(file).value().scene().thickness, filtered.thickness);
    const ReplayResult result = replay_here(file);
    EXPECT_EQ(result.difference + result.defect, "");
    changes += result.changes;
    expect_replays(file);
  }
  EXPECT_EQ(changes, 3u);

  // Recorded by the command line, of which a load is made.
  const std::string file = (folder_.path() / "filtered.wfrec").string();
  const std::string scene = "'builtin:cloth-ball?triangles=1000&frames=8'";
  ASSERT_EQ(run("detect " + scene +
                " --report candidates --filter-edges 2 --filter-near-at-rest 0.1 --record " + file)
                .code,
            kExitOk);
  EXPECT_EQ(RecordedSession::open(file).value().scene().filters.within_edges, 2u);
  expect_replays(file);
  const Outcome load = run("load --server " + daemon_.address() + " --scene " + file +
                           " --duration 300ms --warmup 0s --check");
  EXPECT_EQ(load.code, kExitOk) << load.out;
  EXPECT_THAT(load.out, HasSubstr(" 0 differ"));
}

TEST_F(ReplayTest, RecordingsKeptFromEarlierHaveTheSameAnswersStill) {
  for (const char* kept : {"everything", "resumed"})
    expect_replays(std::string(WARMFRONT_RECORDINGS) + "/" + kept + ".wfrec");
}

TEST_F(ReplayTest, WhatTheCommandLineRecordsReplaysAndIsALoad) {
  const std::string file = (folder_.path() / "here.wfrec").string();
  const std::string scene = "'builtin:cloth-ball?triangles=1000&frames=8'";
  ASSERT_EQ(run("detect " + scene + " --send moved --tier exact --record " + file).code, kExitOk);
  EXPECT_EQ(replay_here(file).compared, 7u);
  expect_replays(file);
  EXPECT_EQ(run("detect " + scene + " --record " + file).code, kExitFailed) << "it exists";
  const std::string report = (folder_.path() / "r.json").string();
  const Outcome load = run("load --server " + daemon_.address() + " --scene " + file +
                           " --duration 300ms --warmup 0s --check --json " + report);
  EXPECT_EQ(load.code, kExitOk) << load.out;
  EXPECT_THAT(load.out, HasSubstr("8 frames forth and back"));
  EXPECT_THAT(load.out, HasSubstr(" 0 differ"));

  const std::string sub = (folder_.path() / "sub").string();
  std::filesystem::create_directory(sub);
  EXPECT_EQ(run("load --server " + daemon_.address() + " --scene " + scene +
                " --sessions 2 --duration 200ms --warmup 0s --record " + sub)
                .code,
            kExitOk);
  std::size_t files = 0;
  for (const auto& recorded : std::filesystem::directory_iterator(sub)) {
    const ReplayResult result = replay_here(recorded.path());
    EXPECT_EQ(result.difference + result.defect, "");
    EXPECT_GT(result.compared, 0u);
    ++files;
  }
  EXPECT_EQ(files, 2u);
}

// Where a cloth tears, bodies have other meshes: changes in the recording, each before a placement.
TEST_F(ReplayTest, WhereTheTopologyChangesTheCommandLineRecordsTheChange) {
  const std::string cut = "detect 'builtin:cut?triangles=1200&frames=20' --min-separation 0.01";
  for (const std::string& where : {std::string(), " --server " + daemon_.address()}) {
    const std::string file =
        (folder_.path() / (where.empty() ? "cut-here.wfrec" : "cut-there.wfrec")).string();
    ASSERT_EQ(run(cut + where + " --record " + file).code, kExitOk);
    const ReplayResult here = replay_here(file);
    EXPECT_EQ(here.difference + here.defect, "");
    std::uint64_t changes = 0;
    recording::Reader reader = recording::Reader::open(file).value();
    for (auto record = reader.next(); record.ok() && record.value(); record = reader.next()) {
      if (record.value()->has_change()) ++changes;
    }
    EXPECT_GE(changes, 3u);
    EXPECT_EQ(here.compared, 19u + 2 * changes) << "steps, changes, and a placement behind each";
    EXPECT_EQ(here.steps, 19u);
    EXPECT_EQ(here.placements, changes);
    expect_replays(file);
  }
  const std::string none = (folder_.path() / "none.wfrec").string();
  const Outcome apart = run(cut + " --bodies deformable --record " + none, "2>&1");
  EXPECT_EQ(apart.code, kExitFailed);
  EXPECT_THAT(apart.out, HasSubstr("where the topology changes: --record: "));
}

TEST_F(ReplayTest, ADifferentAnswerIsNamedAndExitsWith2) {
  const std::string file = (folder_.path() / "a.wfrec").string();
  ASSERT_EQ(run("detect 'builtin:bart?triangles=1000&frames=6' --record " + file).code, kExitOk);
  const std::string changed = tampered(file, 3);
  EXPECT_THAT(replay_here(changed).difference, HasSubstr("frame 3 differs: recorded"));
  for (const std::string& where : {std::string("--in-process"), "--server " + daemon_.address()}) {
    const Outcome outcome = run("replay " + changed + " " + where);
    EXPECT_EQ(outcome.code, kExitFailed);
    EXPECT_THAT(outcome.out, HasSubstr("frame 3 differs"));
  }
  EXPECT_EQ(run("replay " + file).code, kExitUsage);
  EXPECT_EQ(run("replay " + file + " --in-process --server " + daemon_.address()).code, kExitUsage);
  EXPECT_EQ(run("replay " + folder_.path().string() + " --in-process").code, kExitFailed);
}

TEST_F(ReplayTest, ATornRecordingReplaysToItsLastWholeRecord) {
  const std::string file = (folder_.path() / "a.wfrec").string();
  ASSERT_EQ(run("detect 'builtin:bart?triangles=1000&frames=6' --record " + file).code, kExitOk);
  // Into the last answer: behind it there is the end, of a few bytes.
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 20);
  const ReplayResult result = replay_here(file);
  EXPECT_EQ(result.difference, "");
  EXPECT_EQ(result.steps, 5u) << "the last step is replayed too: it may be what crashed the writer";
  EXPECT_EQ(result.compared, 4u);
  EXPECT_THAT(result.defect, HasSubstr("cut off"));
  EXPECT_THAT(run("replay " + file + " --in-process").out, HasSubstr("the recording is incomplete"));
  const Outcome as_input = run("detect " + file, "2>&1 >/dev/null");
  EXPECT_EQ(as_input.code, kExitOk);
  EXPECT_THAT(as_input.out, HasSubstr("the recording is incomplete"))
      << "and its totals are of what is there";
}

TEST_F(ReplayTest, ARecordingIsAFileOfItsOwn) {
  const Outcome out = run("detect 'builtin:bart?triangles=1000&frames=3' --record -", "2>&1");
  EXPECT_EQ(out.code, kExitUsage);
  EXPECT_THAT(out.out, HasSubstr("--record -: a recording is a file of its own"));
}

}  // namespace
}  // namespace warmfront::client
