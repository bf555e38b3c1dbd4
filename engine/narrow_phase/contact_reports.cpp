// SPDX-License-Identifier: Apache-2.0
// What a thread does with the contacts that it finds, or kept, as the report that is asked for wants it:
// counts them, lists them, or keeps the earliest; and what it notes of a trial for shorter ones.
#include <algorithm>
#include <atomic>

#include "engine/narrow_phase/pair_tester.h"
#include "engine/narrow_phase/world_of.h"

namespace warmfront {

bool PairTester::room_to_note(std::size_t more) {
  met_.count += more;
  return met_.count <= NarrowPhaseInput::kMostMet;
}

void PairTester::note_kept(std::uint64_t triangle_pairs, const ContactTally& tally,
                           std::span<const Contact> contacts) {
  if (!input_->note_met || !room_to_note(contacts.size())) return;
  met_.rested = true;
  met_.kept.triangle_pairs += triangle_pairs;
  met_.kept.tally.add(tally);
  met_.kept.contacts.insert(met_.kept.contacts.end(), contacts.begin(), contacts.end());
}

void PairTester::keep(const Contact& contact) {
  ++output_.counts.contacts_kept;
  report(contact);
}

void PairTester::keep(const ContactTally& tally) {
  output_.counts.contacts_kept += tally.total();
  output_.found.add(tally.found);
  output_.possible += tally.possible;
  output_.earliest = std::min(output_.earliest, tally.earliest);
}

void PairTester::report(const Contact& contact) {
  const Report wanted = input_->options.report;
  if (wanted == Report::kAny) {
    // One of all threads, so that the number is 1.
    output_.found.ef += shared_->contacts.exchange(1, std::memory_order_relaxed) == 0;
    return;
  }
  output_.found.count(contact.kind);
  output_.possible += contact.status == ContactStatus::kPossible || contact.status == ContactStatus::kBudget;
  output_.earliest = std::min(output_.earliest, contact.toi);
  // Past the limit the whole answer is refused, so further contacts are not needed.
  if ((wanted == Report::kAll || wanted == Report::kCandidates) &&
      shared_->contacts.fetch_add(1, std::memory_order_relaxed) >= input_->options.max_contacts)
    throw TooManyContacts();
  if (recorder_ != nullptr) recorder_->push_back(contact);
  if (wanted == Report::kCount || wanted == Report::kVertexDistances) return;
  if (wanted == Report::kEarliest)
    keep_earliest(contact);
  else
    contacts_.push_back(contact);
}

// Ties with the earliest are kept; later contacts kept before it was found are dropped at the end, or here
// before the list grows.
void PairTester::keep_earliest(const Contact& contact) {
  const std::uint32_t world = world_of(contact, input_->scene, input_->numbering, input_->worlds);
  if (contact.toi > shared_->earliest.lower(world, contact.toi)) return;
  const std::size_t most = input_->options.max_contacts;
  if (input_->worlds.any()) {
    if (contacts_.size() > most_kept_) drop_later();
  } else {
    if (!contacts_.empty() && contact.toi < contacts_.back().toi) contacts_.clear();
    // One more than allowed suffices to refuse the answer, if these ties turn out to be the earliest.
    if (contacts_.size() > most) return;
  }
  contacts_.push_back(contact);
}

void PairTester::drop_later() {
  std::size_t at_start = 0;
  contacts_.erase_if([&](const Contact& c) {
    at_start += c.toi == 0;
    return c.toi > shared_->earliest.of(world_of(c, input_->scene, input_->numbering, input_->worlds));
  });
  const std::size_t most = input_->options.max_contacts;
  // Nothing is earlier than the start: so these stay, and the answer is refused.
  if (at_start > most) throw TooManyContacts();
  most_kept_ = std::max(most, 2 * contacts_.size());
}

}  // namespace warmfront
