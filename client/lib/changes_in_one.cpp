// SPDX-License-Identifier: Apache-2.0
#include "client/lib/changes_in_one.h"

#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace warmfront::client {
namespace {

/// Of the changes that have some.
const std::vector<double>* positions_in(const SceneChange& change) {
  if (const auto* add = std::get_if<AddBody>(&change)) return &add->positions;
  if (const auto* replace = std::get_if<ReplaceBody>(&change)) return &replace->positions;
  return nullptr;
}

}  // namespace

Status check_float32(std::span<const SceneChange> changes) {
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const std::vector<double>* const positions = positions_in(changes[i]);
    if (positions == nullptr) continue;
    for (std::size_t k = 0; k < positions->size(); ++k) {
      const double number = (*positions)[k];
      // What is no number at all is the engine's to refuse.
      if (static_cast<double>(static_cast<float>(number)) == number || number != number) continue;
      return Error{ErrorCode::kInvalidArgument,
                   "changes[" + std::to_string(i) + "]: positions[" + std::to_string(k / 3) +
                       "]: " + std::to_string(number) +
                       " is no float32, which the session's positions are; round it first"};
    }
  }
  return {};
}

Result<ChangesInOne> ChangesInOne::create(std::vector<SceneChange> changes, bool float32) {
  if (float32) {
    if (Status exact = check_float32(changes); !exact) return exact.error();
  }
  ChangesInOne made;
  made.float32_ = float32;
  made.float_positions_.resize(float32 ? changes.size() : 0);
  for (std::size_t i = 0; i < made.float_positions_.size(); ++i) {
    if (const std::vector<double>* const positions = positions_in(changes[i]))
      made.float_positions_[i].assign(positions->begin(), positions->end());
  }
  made.changes_ = std::move(changes);
  return made;
}

SceneEdit ChangesInOne::take(std::size_t i) {
  const auto positions = [&]() -> Positions {
    if (float32_) return std::span<const float>(float_positions_[i]);
    return std::span<const double>(*positions_in(changes_[i]));
  };
  return std::visit(
      [&](auto& change) -> SceneEdit {
        using Kind = std::decay_t<decltype(change)>;
        if constexpr (std::is_same_v<Kind, AddBody>) {
          return PutBody{std::nullopt, std::move(change.addition), positions()};
        } else if constexpr (std::is_same_v<Kind, ReplaceBody>) {
          return PutBody{change.index, std::move(change.addition), positions()};
        } else {
          return std::move(change);
        }
      },
      changes_[i]);
}

}  // namespace warmfront::client
