// SPDX-License-Identifier: Apache-2.0
// A collider's options on the wire. Thread-safe.
#pragma once

#include "engine/options.h"
#include "engine/result.h"
#include "warmfront/v1/options.pb.h"

namespace warmfront::wire {

v1::ContactFields to_proto(const ContactFields& fields);
ContactFields fields_from(const v1::ContactFields& message);

/// Every field set.
v1::ColliderOptions to_proto(const ColliderOptions& options);
/// Omitted fields get their default. kInvalidArgument, naming the field, for an enum value unknown to this
/// build; ranges are not checked (see validate()).
Result<ColliderOptions> options_from(const v1::ColliderOptions& message);

}  // namespace warmfront::wire
