// SPDX-License-Identifier: Apache-2.0
// Every question after every other, of the same motion and of half of it, asked of a session in this process
// and of one behind a daemon, in float32 and float64: each answers as a session that was asked nothing else.
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <type_traits>
#include <vector>

#include "client/lib/any_session.h"
#include "tests/support/mixture.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

/// What may be told of an answer but for its cost.
struct Told {
  std::string error;
  KindCounts counts = {};
  std::uint64_t possible = 0;
  std::uint64_t overlaps = 0;
  std::optional<double> earliest = std::nullopt;
  std::optional<double> fraction = std::nullopt;
  ContactTable contacts = {};
  std::vector<double> distances = {};

  friend bool operator==(const Told&, const Told&) = default;
};

std::ostream& operator<<(std::ostream& out, const Told& told) {
  return out << told.error << " vf " << told.counts.vf << ", ee " << told.counts.ee << ", vh "
             << told.counts.vh << ", ef " << told.counts.ef << ", " << told.contacts.size() << " listed";
}

Told told(const Result<Answer>& answer) {
  if (!answer) return {.error = answer.error().message};
  const Answer& of = answer.value();
  return {{}, of, of.possible, of.overlaps_at_start, of.earliest_toi, {}, of.contacts, of.vertex_distances};
}

Told ask(AnySession& session, const Frame& frame, const Question& question) {
  switch (question.kind) {
    case QuestionKind::kTrial:
      return told(session.trial(frame, question.options));
    case QuestionKind::kProximity: {
      const double distance = *question.options.min_separation;
      if (question.options.report == Report::kVertexDistances)
        return told(session.vertex_distances(distance, question.where, question.options));
      return told(session.proximity(distance, question.where, question.options));
    }
    case QuestionKind::kIntersections:
      return told(session.intersections(question.where, question.options));
    default:
      break;
  }
  const Result<MaxStep> far = session.max_step(frame, question.leave_out_overlaps, question.options);
  if (!far) return {.error = far.error().message};
  Told all = told(far.value().answer);
  all.fraction = far.value().fraction;
  return all;
}

template <class Number>
class InTurnAnywhere : public ::testing::Test {};
using Numbers = ::testing::Types<double, float>;
TYPED_TEST_SUITE(InTurnAnywhere, Numbers);

TYPED_TEST(InTurnAnywhere, EachAnswersAsIfItWereTheFirst) {
  using Rows = std::span<const TypeParam>;
  const std::vector<Question> all = testing::all_questions();
  const auto workers = std::make_shared<Workers>(1);
  test::LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  std::size_t contacts = 0;
  for (const bool thick : {false, true}) {
    const ColliderOptions options{.min_separation = thick ? 0 : 0.03};
    testing::Mixture mixture(thick ? 1 : 0, thick);
    const auto rounded = [](const std::vector<double>& x) {
      return std::vector<TypeParam>(x.begin(), x.end());
    };
    const std::vector<TypeParam> start = rounded(mixture.x);
    const std::vector<TypeParam> other = rounded(mixture.moved(0, 3));
    const std::vector<TypeParam> whole = rounded(mixture.moved(0, 3));
    std::vector<TypeParam> half(whole.size());
    for (std::size_t i = 0; i < half.size(); ++i) half[i] = (start[i] + whole[i]) / 2;
    const auto local = [&] {
      return AnySession::create(mixture.scene, Rows(start), options, workers).value();
    };
    std::vector<Told> of_whole, of_half;
    for (const Question& question : all) {
      for (const bool is_whole : {true, false}) {
        AnySession fresh = local();
        const Frame to = Rows(is_whole ? whole : half);
        EXPECT_TRUE(fresh.trial(to).ok());
        (is_whole ? of_whole : of_half).push_back(ask(fresh, to, question));
      }
    }
    contacts += of_whole[3].contacts.size();
    std::vector<AnySession> both;
    both.push_back(local());
    both.emplace_back(client.create_session(mixture.scene, Rows(start), options).value());
    for (AnySession& session : both) {
      for (std::size_t a = 0; a < all.size(); ++a) {
        if (!of_whole[a].error.empty()) continue;  // what is thick has no tier fast
        for (std::size_t b = 0; b < all.size(); ++b) {
          SCOPED_TRACE("question " + std::to_string(b) + " after " + std::to_string(a) +
                       (session.is_remote() ? ", remote" : ", local") + (thick ? ", thick" : ""));
          ASSERT_TRUE(session.trial(Rows(other)).ok() && session.trial(Rows(whole)).ok());
          ASSERT_EQ(ask(session, Rows(whole), all[a]), of_whole[a]);
          ASSERT_EQ(ask(session, Rows(whole), all[b]), of_whole[b]);
          if (all[b].of_state()) continue;
          ASSERT_EQ(ask(session, Rows(half), all[b]), of_half[b]) << "of half of it";
        }
      }
    }
  }
  EXPECT_GT(contacts, 40U);
}

}  // namespace
}  // namespace warmfront::client
