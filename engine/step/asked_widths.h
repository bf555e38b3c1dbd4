// SPDX-License-Identifier: Apache-2.0
// Which separations are asked about, in what order: a solver asks for what is near, how far it may go, and
// moves, in turn, each with a separation of its own. Used by one thread at a time.
#pragma once

#include <algorithm>
#include <utility>

namespace warmfront {

/// All in scene units.
class AskedWidths {
 public:
  /// A question begins.
  void begin(double separation) {
    wider_ = separation > last_;
    last_ = separation;
    of_base_ = std::max(of_base_, separation);
    if (++questions_ >= kPeriod) {
      questions_ = 0;
      before_ = std::exchange(now_, 0);
    }
    now_ = std::max(now_, separation);
  }

  /// Is it wider than the question before?
  bool wider() const { return wider_; }
  /// The widest of the last questions, some kPeriod of them: what these need is kept, though the others do
  /// not.
  double held() const { return std::max(now_, before_); }

  /// Must budgets be looked at, whether they last for the question where its motion begins? (Front::settle())
  bool unsettled() const { return last_ > settled_; }
  void settle() { settled_ = last_; }
  /// The motion in hand was taken: where it ends, budgets last for its question.
  void step_taken() {
    settled_ = last_;
    of_base_ = 0;
  }
  /// As wide a question as budgets last for where motions begin, at least.
  double at_base() const { return std::max(last_, settled_); }
  /// Was the last question as wide as any since motions begin where they do?
  bool last_is_widest() const { return last_ >= of_base_; }
  /// The widest question since motions begin where they do: where they begin after a commit, budgets are to
  /// last for as wide a one.
  double commit() { return settled_ = std::exchange(of_base_, 0.0); }

 private:
  static constexpr int kPeriod = 32;

  bool wider_ = false;
  double last_ = 0;
  double settled_ = 0;
  double of_base_ = 0;
  int questions_ = 0;
  double now_ = 0;  // the widest of this period, and of the one before
  double before_ = 0;
};

}  // namespace warmfront
