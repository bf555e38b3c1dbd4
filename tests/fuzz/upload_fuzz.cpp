// SPDX-License-Identifier: Apache-2.0
// Any sequence of CreateSession messages: refused with a reason, or put together into a scene of which
// everything announced is there; and the engine then takes that scene or says why not. One thread.
#include "engine/collider.h"
#include "server/transport/upload.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace warmfront;
using fuzz::expect;

bool is_refusal(ErrorCode code) {
  return code == ErrorCode::kInvalidArgument || code == ErrorCode::kResourceExhausted ||
         code == ErrorCode::kUnimplemented;
}

server::Limits small_limits() {
  server::Limits limits;
  limits.max_vertices = 300;
  limits.max_triangles = 300;
  limits.max_contacts = 1000;
  limits.max_front_bytes = 1 << 16;
  return limits;
}

/// Repeatedly: two bytes of length, then so many bytes of a message.
bool upload_all(fuzz::Bytes& input, server::Upload& upload) {
  while (!input.empty()) {
    const std::size_t length = input.next() + std::size_t{256} * (input.next() % 16);
    const std::string_view bytes = input.take(length);
    v1::CreateSessionRequest request;
    if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return false;
    if (const auto fault = upload.add(request)) {
      expect(is_refusal(fault->code) && !fault->message.empty(), "a refused upload has a reason");
      return false;
    }
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const server::Limits limits = small_limits();
  static const auto workers = std::make_shared<Workers>(1);
  fuzz::Bytes input(data, size);
  server::Upload upload(limits);
  if (!upload_all(input, upload)) return 0;
  if (const auto fault = upload.complete()) {
    expect(is_refusal(fault->code) && !fault->message.empty(), "an upload cut short has a reason");
    return 0;
  }
  server::SessionSpec spec = upload.take_spec();
  const server::PositionBuffer positions = upload.take_positions();
  expect(spec.scene.vertex_count <= limits.max_vertices &&
             spec.scene.faces.size() + spec.scene.edges.size() <= limits.max_triangles,
         "a scene within the limits");
  expect(spec.options.max_contacts <= limits.max_contacts, "capacities are the daemon's at most");
  expect(positions.complete().ok(), "a complete upload has complete positions");
  const PairFilters& filters = spec.scene.filters;
  expect(filters.patches.empty() || filters.patches.size() == spec.scene.vertex_count,
         "a patch a vertex or none");
  expect(filters.near_at_rest > 0 ? filters.rest_positions.size() == std::size_t{3} * spec.scene.vertex_count
                                  : filters.rest_positions.empty(),
         "a rest shape where there is need of one");
  Result<Scene> scene = Scene::create(std::move(spec.scene));
  if (!scene) {
    expect(is_refusal(scene.error().code), "a refused scene has a reason");
    return 0;
  }
  auto collider = Collider::create(std::make_shared<const Scene>(std::move(scene).value()), positions.view(),
                                   spec.options, workers);
  if (!collider) {
    expect(is_refusal(collider.error().code), "refused positions have a reason");
    return 0;
  }
  const auto still = collider.value().step(positions.view());
  expect(still.ok() || is_refusal(still.error().code), "a step is answered or refused");
  return 0;
}
