// SPDX-License-Identifier: Apache-2.0
// What an elementary test answers, whatever its tier. A plain value.
#pragma once

#include "engine/contact.h"

namespace warmfront {

struct Verdict {
  bool contact = false;
  ContactStatus status = ContactStatus::kHit;  ///< meaningful only if contact
  double toi = 0;                              ///< likewise

  /// A contact from `toi` on; at 0 it is an overlap at start, whatever proved it.
  static Verdict at(double toi, ContactStatus status) {
    return {true, toi == 0 ? ContactStatus::kOverlapAtStart : status, toi};
  }
};

}  // namespace warmfront
