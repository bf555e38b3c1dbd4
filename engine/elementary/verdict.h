// SPDX-License-Identifier: Apache-2.0
// The answer of an elementary test of any tier. A plain value.
#pragma once

#include "engine/contact.h"

namespace warmfront {

struct Verdict {
  bool contact = false;
  ContactStatus status = ContactStatus::kHit;  ///< meaningful only if contact
  double toi = 0;                              ///< likewise

  /// A contact from `toi` on; kOverlapAtStart if `toi` is 0, whatever `status` is.
  static Verdict at(double toi, ContactStatus status) {
    return {true, toi == 0 ? ContactStatus::kOverlapAtStart : status, toi};
  }
};

}  // namespace warmfront
