// SPDX-License-Identifier: Apache-2.0
// Any bytes as a ChangeScene request: refused with a reason, or changes that are each made or refused by the
// engine, and with them the scene steps on. One thread.
#include "server/transport/convert.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/session_model.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace warmfront;
  using fuzz::expect;
  static const auto workers = std::make_shared<Workers>(1);
  static const auto scene = std::make_shared<const Scene>(Scene::create(fuzz::tiny_scene()).value());
  v1::ChangeSceneRequest request;
  if (!request.ParseFromArray(data, static_cast<int>(size))) return 0;
  auto order = server::change_order_from(request, server::Dtype::kFloat64, {}, nullptr);
  if (!order) {
    expect(order.fault().code == ErrorCode::kInvalidArgument && !order.fault().message.empty(),
           "refused changes have a reason");
    return 0;
  }
  const std::vector<double> start = fuzz::tiny_positions(0);
  Collider collider = Collider::create(scene, std::span<const double>(start), {}, workers).value();
  for (server::SceneChange& change : order.value().changes) {
    const std::uint32_t bodies = collider.scene().body_count();
    const auto carry_out = [&]() -> Status {
      if (auto* add = std::get_if<server::AddBody>(&change)) {
        const auto index =
            collider.add_body(std::move(add->addition), std::span<const double>(add->positions));
        return index ? Status{} : Status{index.error()};
      }
      if (auto* other = std::get_if<server::ChangeFilters>(&change))
        return collider.change_filters(std::move(other->filters));
      if (auto* elements = std::get_if<server::ReplaceElements>(&change))
        return collider.replace_elements(elements->index, std::move(elements->faces),
                                         std::move(elements->edges));
      if (auto* body = std::get_if<server::ReplaceBody>(&change))
        return collider.replace_body(body->index, std::move(body->addition),
                                     std::span<const double>(body->positions));
      if (auto* pairs = std::get_if<server::ChangeExcludedPairs>(&change))
        return collider.change_excluded_pairs(std::move(pairs->pairs));
      auto& changed = std::get<server::ChangeBody>(change);
      return collider.change_body(changed.index, std::move(changed.body));
    };
    const bool adds = std::holds_alternative<server::AddBody>(change);
    const Status status = carry_out();
    expect(status.ok() || !status.error().message.empty(), "a refused change has words");
    expect(collider.scene().body_count() == bodies + (adds && status.ok() ? 1 : 0),
           "and leaves the scene as it was");
  }
  if (order.value().options) {
    const ColliderOptions before = collider.options();
    const Status status = collider.change_options(*order.value().options);
    expect(status.ok() || !status.error().message.empty(), "refused options have words");
    expect(collider.options() == (status.ok() ? *order.value().options : before),
           "and leave those that there are");
  }
  expect(collider.self_check().ok(), "and all that is kept of it holds");
  const std::vector<double> now = collider.positions();
  const auto still = collider.step(std::span<const double>(now));
  expect(still.ok() || still.error().code == ErrorCode::kInvalidArgument, "the scene steps on");
  return 0;
}
