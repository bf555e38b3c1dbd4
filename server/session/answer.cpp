// SPDX-License-Identifier: Apache-2.0
// From the engine's rows to columns. Thread-safe.
#include "server/session/answer.h"

#include <algorithm>

namespace warmfront::server {

Answer make_answer(std::uint64_t frame, const Scene& scene, const StepResult& result,
                   const ContactFields& fields) {
  Answer answer;
  answer.frame = frame;
  static_cast<KindCounts&>(answer) = result;
  answer.possible = result.possible;
  answer.earliest_toi = result.earliest_toi;
  answer.overlaps_at_start = result.overlaps_at_start;
  answer.statistics = result.statistics;
  answer.vertex_distances.assign(result.vertex_distances.begin(), result.vertex_distances.end());
  answer.worlds.assign(result.worlds.begin(), result.worlds.end());
  answer.world_tois.assign(result.world_tois.begin(), result.world_tois.end());
  const std::size_t rows = result.contacts.size();
  answer.kind.reserve(rows);
  answer.status.reserve(rows);
  (result.ef > 0 ? answer.edge_faces.reserve(rows) : answer.vertices.reserve(rows));
  answer.toi.reserve(rows);
  for (const Contact& contact : result.contacts) {
    answer.kind.push_back(static_cast<std::uint8_t>(contact.kind));
    answer.status.push_back(static_cast<std::uint8_t>(contact.status));
    if (contact.kind == ContactKind::kEdgeFace)
      answer.edge_faces.push_back(scene.edge_face_vertices_of(contact));
    else
      answer.vertices.push_back(scene.vertices_of(contact));
    answer.toi.push_back(contact.toi);
  }
  if (fields.weights) answer.weights.reserve(rows);
  if (fields.normal) answer.normal.reserve(rows);
  if (fields.points) answer.points.reserve(rows);
  if (fields.direction) answer.direction.reserve(rows);
  if (fields.squared_distance) answer.squared_distance.reserve(rows);
  if (fields.closest) answer.closest.reserve(rows);
  for (const ContactGeometry& geometry : result.geometry) {
    if (fields.weights) answer.weights.push_back(geometry.weights);
    if (fields.normal) answer.normal.push_back(geometry.normal);
    if (fields.points) answer.points.push_back(geometry.points);
    if (fields.direction) answer.direction.push_back(geometry.direction);
    if (fields.squared_distance) answer.squared_distance.push_back(geometry.squared_distance);
    if (fields.closest) answer.closest.push_back(static_cast<std::uint8_t>(geometry.closest));
  }
  answer.multiplicity.reserve(result.closest_pairs.size());
  answer.stencil.reserve(result.closest_pairs.size());
  for (const ClosestPair& pair : result.closest_pairs) {
    answer.multiplicity.push_back(pair.multiplicity);
    answer.stencil.push_back(pair.stencil);
  }
  return answer;
}

namespace {

std::size_t bytes_per_row(const ContactFields& fields) {
  return Answer::kBytesPerRow + (fields.weights ? 32 : 0) + (fields.normal ? 24 : 0) +
         (fields.points ? 48 : 0) + (fields.direction ? 24 : 0) + (fields.squared_distance ? 8 : 0) +
         (fields.closest ? 1 : 0);
}

}  // namespace

std::size_t contact_bytes(const StepResult& result, const ContactFields& fields) {
  return result.contacts.size() * (bytes_per_row(fields) + (result.ef > 0 ? Answer::kMoreOfEdgeFace : 0)) +
         result.closest_pairs.size() * Answer::kMoreOfReduced + result.vertex_distances.size_bytes() +
         result.worlds.size() * Answer::kBytesPerWorld;
}

std::size_t held_per_contact(const ContactFields& fields, bool reduced) {
  // Vectors that grow as contacts are found have room for twice as many at most: those of the threads, and
  // those that they are put together in, of which a collider has one for motions and one for proximity; and
  // so have those of what is told of each. The answer's columns are made in one piece, and encoded in
  // another.
  constexpr std::size_t kGrown = 2;
  const std::size_t found = 3 * sizeof(Contact) + (fields.any() ? 2 * sizeof(ContactGeometry) : 0);
  // What reducing takes: the closest pair of each row, what it shares with others, and its place in a list.
  const std::size_t reducing = reduced ? 3 * sizeof(ClosestPair) : 0;
  return kGrown * (found + reducing) +
         2 * (bytes_per_row(fields) + (reduced ? Answer::kMoreOfReduced : Answer::kMoreOfEdgeFace));
}

std::size_t growing_part(std::size_t max_session_bytes, bool explain) {
  return max_session_bytes / 2 / (explain ? 2 : 1);
}

std::size_t most_contacts(std::size_t max_session_bytes, bool explain, const ContactFields& fields,
                          bool reduced) {
  return std::max<std::size_t>(growing_part(max_session_bytes, explain) / held_per_contact(fields, reduced),
                               1);
}

}  // namespace warmfront::server
