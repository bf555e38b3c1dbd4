// SPDX-License-Identifier: Apache-2.0
#include "tests/support/carry_out.h"

#include <new>
#include <utility>

#include "engine/collider.h"
#include "tests/support/counted_looks.h"
#include "tests/support/failing_allocations.h"

namespace warmfront::testing {
namespace {

template <class... Ways>
struct Overloaded : Ways... {
  using Ways::operator()...;
};
template <class... Ways>
Overloaded(Ways...) -> Overloaded<Ways...>;

// A call with its arguments laid out, so that nothing but the call itself allocates.
class Call {
 public:
  explicit Call(const Operation& operation) : operation_(operation) {
    if (const auto* step = std::get_if<StepOperation>(&operation)) lay_out(*step);
    if (const auto* add = std::get_if<AddOperation>(&operation)) addition_ = add->addition;
    if (const auto* several = std::get_if<ChangesOperation>(&operation)) changes_ = several->changes;
  }

  // A step's answer is a view into the collider.
  struct Answer {
    std::optional<Error> error;
    std::optional<StepResult> step;
  };
  Answer make(Collider& collider, const std::atomic<bool>* flag) {
    const auto of = [](auto&& result) {
      return result.ok() ? Answer{} : Answer{result.error(), std::nullopt};
    };
    return std::visit(
        Overloaded{
            [&](const StepOperation& step) -> Answer {
              if (step.as == StepOperation::As::kMaxStep) return max_step(collider, step, flag);
              if (step.as == StepOperation::As::kPlace) {
                Result<StepResult> placed = collider.ask(frame_, {QuestionKind::kPlace, step.options}, flag);
                if (!placed) return {std::move(placed.error()), std::nullopt};
                return {std::nullopt, std::move(placed).value()};
              }
              Result<StepResult> result = step.as == StepOperation::As::kTrial
                                              ? collider.trial(frame_, step.options, flag)
                                              : collider.step(frame_, flag, {}, step.options);
              if (!result) return {std::move(result.error()), std::nullopt};
              return {std::nullopt, std::move(result).value()};
            },
            [&](const PlaceOperation& place) { return of(collider.place(place.poses, flag)); },
            [&](const AddOperation& add) {
              return of(
                  collider.add_body(std::move(addition_), std::span<const double>(add.positions), flag));
            },
            [&](const ChangeOperation& change) {
              return of(collider.change_body(change.body, change.as, flag));
            },
            [&](const ChangesOperation& several) {
              return of(collider.change(std::move(changes_), flag, nullptr, several.options));
            },
            [&](const CommitOperation& commit) {
              return of(collider.commit(commit.fraction, commit.rounding));
            },
            [&](const NearOperation& near) -> Answer {
              Result<StepResult> result =
                  near.tangled ? collider.intersections(near.where, near.options, flag)
                               : collider.proximity(near.distance, near.where, near.options, flag);
              if (!result) return {std::move(result.error()), std::nullopt};
              return {std::nullopt, std::move(result).value()};
            },
            [&](const CheckOperation&) { return of(collider.self_check(flag)); },
            [&](const ForgetOperation&) {
              collider.forget_warmth();
              return Answer{};
            },
        },
        operation_);
  }

 private:
  // As the answer of a step, of which the first contact is known.
  Answer max_step(Collider& collider, const StepOperation& step, const std::atomic<bool>* flag) {
    Result<MaxStep> result = collider.max_step(frame_, step.leave_out_overlaps, step.options, flag);
    if (!result) return {std::move(result.error()), std::nullopt};
    StepResult answer;
    answer.overlaps_at_start = result.value().overlaps_at_start;
    worlds_ = std::move(result.value().worlds);
    world_fractions_ = std::move(result.value().world_fractions);
    answer.worlds = worlds_;
    answer.world_tois = world_fractions_;
    if (result.value().first) {
      answer.earliest_toi = result.value().fraction;
      first_ = *result.value().first;
      answer.contacts = {&first_, 1};
    }
    return {std::nullopt, std::move(answer)};
  }

  void lay_out(const StepOperation& step) {
    if (step.all) frame_.positions = std::span<const double>(*step.all);
    for (const StepOperation::Rows& rows : step.bodies)
      bodies_.push_back({rows.body, std::span<const double>(rows.positions)});
    frame_.bodies = bodies_;
    frame_.poses = step.poses;
    frame_.vertices = step.vertices;
    frame_.vertex_positions = std::span<const double>(step.vertex_positions);
  }

  const Operation& operation_;
  Contact first_{};
  std::vector<std::uint32_t> worlds_;
  std::vector<double> world_fractions_;
  Frame frame_;
  std::vector<BodyPositions> bodies_;
  BodyAddition addition_;
  std::vector<SceneChange> changes_;
};

Outcome outcome_of(Call::Answer&& answer) {
  Outcome outcome;
  if (answer.error) {
    outcome.kind = Outcome::Kind::kRefused;
    outcome.error = std::move(*answer.error);
  } else if (answer.step) {
    outcome.vf = answer.step->vf;
    outcome.ee = answer.step->ee;
    outcome.ef = answer.step->ef;
    outcome.vh = answer.step->vh;
    outcome.possible = answer.step->possible;
    outcome.earliest_toi = answer.step->earliest_toi;
    outcome.contacts.assign(answer.step->contacts.begin(), answer.step->contacts.end());
    outcome.geometry.assign(answer.step->geometry.begin(), answer.step->geometry.end());
    outcome.closest_pairs.assign(answer.step->closest_pairs.begin(), answer.step->closest_pairs.end());
    outcome.vertex_distances.assign(answer.step->vertex_distances.begin(),
                                    answer.step->vertex_distances.end());
    outcome.worlds.assign(answer.step->worlds.begin(), answer.step->worlds.end());
    outcome.world_tois.assign(answer.step->world_tois.begin(), answer.step->world_tois.end());
  }
  return outcome;
}

}  // namespace

std::string to_string(const Fault& fault) {
  const std::string n = std::to_string(fault.n);
  switch (fault.kind) {
    case Fault::Kind::kNone:
      return "no fault";
    case Fault::Kind::kAllocation:
      return "allocation " + n + " fails";
    case Fault::Kind::kAllAllocations:
      return "allocations from " + n + " on fail";
    case Fault::Kind::kCancelled:
      return "cancelled at look " + n;
  }
  return "?";
}

Outcome carry_out(Collider& collider, const Operation& operation, const Fault& fault) {
  Call call(operation);
  const bool cancels = fault.kind == Fault::Kind::kCancelled;
  const bool allocations =
      fault.kind == Fault::Kind::kAllocation || fault.kind == Fault::Kind::kAllAllocations;
  Call::Answer answer;
  bool out_of_memory = false;
  {
    const CountedLooks looks(cancels ? fault.n : -1);
    const FailingAllocations failing(allocations ? fault.n : -1,
                                     fault.kind == Fault::Kind::kAllAllocations
                                         ? FailingAllocations::Which::kAllFromThere
                                         : FailingAllocations::Which::kOne);
    try {
      answer = call.make(collider, CountedLooks::flag());
    } catch (const std::bad_alloc&) {
      out_of_memory = true;
    }
  }
  Outcome outcome = outcome_of(std::move(answer));
  if (out_of_memory) outcome.kind = Outcome::Kind::kOutOfMemory;
  outcome.met_fault = cancels ? CountedLooks::met() : allocations && FailingAllocations::met();
  return outcome;
}

}  // namespace warmfront::testing
