// SPDX-License-Identifier: Apache-2.0
// Trials and commits through a daemon, by bare messages: repeated; refused; and what is asked with each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "tests/unit/server/trials_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;
using Kind = v1::Question;

TEST_F(TrialsTest, LeaveTheSessionWhereItWas) {
  ASSERT_TRUE(create().ok());
  ASSERT_TRUE(create(kOther).ok());
  ASSERT_TRUE(step(1, frame(1)).ok());
  ASSERT_TRUE(step(1, frame(1), nullptr, kOther).ok());
  const v1::SessionState before = state();
  {
    Context context;
    const auto stream = open(context, 2);
    for (const auto kind : {Kind::KIND_TRIAL, Kind::KIND_MAX_STEP, Kind::KIND_TRIAL}) {
      const auto response = exchange(*stream, ask(2, question(kind), frame(4)));
      ASSERT_TRUE(response.has_answer()) << response.ShortDebugString();
      EXPECT_EQ(response.answer().frame(), 2u);
      EXPECT_TRUE(same(response.answer().summary().state(), before));
      EXPECT_TRUE(same(response.answer().summary().state_before(), before));
    }
    // The last frame is still answered from memory, and no trial of it.
    EXPECT_TRUE(exchange(*stream, frame_message(1, frame(1))).has_answer());
    const auto late = exchange(*stream, ask(1, trial(), frame(1)));
    EXPECT_EQ(code_of(late), StatusCode::FAILED_PRECONDITION);
    EXPECT_EQ(detail_of(late.error().status()).reason(), v1::ERROR_REASON_FRAME_OUT_OF_ORDER);
  }
  // The same by a unary call.
  Context context;
  v1::StepRequest request;
  request.set_session_id(kId);
  request.set_frame(2);
  request.set_positions(frame(4));
  *request.mutable_question() = trial();
  v1::StepResponse response;
  ASSERT_TRUE(stub_->Step(&context, request, &response).ok());
  EXPECT_GT(response.summary().rows(), 0u);
  EXPECT_TRUE(same(state(), before));
  v1::StepResponse stepped, other;
  ASSERT_TRUE(step(2, frame(2), &stepped).ok());
  ASSERT_TRUE(step(2, frame(2), &other, kOther).ok());
  EXPECT_EQ(hash_of(stepped.contacts()), hash_of(other.contacts()));
  EXPECT_TRUE(same(stepped.summary().state(), other.summary().state())) << "as if there had been no trials";
}

TEST_F(TrialsTest, ACommitIsAnsweredAgainAndNoOther) {
  ASSERT_TRUE(create().ok());
  const v1::SessionState start = state();
  Context context;
  const auto stream = open(context, 1);
  ASSERT_TRUE(exchange(*stream, ask(1, trial(), frame(1))).has_answer());
  const auto first = exchange(*stream, commit_message(1, 0.5));
  ASSERT_TRUE(first.has_answer()) << first.ShortDebugString();
  EXPECT_EQ(first.answer().summary().state().frame(), 1u);
  EXPECT_TRUE(same(first.answer().summary().state_before(), start));
  EXPECT_TRUE(same(first.answer().summary().state(), state()));
  EXPECT_EQ(exchange(*stream, commit_message(1, 0.5)).SerializeAsString(), first.SerializeAsString());
  for (const auto& other :
       {commit_message(1, 0.25), commit_message(1, std::numeric_limits<double>::quiet_NaN()),
        frame_message(1, frame(1))}) {
    const auto changed = exchange(*stream, other);
    EXPECT_EQ(code_of(changed), StatusCode::ABORTED);
    EXPECT_EQ(detail_of(changed.error().status()).reason(), v1::ERROR_REASON_FRAME_CHANGED);
  }
  EXPECT_TRUE(same(first.answer().summary().state(), state()));
  // A step is not answered as a commit either, nor for another question.
  ASSERT_TRUE(exchange(*stream, frame_message(2, frame(2))).has_answer());
  EXPECT_EQ(code_of(exchange(*stream, commit_message(2, 1))), StatusCode::ABORTED);
  v1::Question counted = question(Kind::KIND_STEP);
  counted.set_report(v1::REPORT_COUNT);
  EXPECT_EQ(code_of(exchange(*stream, ask(2, counted, frame(2)))), StatusCode::ABORTED);
  EXPECT_TRUE(exchange(*stream, ask(2, question(Kind::KIND_STEP), frame(2))).has_answer());
}

TEST_F(TrialsTest, DifferentCommitsGiveDifferentStates) {
  std::vector<std::uint64_t> digests;
  int made = 0;
  const auto digest_of = [&](const std::vector<std::uint64_t>& trials, double fraction) {
    const std::string id = "31234567-89ab-cdef-0123-" + std::to_string(100000000000 + made++);
    EXPECT_TRUE(create(id).ok());
    Context context;
    const auto stream = open(context, 1, id);
    for (const std::uint64_t to : trials) exchange(*stream, ask(1, trial(), frame(to)));
    return exchange(*stream, commit_message(1, fraction)).answer().summary().state().digest();
  };
  const std::uint64_t one = digest_of({1}, 0.5);
  EXPECT_EQ(digest_of({1}, 0.5), one);
  EXPECT_EQ(digest_of({3, 1}, 0.5), one) << "the trial before does not count";
  EXPECT_NE(digest_of({3}, 0.5), one);
  EXPECT_NE(digest_of({1}, 0.25), one);
  EXPECT_EQ(digest_of({1}, -0.0), digest_of({1}, 0.0));
}

TEST_F(TrialsTest, ACommitNeedsATrialThatWasAnsweredLast) {
  v1::SessionHeader wanted = header();
  v1::Body& body = *wanted.add_bodies();
  body.set_vertex_count(grids_.vertex_count());
  ASSERT_TRUE(create(wanted, faces(), frame(0)).ok());
  Context context;
  const auto stream = open(context, 1);
  const auto expect_refused = [&](std::uint64_t number, const char* why) {
    const v1::SessionState before = state();
    const auto response = exchange(*stream, commit_message(number, 1));
    EXPECT_EQ(code_of(response), StatusCode::FAILED_PRECONDITION) << why;
    EXPECT_EQ(detail_of(response.error().status()).reason(), v1::ERROR_REASON_INVALID_INPUT) << why;
    EXPECT_TRUE(same(state(), before)) << why;
  };
  expect_refused(1, "there was none");
  std::string bad = frame(2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(bad.data() + 8, &nan, 8);
  ASSERT_TRUE(exchange(*stream, ask(1, trial(), frame(1))).has_answer());
  EXPECT_EQ(code_of(exchange(*stream, ask(1, trial(), bad))), StatusCode::INVALID_ARGUMENT);
  expect_refused(1, "a later one failed");
  ASSERT_TRUE(exchange(*stream, ask(1, trial(), frame(1))).has_answer());
  EXPECT_EQ(code_of(exchange(*stream, ask(1, trial(), "abc"))), StatusCode::INVALID_ARGUMENT);
  expect_refused(1, "a later one was too short");
  ASSERT_TRUE(exchange(*stream, ask(1, trial(), frame(1))).has_answer());
  EXPECT_EQ(code_of(exchange(*stream, ask(1, question(static_cast<Kind::Kind>(9)), frame(1)))),
            StatusCode::INVALID_ARGUMENT);
  expect_refused(1, "a later question was unknown");
  ASSERT_TRUE(exchange(*stream, ask(1, trial(), frame(1))).has_answer());
  ASSERT_TRUE(exchange(*stream, frame_message(1, frame(1))).has_answer());
  expect_refused(2, "it was of the frame before");
  ASSERT_TRUE(exchange(*stream, ask(2, trial(), frame(2))).has_answer());
  Context changing;
  v1::ChangeSceneRequest change;
  change.set_session_id(kId);
  change.set_next_frame(2);
  v1::BodyAddition& add = *change.add_changes()->mutable_add();
  add.mutable_body()->set_vertex_count(3);
  const std::array<std::int32_t, 3> face{0, 1, 2};
  add.set_faces(std::string(reinterpret_cast<const char*>(face.data()), sizeof face));
  add.set_positions(bytes_of({0, 0, 9, 1, 0, 9, 0, 1, 9}));
  v1::ChangeSceneResponse changed;
  ASSERT_TRUE(stub_->ChangeScene(&changing, change, &changed).ok());
  expect_refused(2, "the scene changed since");
  std::vector<double> next = grids_.positions(2);
  next.insert(next.end(), {0, 0, 9, 1, 0, 9, 0, 1, 9});
  ASSERT_TRUE(exchange(*stream, ask(2, trial(), bytes_of(next))).has_answer());
  for (const double fraction : {-0.1, 1 + 0x1p-52, nan}) {
    const auto response = exchange(*stream, commit_message(2, fraction));
    EXPECT_EQ(code_of(response), StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(words_of(response), HasSubstr("frame 2: fraction: "));
  }
  const auto gap = exchange(*stream, commit_message(3, 1));
  EXPECT_EQ(detail_of(gap.error().status()).reason(), v1::ERROR_REASON_FRAME_OUT_OF_ORDER);
  EXPECT_TRUE(exchange(*stream, commit_message(2, 1)).has_answer()) << "the trial may still be committed";
}

TEST_F(TrialsTest, AskWithOptionsOfTheirOwn) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  const auto all = exchange(*stream, ask(1, trial(), frame(1)));
  ASSERT_GT(all.answer().summary().rows(), 3u);
  v1::Question counted = trial();
  counted.set_report(v1::REPORT_COUNT);
  const auto count = exchange(*stream, ask(1, counted, frame(1)));
  EXPECT_EQ(count.answer().summary().rows(), 0u);
  EXPECT_EQ(count.answer().summary().vf(), all.answer().summary().vf());
  const auto part = exchange(*stream, commit_message(1, 0.9));
  EXPECT_FALSE(part.answer().summary().commit_counted()) << "which of them lie within it is not known";
  v1::Question fields = trial();
  fields.mutable_fields()->set_points(true);
  const auto told = exchange(*stream, ask(2, fields, frame(2)));
  ASSERT_TRUE(told.has_answer()) << told.ShortDebugString();
  EXPECT_EQ(told.answer().contacts().points().size(), 48 * told.answer().summary().rows());
  EXPECT_GT(told.answer().summary().rows(), 0u);
  v1::Question wide = trial();
  wide.set_min_separation(10);
  EXPECT_GT(exchange(*stream, ask(2, wide, frame(2))).answer().summary().vf(), told.answer().summary().vf());
  // Everything is within it at the start; left out, it stops where it would touch.
  v1::Question how_far = question(Kind::KIND_MAX_STEP);
  how_far.set_min_separation(10);
  const auto here = exchange(*stream, ask(2, how_far, frame(2)));
  EXPECT_EQ(here.answer().summary().earliest_toi(), 0);
  how_far.set_leave_out_overlaps(true);
  const auto out = exchange(*stream, ask(2, how_far, frame(2)));
  v1::Question touching = question(Kind::KIND_MAX_STEP);
  touching.set_min_separation(0);
  const auto first_touch = exchange(*stream, ask(2, touching, frame(2))).answer().summary();
  ASSERT_TRUE(first_touch.has_earliest_toi());
  EXPECT_NEAR(out.answer().summary().earliest_toi(), first_touch.earliest_toi(), 1e-5);
  EXPECT_EQ(out.answer().summary().overlaps_at_start(),
            here.answer().summary().overlaps_at_start() + here.answer().summary().rows());
  // Nearer than it is nothing may come, but for a millionth.
  v1::Question kept = question(Kind::KIND_MAX_STEP);
  kept.set_leave_out_overlaps(true);
  const auto free_way = exchange(*stream, ask(2, kept, frame(2))).answer().summary();
  kept.set_keep_distance(1 - 1e-6);
  const auto kept_way = exchange(*stream, ask(2, kept, frame(2))).answer().summary();
  ASSERT_TRUE(kept_way.has_earliest_toi());
  EXPECT_GT(kept_way.earliest_toi(), 0);
  EXPECT_LT(kept_way.earliest_toi(), 1e-2);
  if (free_way.has_earliest_toi()) {
    EXPECT_LT(kept_way.earliest_toi(), free_way.earliest_toi());
  }
  v1::Question one = trial();
  one.set_max_contacts(1);
  const auto few = exchange(*stream, ask(2, one, frame(2)));
  EXPECT_EQ(code_of(few), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(detail_of(few.error().status()).limit(), "max-contacts");
  EXPECT_EQ(code_of(exchange(*stream, commit_message(2, 1))), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(exchange(*stream, ask(2, trial(), frame(2))).answer().summary().rows(),
            told.answer().summary().rows());
}

TEST_F(TrialsTest, ARefusedQuestionSaysWhatIsWrongWithIt) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  const auto expect = [&](const char* field, v1::Question::Kind kind, auto spoil) {
    v1::Question bad = question(kind);
    spoil(bad);
    const auto response = exchange(*stream, ask(1, bad, frame(1)));
    EXPECT_EQ(code_of(response), StatusCode::INVALID_ARGUMENT) << field;
    EXPECT_EQ(response.error().frame(), 1u);
    EXPECT_THAT(words_of(response), HasSubstr(std::string("frame 1: question.") + field + ": "));
  };
  using Question = v1::Question;
  const auto trial = Kind::KIND_TRIAL, max_step = Kind::KIND_MAX_STEP, step = Kind::KIND_STEP;
  expect("kind", static_cast<Kind::Kind>(77), [](Question&) {});
  expect("tier", trial, [](Question& q) { q.set_tier(static_cast<v1::Tier>(77)); });
  expect("report", step, [](Question& q) { q.set_report(static_cast<v1::Report>(77)); });
  expect("tolerance", trial, [](Question& q) { q.set_tolerance(0); });
  expect("tolerance", step, [](Question& q) { q.set_tolerance(2); });
  expect("min_separation", trial, [](Question& q) { q.set_min_separation(-1); });
  expect("min_separation", max_step, [](Question& q) {
    q.set_min_separation(1);
    q.set_tier(v1::TIER_FAST);
  });
  expect("report", max_step, [](Question& q) { q.set_report(v1::REPORT_ALL); });
  expect("fields", max_step, [](Question& q) { q.mutable_fields(); });
  expect("leave_out_overlaps", trial, [](Question& q) { q.set_leave_out_overlaps(true); });
  expect("leave_out_overlaps", step, [](Question& q) { q.set_leave_out_overlaps(true); });
  for (const Kind::Kind kind : {trial, step})
    expect("keep_distance", kind, [](Question& q) { q.set_keep_distance(0.5); });
  for (const double s : {0.0, 1.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    expect("keep_distance", max_step, [s](Question& q) { q.set_keep_distance(s); });
  expect("keep_distance", max_step, [](Question& q) {
    q.set_keep_distance(0.5);
    q.set_tier(v1::TIER_FAST);
  });
  for (const Kind::Kind kind : {trial, step, max_step})
    expect("reduced", kind, [](Question& q) { q.set_reduced(true); });
  expect("max_contacts", trial,
         [](Question& q) { q.set_max_contacts(std::numeric_limits<std::uint64_t>::max()); });
  EXPECT_TRUE(exchange(*stream, frame_message(1, frame(1))).has_answer());
}

TEST_F(TrialsTest, AQuestionComesWithTheFirstPartOfItsFrame) {
  ASSERT_TRUE(create().ok());
  const std::string whole = frame(1);
  v1::StreamStepsRequest first = ask(1, trial(), whole.substr(0, 100));
  first.mutable_step()->set_more(true);
  {
    Context context;
    const auto stream = open(context, 1);
    ASSERT_TRUE(stream->Write(first));
    EXPECT_TRUE(exchange(*stream, frame_message(1, whole.substr(100))).has_answer());
    EXPECT_EQ(state().frame(), 0u);
  }
  const auto ends_with = [&](const v1::StreamStepsRequest& second) {
    Context context;
    const auto stream = open(context, 1, kId, true);
    stream->Write(first);
    stream->Write(second);
    v1::StreamStepsResponse response;
    while (stream->Read(&response)) {
    }
    return stream->Finish().error_code();
  };
  EXPECT_EQ(ends_with(ask(1, trial(), whole.substr(100))), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ends_with(commit_message(1, 1)), StatusCode::FAILED_PRECONDITION);
  Context context;
  const auto stream = stub_->StreamSteps(&context);
  stream->Write(commit_message(1, 1));
  v1::StreamStepsResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::FAILED_PRECONDITION) << "before any attach";
}

}  // namespace
}  // namespace warmfront::test
