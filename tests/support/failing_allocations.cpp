// SPDX-License-Identifier: Apache-2.0
#include "tests/support/failing_allocations.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace warmfront::testing {
namespace {

// Those left before the one that fails; negative: none does.
std::atomic<long> left{-1};
std::atomic<bool> all_after{false};
std::atomic<bool> failed{false};
std::atomic<std::size_t> live{0};
std::atomic<std::size_t> most_live{0};

bool fails() {
  if (left.load() >= 0 && left.fetch_sub(1) == 0) {
    failed = true;
    return true;
  }
  return all_after && failed;
}

void* allocate(std::size_t size, std::size_t alignment) {
  if (fails()) return nullptr;
  if (size == 0) size = 1;
  // aligned_alloc() asks for a multiple of the alignment.
  void* const memory = alignment == 0
                           ? std::malloc(size)
                           : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) return nullptr;
  const std::size_t now = live += malloc_usable_size(memory);
  std::size_t most = most_live.load();
  while (now > most && !most_live.compare_exchange_weak(most, now)) {
  }
  return memory;
}

void release(void* memory) {
  if (memory != nullptr) live -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

FailingAllocations::FailingAllocations(long n, Which which) {
  failed = false;
  all_after = which == Which::kAllFromThere;
  left = n;
}
FailingAllocations::~FailingAllocations() {
  left = -1;
  all_after = false;
}

bool FailingAllocations::met() {
  return failed;
}

std::size_t live_bytes() {
  return live;
}
std::size_t most_live_bytes() {
  return most_live;
}
void forget_most_live_bytes() {
  most_live = live.load();
}

}  // namespace warmfront::testing

namespace {

void* allocate_or_throw(std::size_t size, std::size_t alignment = 0) {
  void* const memory = warmfront::testing::allocate(size, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) {
  return allocate_or_throw(size);
}
void* operator new[](std::size_t size) {
  return allocate_or_throw(size);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return allocate_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return warmfront::testing::allocate(size, 0);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return warmfront::testing::allocate(size, 0);
}
void operator delete(void* memory) noexcept {
  warmfront::testing::release(memory);
}
void operator delete[](void* memory) noexcept {
  warmfront::testing::release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  warmfront::testing::release(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  warmfront::testing::release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  warmfront::testing::release(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  warmfront::testing::release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  warmfront::testing::release(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  warmfront::testing::release(memory);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
  warmfront::testing::release(memory);
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  warmfront::testing::release(memory);
}
