// SPDX-License-Identifier: Apache-2.0
// Trials and commits through a daemon, in order with steps: with the bits that a collider in this process
// gives.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/unit/server/trials_fixture.h"

namespace warmfront::test {
namespace {

using Kind = v1::Question;

template <class Real>
std::string bytes_as(const std::vector<double>& values) {
  const std::vector<Real> as(values.begin(), values.end());
  return {reinterpret_cast<const char*>(as.data()), as.size() * sizeof(Real)};
}

// In a session of Real's dtype, and beside it a collider that is asked the same.
template <class Real>
class TrialsOf : public TrialsTest {
 protected:
  static constexpr bool kSingle = sizeof(Real) == 4;

  void open_both(bool bodies) {
    v1::SessionHeader wanted = header();
    wanted.set_dtype(kSingle ? v1::DTYPE_FLOAT32 : v1::DTYPE_FLOAT64);
    SceneDescription scene = grids_.scene();
    const std::uint32_t half = grids_.vertex_count() / 2;
    if (bodies) {
      scene.bodies = {{"", 0, half}, {"", half, half, BodyKind::kRigid}};
      for (const std::uint32_t first : {0U, half}) {
        v1::Body& body = *wanted.add_bodies();
        body.set_first_vertex(first);
        body.set_vertex_count(half);
        body.set_kind(first == 0 ? v1::BODY_KIND_DEFORMABLE : v1::BODY_KIND_RIGID);
      }
    }
    ASSERT_TRUE(create(wanted, faces(), bytes_as<Real>(grids_.positions(0))).ok());
    const std::vector<double> at = grids_.positions(0);
    const std::vector<Real> start(at.begin(), at.end());
    scene_ = std::make_shared<const Scene>(Scene::create(scene).value());
    collider_.emplace(
        Collider::create(scene_, std::span<const Real>(start), {}, std::make_shared<Workers>(1)).value());
    stream_ = open(context_, 1);
  }

  void expect_answer(const StepResult& expected) {
    v1::StreamStepsResponse response;
    ASSERT_TRUE(stream_->Read(&response));
    ASSERT_TRUE(response.has_answer()) << response.ShortDebugString();
    const v1::StepSummary& summary = response.answer().summary();
    ContactHash hash;
    hash.add_step(*scene_, expected.contacts);
    EXPECT_EQ(hash_of(response.answer().contacts()), hash.value()) << "frame " << response.answer().frame();
    EXPECT_EQ(summary.vf(), expected.vf);
    EXPECT_EQ(summary.ee(), expected.ee);
    EXPECT_EQ(summary.has_earliest_toi(), expected.earliest_toi.has_value());
    EXPECT_EQ(summary.earliest_toi(), expected.earliest_toi.value_or(0));
    EXPECT_EQ(summary.overlaps_at_start(), expected.overlaps_at_start);
    contacts_ += expected.vf + expected.ee;
  }
  void expect_commit(const CommitResult& expected) {
    v1::StreamStepsResponse response;
    ASSERT_TRUE(stream_->Read(&response));
    ASSERT_TRUE(response.has_answer()) << response.ShortDebugString();
    EXPECT_TRUE(response.answer().last());
    const v1::StepSummary& summary = response.answer().summary();
    EXPECT_TRUE(summary.commit_counted());
    EXPECT_EQ(summary.rows(), 0u);
    EXPECT_EQ(summary.vf(), expected.vf);
    EXPECT_EQ(summary.ee(), expected.ee);
    EXPECT_EQ(summary.possible(), expected.possible);
    EXPECT_EQ(summary.has_earliest_toi(), expected.earliest_toi.has_value());
    EXPECT_EQ(summary.earliest_toi(), expected.earliest_toi.value_or(0));
  }
  static constexpr Rounding kRounding = kSingle ? Rounding::kFloat32 : Rounding::kFloat64;
  CommitResult commit(double fraction) { return collider_->commit(fraction, kRounding).value(); }

  Context context_;
  std::shared_ptr<const Scene> scene_;
  std::optional<Collider> collider_;
  std::unique_ptr<Stream> stream_;
  std::uint64_t contacts_ = 0;
};

using Dtypes = ::testing::Types<float, double>;
TYPED_TEST_SUITE(TrialsOf, Dtypes);

TYPED_TEST(TrialsOf, AreAnsweredInOrderWithStepsAndCommitsAsByACollider) {
  this->open_both(false);
  Stream& stream = *this->stream_;
  const auto frame = [&](std::uint64_t k) { return bytes_as<TypeParam>(this->grids_.positions(k)); };
  const auto send = [&](std::uint64_t number, const v1::Question& question, std::uint64_t to) {
    ASSERT_TRUE(stream.Write(this->ask(number, question, frame(to))));
  };
  // All are in flight, as far as the window lets them.
  send(1, trial(), 1);
  send(1, trial(), 3);
  send(1, trial(), 1);
  ASSERT_TRUE(stream.Write(commit_message(1, 0.4)));
  send(2, question(Kind::KIND_STEP), 2);
  send(3, question(Kind::KIND_MAX_STEP), 3);
  send(3, trial(), 1);
  send(3, question(Kind::KIND_UNSPECIFIED), 3);
  send(4, trial(), 4);
  ASSERT_TRUE(stream.Write(commit_message(4, 1)));
  ASSERT_TRUE(stream.Write(this->frame_message(5, frame(5))));

  const auto expect = [&](QuestionKind kind, std::uint64_t to) {
    const std::vector<double> at = this->grids_.positions(to);
    const std::vector<TypeParam> positions(at.begin(), at.end());
    this->expect_answer(this->collider_
                            ->ask(std::span<const TypeParam>(positions),
                                  Question{.kind = kind, .rounding = TestFixture::kRounding})
                            .value());
  };
  expect(QuestionKind::kTrial, 1);
  expect(QuestionKind::kTrial, 3);
  expect(QuestionKind::kTrial, 1);
  this->expect_commit(this->commit(0.4));
  expect(QuestionKind::kStep, 2);
  expect(QuestionKind::kMaxStep, 3);
  expect(QuestionKind::kTrial, 1);
  expect(QuestionKind::kStep, 3);
  expect(QuestionKind::kTrial, 4);
  this->expect_commit(this->commit(1));
  expect(QuestionKind::kStep, 5);
  EXPECT_GT(this->contacts_, 100u);
  EXPECT_EQ(this->state().frame(), 5u);
}

TYPED_TEST(TrialsOf, OfFramesThatSayWhatMovedAreCommittedInPart) {
  this->open_both(true);
  const std::uint32_t half = this->grids_.vertex_count() / 2;
  const auto rows = [&](std::uint64_t k, std::uint32_t first, std::uint32_t count) {
    const std::vector<double> at = this->grids_.positions(k);
    return std::vector<TypeParam>(at.begin() + 3 * first, at.begin() + 3 * (first + count));
  };
  const auto text = [](const auto& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
  };
  std::uint64_t number = 0;
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t v = 0; v < half; v += 2) vertices.push_back(v);
  for (const double fraction : {0.25, 0.5, 1.0, 0.0, 0.75}) {
    ++number;
    // A turn and a shift of the rigid grid, and every second vertex of the other.
    Pose pose;
    const double angle = 0.02 * static_cast<double>(number);
    pose.matrix = {std::cos(angle),
                   -std::sin(angle),
                   0,
                   0.1,
                   std::sin(angle),
                   std::cos(angle),
                   0,
                   0,
                   0,
                   0,
                   1,
                   number % 2 == 0 ? 0.4 : -0.9};
    if (TestFixture::kSingle) pose = in_float32(pose);
    std::vector<TypeParam> moved;
    for (const std::uint32_t v : vertices) {
      const auto row = rows(number, v, 1);
      moved.insert(moved.end(), row.begin(), row.end());
    }
    v1::StreamStepsRequest request;
    request.mutable_step()->set_frame(number);
    *request.mutable_step()->mutable_question() = trial();
    v1::MovedParts& parts = *request.mutable_step()->mutable_moved();
    parts.set_poses(text(std::vector<TypeParam>(pose.matrix.begin(), pose.matrix.end())));
    parts.set_vertices(text(vertices));
    parts.set_vertex_positions(text(moved));
    ASSERT_TRUE(this->stream_->Write(request));
    ASSERT_TRUE(this->stream_->Write(commit_message(number, fraction)));
    Frame frame;
    const BodyPose posed{1, pose};
    frame.poses = std::span(&posed, 1);
    frame.vertices = vertices;
    frame.vertex_positions = std::span<const TypeParam>(moved);
    this->expect_answer(this->collider_->trial(frame).value());
    this->expect_commit(this->commit(fraction));
  }
  const auto whole = rows(9, 0, 2 * half);
  ASSERT_TRUE(this->stream_->Write(this->frame_message(number + 1, text(whole))));
  this->expect_answer(this->collider_->step(std::span<const TypeParam>(whole)).value());
  EXPECT_GT(this->contacts_, 100u);
}

}  // namespace
}  // namespace warmfront::test
