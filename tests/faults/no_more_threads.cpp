// SPDX-License-Identifier: Apache-2.0
// Preloaded into the daemon: gRPC's timers get no further threads, as where memory or the number of processes
// is used up. Each refusal is logged to standard error. What gRPC 1.51's executor does without a thread,
// which may lose what it was to run, is no fault that a daemon can mend: see server/README.md. Thread-safe.
#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <string_view>

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*work)(void*),
                              void* argument) noexcept {
  static const auto create = reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  if (std::string_view(name.data()) != "grpc_global_tim") return create(thread, attributes, work, argument);
  dprintf(STDERR_FILENO, "no thread for %s\n", name.data());
  return EAGAIN;
}
