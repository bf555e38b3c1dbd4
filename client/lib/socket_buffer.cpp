// SPDX-License-Identifier: Apache-2.0
// gRPC has no setting for this, but a hook for each socket it creates. The hook is set by a public function;
// its layout is in a header that is not installed. It is as below in the gRPC version named here; other
// versions are left alone.
#include "client/lib/socket_buffer.h"

#include <grpc/support/sync.h>
#include <grpcpp/version_info.h>
#include <sys/socket.h>

#if GRPC_CPP_VERSION_MAJOR == 1 && GRPC_CPP_VERSION_MINOR == 51

struct grpc_socket_mutator_vtable {
  bool (*mutate_fd)(int fd, grpc_socket_mutator* mutator);
  int (*compare)(grpc_socket_mutator* a, grpc_socket_mutator* b);
  void (*destroy)(grpc_socket_mutator* mutator);
  bool (*mutate_fd_2)(const void* info, grpc_socket_mutator* mutator);
};

struct grpc_socket_mutator {
  const grpc_socket_mutator_vtable* vtable;
  gpr_refcount refcount;
};

void grpc_socket_mutator_init(grpc_socket_mutator* mutator, const grpc_socket_mutator_vtable* vtable);

namespace warmfront::client {
namespace {

constexpr int kSendBytes = 2 << 20;

bool enlarge(int socket, grpc_socket_mutator*) {
  int domain = 0;
  socklen_t length = sizeof domain;
  if (getsockopt(socket, SOL_SOCKET, SO_DOMAIN, &domain, &length) == 0 && domain == AF_UNIX)
    static_cast<void>(setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kSendBytes, sizeof kSendBytes));
  return true;  // without it the socket is slower, but works
}

constexpr grpc_socket_mutator_vtable kHook{enlarge,
                                           [](grpc_socket_mutator*, grpc_socket_mutator*) { return 0; },
                                           [](grpc_socket_mutator* mutator) { delete mutator; }, nullptr};

}  // namespace

void enlarge_send_buffer(grpc::ChannelArguments& arguments) {
  auto* mutator = new grpc_socket_mutator;
  grpc_socket_mutator_init(mutator, &kHook);
  arguments.SetSocketMutator(mutator);  // takes ownership
}

}  // namespace warmfront::client

#else

namespace warmfront::client {

void enlarge_send_buffer(grpc::ChannelArguments&) {}

}  // namespace warmfront::client

#endif
