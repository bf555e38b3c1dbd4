// SPDX-License-Identifier: Apache-2.0
// A session's reported state: frame, revision and digest, changed by accepted input only; and changes of a
// scene, carried out together or not at all, and once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <set>
#include <thread>

#include "server/session/state_digest.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using server::StateDigest;
using ::testing::HasSubstr;

std::uint64_t digest_of(std::string_view bytes, std::uint64_t seed = 7) {
  StateDigest digest(seed);
  digest.add(bytes);
  return digest.value();
}

TEST(StateDigestTest, EveryBitEveryLengthAndEveryFieldCounts) {
  std::set<std::uint64_t> seen;
  std::size_t made = 0;
  const auto take = [&](std::uint64_t digest) {
    seen.insert(digest);
    ++made;
  };
  // Zeros alone, so that nothing but the length tells them apart.
  for (std::size_t size = 0; size <= 260; ++size) take(digest_of(std::string(size, '\0')));
  for (std::size_t bit = 0; bit < 8 * 260; ++bit) {
    std::string bytes(260, '\0');
    bytes[bit / 8] = static_cast<char>(1 << bit % 8);
    take(digest_of(bytes));
  }
  // Two signs that flip: the highest bits of two words, in one lane or in two.
  for (std::size_t a = 0; a < 32; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      std::string bytes(260, '\0');
      bytes[8 * a + 7] = bytes[8 * b + 7] = static_cast<char>(0x80);
      take(digest_of(bytes));
    }
  }
  for (std::uint64_t seed = 8; seed < 100; ++seed) take(digest_of("abc", seed));
  StateDigest split(7);
  split.add("ab");
  split.add("c");
  take(split.value());
  take(digest_of("abc"));
  EXPECT_EQ(seen.size(), made);
}

TEST(StateDigestTest, IsTheSameForTheSameBytesWhereverTheyLie) {
  const std::string bytes =
      "a state is compared and nothing else; wherever its bytes lie, they are the same bytes";
  for (std::size_t shift = 0; shift < 9; ++shift)
    EXPECT_EQ(digest_of(std::string_view(std::string(shift, ' ') + bytes).substr(shift)), digest_of(bytes));
}

TEST(StateDigestTest, IsTheSameHoweverTheBytesAreCut) {
  std::string bytes;
  for (int i = 0; i < 300; ++i) bytes += static_cast<char>(i * i + 3 * i);
  for (std::size_t first = 0; first <= bytes.size(); ++first)
    for (const std::size_t second :
         {std::size_t{0}, std::size_t{1}, std::size_t{63}, std::size_t{64}, std::size_t{65}}) {
      server::ContentHash content;
      const std::string_view rest = std::string_view(bytes).substr(first);
      content.add(std::string_view(bytes).substr(0, first));
      content.add(rest.substr(0, second));
      if (second < rest.size()) content.add(rest.substr(second));
      StateDigest digest(7);
      digest.add(content);
      EXPECT_EQ(digest.value(), digest_of(bytes)) << first << " and " << second;
    }
}

TEST(StateDigestTest, IsTheSameOfBytesThatAreCopied) {
  std::string bytes;
  for (int i = 0; i < 700; ++i) bytes += static_cast<char>(i * i + 5 * i);
  for (std::size_t first = 0; first <= bytes.size(); first += 13)
    for (const std::size_t second :
         {std::size_t{0}, std::size_t{1}, std::size_t{63}, std::size_t{64}, std::size_t{300}}) {
      server::ContentHash content;
      std::string copy(bytes.size(), '\0');
      std::size_t at = 0;
      for (const std::size_t size : {first, second, bytes.size()}) {
        const std::string_view piece = std::string_view(bytes).substr(at, size);
        content.copy(piece, copy.data() + at);
        at += piece.size();
      }
      StateDigest digest(7);
      digest.add(content);
      EXPECT_EQ(copy, bytes) << first << " and " << second;
      EXPECT_EQ(digest.value(), digest_of(bytes)) << first << " and " << second;
    }
}

// Clients keep digests while a daemon is replaced by the next version of it.
TEST(StateDigestTest, IsWhatItWas) {
  std::string bytes;
  for (int i = 0; i < 1000; ++i) bytes += static_cast<char>(7 * i);
  EXPECT_EQ(digest_of(bytes), 0x244b7c011a5241c3);
  EXPECT_EQ(digest_of(""), 0x2bce90d7aacae26f);
}

class SessionStateTest : public ServiceTest {
 protected:
  static bool same(const v1::SessionState& a, const v1::SessionState& b) {
    return a.frame() == b.frame() && a.revision() == b.revision() && a.digest() == b.digest();
  }
  grpc::Status create_with_bodies(const std::string& id = kId) {
    return create(header_with_bodies(id), faces(), frame(0));
  }
  static void add_triangle(v1::ChangeSceneRequest& request, double z) {
    v1::BodyAddition& add = *request.add_changes()->mutable_add();
    add.mutable_body()->set_vertex_count(3);
    const std::array<std::int32_t, 3> face{0, 1, 2};
    add.set_faces(std::string(reinterpret_cast<const char*>(face.data()), sizeof face));
    add.set_positions(bytes_of({0, 0, z, 1, 0, z, 0, 1, z}));
  }
  static void change_body(v1::ChangeSceneRequest& request, std::uint32_t index, v1::BodyKind kind) {
    request.add_changes()->mutable_change()->set_index(index);
    v1::Body& body = *request.mutable_changes()->rbegin()->mutable_change()->mutable_body();
    body.set_vertex_count(1);
    body.set_kind(kind);
  }
  static v1::ChangeSceneRequest request_for(std::uint64_t next_frame, const std::string& key = {}) {
    v1::ChangeSceneRequest request;
    request.set_session_id(kId);
    request.set_next_frame(next_frame);
    request.set_key(key);
    return request;
  }
  grpc::Status change(const v1::ChangeSceneRequest& request, v1::SessionState* state = nullptr) {
    Context context;
    v1::ChangeSceneResponse response;
    grpc::Status status = stub_->ChangeScene(&context, request, &response);
    if (state != nullptr) *state = response.state();
    return status;
  }
};

TEST_F(SessionStateTest, OnlyWhatIsAcceptedMovesIt) {
  ASSERT_TRUE(create().ok());
  ASSERT_TRUE(create(kOther).ok());
  const v1::SessionState start = session_info().state();
  EXPECT_TRUE(same(session_info(kOther).state(), start)) << "the same content, another id";
  std::vector<double> bad = grids_.positions(1);
  bad[5] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(step(1, bytes_of(bad)).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(step(2, frame(2)).error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_TRUE(same(session_info().state(), start));
  v1::StepResponse first, again, other;
  ASSERT_TRUE(step(1, frame(1), &first).ok());
  EXPECT_TRUE(same(first.summary().state_before(), start));
  EXPECT_TRUE(same(first.summary().state(), session_info().state()));
  EXPECT_EQ(first.summary().state().frame(), 1u);
  ASSERT_TRUE(step(1, frame(1), &again).ok());
  EXPECT_TRUE(same(again.summary().state(), first.summary().state()));
  EXPECT_EQ(step(1, frame(2)).error_code(), StatusCode::ABORTED);
  EXPECT_TRUE(same(session_info().state(), first.summary().state()));
  ASSERT_TRUE(step(1, frame(2), &other, kOther).ok());
  EXPECT_NE(other.summary().state().digest(), first.summary().state().digest());
  EXPECT_TRUE(same(other.summary().state_before(), start));
}

TEST_F(SessionStateTest, AStreamReceivesItWhenItAttaches) {
  v1::SessionHeader later = header();
  later.set_first_frame(40);
  later.set_first_revision(3);
  ASSERT_TRUE(create(later, faces(), frame(0)).ok());
  const auto attached = [&] {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    stream->Write(attach(kId, true));
    v1::StreamStepsResponse response;
    EXPECT_TRUE(stream->Read(&response));
    context.TryCancel();
    static_cast<void>(stream->Finish());
    return response.attached();
  };
  const v1::Attached fresh = attached();
  EXPECT_EQ(fresh.state().frame(), 40u);
  EXPECT_EQ(fresh.state().revision(), 3u);
  EXPECT_FALSE(fresh.has_state_before()) << "nothing was accepted yet";
  v1::StepResponse response;
  ASSERT_TRUE(step(41, frame(1), &response).ok());
  const v1::Attached stepped = attached();
  EXPECT_EQ(stepped.expected_frame(), 42u);
  EXPECT_TRUE(same(stepped.state(), response.summary().state()));
  EXPECT_TRUE(same(stepped.state_before(), fresh.state()));
}

TEST_F(SessionStateTest, AChangeWithTheSameKeyIsDoneOnce) {
  ASSERT_TRUE(create_with_bodies().ok());
  v1::ChangeSceneRequest request = request_for(1, "the key");
  add_triangle(request, 5);
  const v1::SessionState start = session_info().state();
  v1::SessionState first, again;
  ASSERT_TRUE(change(request, &first).ok());
  EXPECT_EQ(first.revision(), start.revision() + 1);
  EXPECT_NE(first.digest(), start.digest());
  ASSERT_TRUE(change(request, &again).ok());
  EXPECT_TRUE(same(again, first));
  EXPECT_EQ(session_info().body_count(), 3u);
  v1::ChangeSceneRequest other = request_for(1, "the key");
  add_triangle(other, 6);
  const grpc::Status refused = change(other);
  EXPECT_EQ(refused.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("key: "));
  other.set_key("another");
  ASSERT_TRUE(change(other).ok());
  EXPECT_EQ(session_info().body_count(), 4u);
  EXPECT_EQ(change(request_for(1, std::string(65, 'k'))).error_code(), StatusCode::INVALID_ARGUMENT);
}

TEST_F(SessionStateTest, AChangeIsMadeOfTheStateThatItIsMeantFor) {
  ASSERT_TRUE(create_with_bodies().ok());
  v1::ChangeSceneRequest request = request_for(1);
  *request.mutable_expected_state() = session_info().state();
  change_body(request, 1, v1::BODY_KIND_RIGID);
  ASSERT_TRUE(change(request).ok());
  const grpc::Status late = change(request);
  EXPECT_EQ(late.error_code(), StatusCode::ABORTED);
  EXPECT_EQ(detail_of(late).reason(), v1::ERROR_REASON_STATE_CHANGED);
  *request.mutable_expected_state() = session_info().state();
  EXPECT_TRUE(change(request).ok());
}

TEST_F(SessionStateTest, ChangesAreMadeTogetherOrNotAtAll) {
  ASSERT_TRUE(create_with_bodies().ok());
  const v1::SessionInfo before = session_info();
  const auto refused = [&](auto spoil, const std::string& words) {
    v1::ChangeSceneRequest request = request_for(1, "k");
    add_triangle(request, 0.1);
    change_body(request, 0, v1::BODY_KIND_REMOVED);
    spoil(request);
    const grpc::Status status = change(request);
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("changes[2]: "));
    EXPECT_THAT(status.error_message(), HasSubstr(words));
    EXPECT_TRUE(same(session_info().state(), before.state()));
    EXPECT_EQ(session_info().vertex_count(), before.vertex_count());
    EXPECT_EQ(session_info().body_count(), before.body_count());
  };
  refused([](auto& request) { change_body(request, 9, v1::BODY_KIND_RIGID); }, "9");
  refused([](auto& request) { change_body(request, 0, v1::BODY_KIND_RIGID); }, "was removed");
  refused([](auto& request) { add_triangle(request, std::numeric_limits<double>::quiet_NaN()); }, "finite");
  refused(
      [](auto& request) {
        add_triangle(request, 1);
        request.mutable_changes(2)->mutable_add()->mutable_body()->set_group(0);
      },
      "group");
  v1::StepResponse response;
  ASSERT_TRUE(step(1, frame(1), &response).ok()) << "with the vertices that it had";
  EXPECT_EQ(hash_of(response.contacts()), local_hashes(grids_, 0, 1).front());
  v1::ChangeSceneRequest right = request_for(2, "k");
  add_triangle(right, 0.1);
  change_body(right, 0, v1::BODY_KIND_REMOVED);
  change_body(right, 2, v1::BODY_KIND_RIGID);
  EXPECT_TRUE(change(right).ok()) << "a key of what was refused is free";
  EXPECT_EQ(session_info().body_count(), before.body_count() + 1);
}

// A request about one session counts as use, listing all does not.
TEST_F(SessionStateTest, GetSessionKeepsItFromExpiring) {
  using std::chrono::milliseconds;
  ASSERT_TRUE(create().ok());
  const auto listed_idle = [&] {
    Context context;
    v1::ListSessionsResponse listed;
    EXPECT_TRUE(stub_->ListSessions(&context, {}, &listed).ok());
    return milliseconds(listed.sessions(0).idle_ms());
  };
  std::this_thread::sleep_for(milliseconds(60));
  EXPECT_GE(listed_idle(), milliseconds(59));
  EXPECT_GE(listed_idle(), milliseconds(59));
  const auto asked = std::chrono::steady_clock::now();
  session_info();
  const milliseconds idle = listed_idle();
  EXPECT_LE(idle, std::chrono::steady_clock::now() - asked);
}

}  // namespace
}  // namespace warmfront::test
