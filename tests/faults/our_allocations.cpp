// SPDX-License-Identifier: Apache-2.0
#include "tests/faults/our_allocations.h"

#include <dlfcn.h>
#include <unwind.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string_view>

namespace warmfront::test {

std::atomic<long> allocations_left{-1};
thread_local bool allocations_are_exempt = false;

}  // namespace warmfront::test

namespace {

using warmfront::test::allocations_are_exempt;
using warmfront::test::allocations_left;
using warmfront::test::kDisarmed;

thread_local bool looking = false;

enum class Whose : std::uintptr_t { kUnknown, kOurs, kTheirs, kOfItsCaller };

bool has(const char* text, const char* part) {
  return text != nullptr && std::strstr(text, part) != nullptr;
}

// gRPC's own allocations do not fail here, including messages of typed calls that it parses outside of
// reactions: a failure there ends the process, by gpr_malloc() or by an exception on gRPC's threads, which no
// reaction can prevent.
Whose whose(std::uintptr_t address) {
  Dl_info info{};
  if (dladdr(reinterpret_cast<void*>(address), &info) == 0) return Whose::kOurs;
  for (const char* library : {"libstdc++", "libprotobuf", "libc.so", "libgcc", "libspdlog", "libfmt"})
    if (has(info.dli_fname, library)) return Whose::kOfItsCaller;
  if (has(info.dli_fname, ".so")) return Whose::kTheirs;
  if (info.dli_sname == nullptr) return Whose::kOurs;
  const std::string_view name = info.dli_sname;
  if (has(info.dli_sname, "Handler"))
    return name.starts_with("_ZN4grpc") ? Whose::kTheirs : Whose::kOfItsCaller;
  if (has(info.dli_sname, "erializ")) return Whose::kOfItsCaller;
  for (const char* of_caller : {"_ZNSt", "_ZNKSt", "_ZSt", "_ZN9__gnu_cxx", "_ZN6google", "_ZN9warmfront2v1",
                                "_ZNK9warmfront2v1", "_Zn", "_ZN6spdlog", "_ZN3fmt"})
    if (name.starts_with(of_caller)) return Whose::kOfItsCaller;
  return name.starts_with("_ZN4grpc") || name.starts_with("_ZNK4grpc") ? Whose::kTheirs : Whose::kOurs;
}

// Addresses seen, so that each is looked up once.
std::array<std::atomic<std::uintptr_t>, 1 << 16> seen{};

Whose looked_up(std::uintptr_t address) {
  std::atomic<std::uintptr_t>& place = seen[(address * 0x9E3779B97F4A7C15ULL) >> 48];
  const std::uintptr_t held = place.load(std::memory_order_relaxed);
  if (held >> 2 == address) return static_cast<Whose>(held & 3);
  const Whose found = whose(address);
  place.store(address << 2 | static_cast<std::uintptr_t>(found), std::memory_order_relaxed);
  return found;
}

struct Walk {
  int depth = 0;
  Whose found = Whose::kOfItsCaller;
};

// Of the nearest caller that is none of the standard library or of protobuf.
Whose caller() {
  Walk walk;
  _Unwind_Backtrace(
      [](_Unwind_Context* context, void* data) {
        Walk& walk = *static_cast<Walk*>(data);
        if (++walk.depth <= 3) return _URC_NO_REASON;  // of this file
        const std::uintptr_t address = _Unwind_GetIP(context);
        if (address != 0) walk.found = looked_up(address - 1);
        return walk.found == Whose::kOfItsCaller && walk.depth < 60 ? _URC_NO_REASON : _URC_END_OF_STACK;
      },
      &walk);
  return walk.found;
}

[[gnu::noinline]] bool fails() {
  const long left = allocations_left.load(std::memory_order_relaxed);
  if (left < 0 || left == kDisarmed || allocations_are_exempt || looking) return false;
  looking = true;
  const bool counts = caller() == Whose::kOurs;
  looking = false;
  return counts && allocations_left.fetch_sub(1) == 0;
}

[[gnu::noinline]] void* allocate(std::size_t size) {
  if (!fails())
    if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

// Where an allocation fails inside protobuf, it does not free what it had just made: some dozens of bytes.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:google::protobuf\n";
}

void* operator new(std::size_t size) {
  return allocate(size);
}
void* operator new[](std::size_t size) {
  return allocate(size);
}
// Of libraries alone, none of whose allocations fails here; a sanitizer would have its own.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return std::malloc(size == 0 ? 1 : size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
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
