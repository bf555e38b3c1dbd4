// SPDX-License-Identifier: Apache-2.0
// Send buffer size of local connections. Thread-safe.
#pragma once

#include <grpcpp/support/channel_arguments.h>

namespace warmfront::client {

/// Lets the channel's Unix sockets buffer a whole frame of positions, as far as the system allows
/// (net.core.wmem_max). With Linux's default of 208 KiB a larger frame is sent in pieces, with a wait for the
/// daemon to read each. TCP sizes its own buffers.
void enlarge_send_buffer(grpc::ChannelArguments& arguments);

}  // namespace warmfront::client
