// SPDX-License-Identifier: Apache-2.0
// From the engine's rows to columns. Thread-safe.
#include "server/session/answer.h"

namespace warmfront::server {

Answer make_answer(std::uint64_t frame, const Scene& scene, const StepResult& result,
                   const ContactFields& fields) {
  Answer answer;
  answer.frame = frame;
  answer.vf = result.vf;
  answer.ee = result.ee;
  answer.possible = result.possible;
  answer.earliest_toi = result.earliest_toi;
  answer.statistics = result.statistics;
  const std::size_t rows = result.contacts.size();
  answer.kind.reserve(rows);
  answer.status.reserve(rows);
  answer.vertices.reserve(rows);
  answer.toi.reserve(rows);
  for (const Contact& contact : result.contacts) {
    answer.kind.push_back(static_cast<std::uint8_t>(contact.kind));
    answer.status.push_back(static_cast<std::uint8_t>(contact.status));
    answer.vertices.push_back(scene.vertices_of(contact));
    answer.toi.push_back(contact.toi);
  }
  for (const ContactGeometry& geometry : result.geometry) {
    if (fields.weights) answer.weights.push_back(geometry.weights);
    if (fields.normal) answer.normal.push_back(geometry.normal);
    if (fields.points) answer.points.push_back(geometry.points);
  }
  return answer;
}

std::size_t contact_bytes(const StepResult& result, const ContactFields& fields) {
  return result.contacts.size() * (Answer::kBytesPerRow + (fields.weights ? 32 : 0) +
                                   (fields.normal ? 24 : 0) + (fields.points ? 48 : 0));
}

}  // namespace warmfront::server
