// SPDX-License-Identifier: Apache-2.0
// A message of the wire contract whose member there is no memory for: it is as it was, and can be freed.
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <new>

#include "tests/faults/our_allocations.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::test {
namespace {

/// `mutate` sets a member of a new message, whose first allocation fails. The message lies where something
/// else has been: what its constructor leaves as it finds it is no null pointer.
template <class Message, class Mutate>
void without_memory(Mutate mutate) {
  alignas(Message) unsigned char place[sizeof(Message)];
  std::memset(place, 0xAA, sizeof place);
  const auto freed = [](Message* message) { std::destroy_at(message); };
  const std::unique_ptr<Message, decltype(freed)> message(new (place) Message, freed);
  allocations_left = 0;
  EXPECT_THROW(mutate(*message), std::bad_alloc);
  EXPECT_LT(allocations_left.exchange(-1), 0) << "nothing was allocated";
  EXPECT_EQ(message->ByteSizeLong(), 0U) << message->ShortDebugString();
}

TEST(OneofWithoutMemory, LeavesTheMessageAsItWas) {
  without_memory<v1::CreateSessionRequest>([](auto& message) { message.mutable_header(); });
  without_memory<v1::SceneChange>([](auto& message) { message.mutable_add(); });
  without_memory<v1::StreamStepsRequest>([](auto& message) { message.mutable_step(); });
  without_memory<v1::StreamStepsResponse>([](auto& message) { message.mutable_attached(); });
}

}  // namespace
}  // namespace warmfront::test
