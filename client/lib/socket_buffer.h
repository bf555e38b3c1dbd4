// SPDX-License-Identifier: Apache-2.0
// How much a connection to this machine takes at once. Thread-safe.
#pragma once

#include <grpcpp/support/channel_arguments.h>

namespace warmfront::client {

/// Lets the channel's Unix sockets take a frame of positions at once, as far as the system allows
/// (net.core.wmem_max). With Linux's 208 KiB a larger frame is handed over in turns, each of which waits for
/// the daemon to read and for this process to hear of it. TCP sizes its own buffers.
void enlarge_send_buffer(grpc::ChannelArguments& arguments);

}  // namespace warmfront::client
