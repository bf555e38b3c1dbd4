// SPDX-License-Identifier: Apache-2.0
// Exceptions to statuses. Thread safety as stated in the header.
#include "server/transport/reaction.h"

#include <exception>
#include <new>

#include "server/fault.h"
#include "server/transport/errors.h"

namespace warmfront::server {
namespace {

// Short enough for a string to hold them without memory.
grpc::Status plain_out_of_memory() {
  return {grpc::StatusCode::RESOURCE_EXHAUSTED, "out of memory"};
}
grpc::Status plain_internal() {
  return {grpc::StatusCode::INTERNAL, "internal error"};
}

}  // namespace

grpc::Status status_of_exception() noexcept {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    try {
      return to_grpc(limit_met(
          "the daemon has no memory for this call; the session is as it was, try again later, or use "
          "smaller scenes or fewer sessions",
          "memory", true));
    } catch (...) {
      return plain_out_of_memory();
    }
  } catch (const std::exception& error) {
    try {
      return to_grpc({ErrorCode::kInternal, Reason::kEngine,
                      std::string("the daemon failed in this call: ") + error.what()});
    } catch (...) {
      return plain_internal();
    }
  } catch (...) {
    return plain_internal();
  }
}

}  // namespace warmfront::server
