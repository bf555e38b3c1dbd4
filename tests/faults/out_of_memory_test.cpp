// SPDX-License-Identifier: Apache-2.0
// Memory runs out in the middle of a step, at every allocation in turn: the collider is then as it was before
// the call.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <new>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace {

// Counts down to the allocation that fails, in any thread; negative: none does.
std::atomic<long> allocations_left{-1};

void* allocate(std::size_t size) {
  if (allocations_left.load() >= 0 && allocations_left.fetch_sub(1) == 0) throw std::bad_alloc();
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) {
  return allocate(size);
}
void* operator new[](std::size_t size) {
  return allocate(size);
}
// Of temporary buffers, which are freed as what the others give: a sanitizer's own would not be told from it.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return allocate(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace warmfront {
namespace {

/// Did `call` run out of memory when its n-th allocation failed? Else it had fewer, and must succeed.
template <class Call>
bool fails_at(long nth, Call&& call) {
  bool answered = false, failed = false;
  allocations_left = nth;
  try {
    answered = call();
  } catch (const std::bad_alloc&) {
    failed = true;
  }
  allocations_left = -1;
  EXPECT_TRUE(answered || failed);
  return failed;
}

// With options.explain a second collider steps beside, which may run out of memory when the first has
// stepped.
class OutOfMemory : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Explain, OutOfMemory, ::testing::Bool());

TEST_P(OutOfMemory, AStepThatFailsDidNotHappen) {
  std::mt19937_64 random(2);
  const auto scene = testing::make_scene(21 * 21, testing::grid(20));
  std::vector<double> start(3 * 21 * 21);
  for (int i = 0; i < 21 * 21; ++i) {
    start[3 * i] = i / 21;
    start[3 * i + 1] = i % 21;
  }
  std::vector<double> crumpled = start;
  for (double& x : crumpled) x += 3 * (static_cast<double>(random() >> 11) * 0x1p-53);
  const auto workers = std::make_shared<Workers>(1);
  ColliderOptions options;
  options.explain = GetParam();
  const auto make = [&] {
    return std::move(Collider::create(scene, std::span<const double>(start), options, workers)).value();
  };
  Collider reference = make();
  const auto expected = reference.step(std::span<const double>(crumpled));
  ASSERT_TRUE(expected.ok());
  const std::vector<Contact> contacts(expected.value().contacts.begin(), expected.value().contacts.end());
  ASSERT_GT(contacts.size(), 100U);

  int failures = 0;
  for (long nth = 0;; ++nth) {
    Collider collider = make();
    if (!fails_at(nth, [&] { return collider.step(std::span<const double>(crumpled)).ok(); })) break;
    ++failures;
    ASSERT_TRUE(std::ranges::equal(collider.positions(), start)) << nth;
    const auto retried = collider.step(std::span<const double>(crumpled));
    ASSERT_TRUE(retried.ok()) << nth;
    ASSERT_TRUE(std::ranges::equal(retried.value().contacts, contacts))
        << "after allocation " << nth << " failed";
  }
  EXPECT_GT(failures, 5);
}

// So many pairs that they are put in order by counting, and that distances by vertex take several blocks.
TEST(OutOfMemoryOfQuestions, AQuestionThatFailsLeavesEverythingAsItWas) {
  std::mt19937_64 random(3);
  const auto scene = testing::make_scene(15 * 15, testing::grid(14));
  std::vector<double> crumpled(std::size_t{3} * 15 * 15);
  for (double& x : crumpled) x = 8 * (static_cast<double>(random() >> 11) * 0x1p-53);
  const auto workers = std::make_shared<Workers>(1);
  const auto make = [&] {
    return std::move(Collider::create(scene, std::span<const double>(crumpled), {}, workers)).value();
  };
  const std::array<QuestionOptions, 3> questions{
      {{}, {.reduced = true}, {.report = Report::kVertexDistances}}};
  for (const QuestionOptions& question : questions) {
    const auto ask = [&](Collider& collider) { return collider.proximity(0.5, Where::kBase, question); };
    Collider reference = make();
    const StepResult expected = ask(reference).value();
    ASSERT_GT(expected.vf + expected.ee, 2 * 8192U);
    const std::vector<Contact> contacts(expected.contacts.begin(), expected.contacts.end());
    const std::vector<double> distances(expected.vertex_distances.begin(), expected.vertex_distances.end());
    int failures = 0;
    for (long nth = 0;; ++nth) {
      Collider collider = make();
      if (!fails_at(nth, [&] { return ask(collider).ok(); })) break;
      ++failures;
      const StepResult again = ask(collider).value();
      ASSERT_TRUE(std::ranges::equal(again.contacts, contacts)) << "after allocation " << nth << " failed";
      ASSERT_TRUE(std::ranges::equal(again.vertex_distances, distances)) << nth;
    }
    EXPECT_GT(failures, 10);
  }
}

}  // namespace
}  // namespace warmfront
