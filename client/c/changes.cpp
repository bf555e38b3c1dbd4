// SPDX-License-Identifier: Apache-2.0
// Changes of a session's scene and options, and how much there is then. Thread safety as stated in the
// interface's header.
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/c/arrays.h"
#include "client/c/errors.h"
#include "client/c/reading.h"
#include "client/c/session.h"
#include "client/c/structs.h"

using namespace warmfront;
using namespace warmfront::c;

namespace {

constexpr const char* kVertexCount = "vertex_count";

/// An array of a change, and the field that counts its rows.
struct ArrayField {
  const char* name;
  const void* array;
  const char* counted_by;
  std::size_t count;
  bool used;  ///< by a change of this kind
};

bool is_given(const ArrayField& field) {
  return field.array != nullptr || (field.counted_by != kVertexCount && field.count > 0);
}

std::array<ArrayField, 8> arrays_of(const wf_change& change) {
  const bool puts = change.what == WF_ADD_BODY || change.what == WF_REPLACE_BODY;
  const bool meshes = puts || change.what == WF_REPLACE_ELEMENTS;
  const bool filters = change.what == WF_CHANGE_FILTERS;
  return {{
      {"positions", change.positions, kVertexCount, change.vertex_count, puts},
      {"thickness", change.thickness, kVertexCount, change.vertex_count, puts},
      {"faces", change.faces, "face_count", change.face_count, meshes},
      {"edges", change.edges, "edge_count", change.edge_count, meshes},
      {"rest_positions", change.rest_positions, kVertexCount, change.vertex_count, filters},
      {"excluded_vertex_pairs", change.excluded_vertex_pairs, "excluded_vertex_pair_count",
       change.excluded_vertex_pair_count, filters},
      {"patches", change.patches, kVertexCount, change.vertex_count, filters},
      {"excluded_pairs", change.excluded_pairs, "excluded_pair_count", change.excluded_pair_count,
       change.what == WF_CHANGE_EXCLUDED_PAIRS},
  }};
}

/// A field that is given and that a change of this kind has no use for; null: none.
const char* useless_field(const wf_change& change) {
  const auto is = [&](auto... kinds) { return ((change.what == kinds) || ...); };
  const struct {
    const char* name;
    bool given;
    bool used;
  } values[] = {
      {"index", change.index != 0, is(WF_CHANGE_BODY, WF_REPLACE_BODY, WF_REPLACE_ELEMENTS)},
      {"body", change.body != nullptr, is(WF_ADD_BODY, WF_REPLACE_BODY, WF_CHANGE_BODY)},
      {kVertexCount, change.vertex_count != 0, is(WF_ADD_BODY, WF_REPLACE_BODY, WF_CHANGE_FILTERS)},
      {"within_edges", change.within_edges != 0, is(WF_CHANGE_FILTERS)},
      {"near_at_rest", change.near_at_rest != 0, is(WF_CHANGE_FILTERS)},
  };
  for (const auto& field : values)
    if (field.given && !field.used) return field.name;
  for (const ArrayField& field : arrays_of(change))
    if (is_given(field) && !field.used) return field.name;
  return nullptr;
}

/// An array of which the change says that it is empty; none: there is none. Who wants none gives none, so
/// that a count that was forgotten does not empty anything.
std::optional<ArrayField> forgotten_count(const wf_change& change) {
  for (const ArrayField& field : arrays_of(change))
    if (field.array != nullptr && field.count == 0) return field;
  return std::nullopt;
}

/// As the interface's header names it.
const char* name_of(std::int32_t what) {
  static constexpr const char* kNames[] = {"WF_ADD_BODY",       "WF_CHANGE_BODY",
                                           "WF_REPLACE_BODY",   "WF_REPLACE_ELEMENTS",
                                           "WF_CHANGE_FILTERS", "WF_CHANGE_EXCLUDED_PAIRS"};
  return kNames[what];
}

/// What earlier changes of the list, or else the scene, say that a body is; one by default where there is
/// none, which the engine refuses.
Body described(const Scene& scene, std::span<const SceneChange> earlier, std::uint32_t index) {
  std::size_t next = scene.bodies().size();
  Body body = index < next ? scene.bodies()[index] : Body{};
  for (const SceneChange& change : earlier) {
    if (const auto* add = std::get_if<AddBody>(&change)) {
      if (next++ == index) body = add->addition.body;
    } else if (const auto* other = std::get_if<ChangeBody>(&change)) {
      if (other->index == index) body = other->body;
    } else if (const auto* replaced = std::get_if<ReplaceBody>(&change)) {
      if (replaced->index == index) body = replaced->addition.body;
    }
  }
  return body;
}

/// The description of a body that is added or put in the place of another one.
Result<Body> put_body(const wf_change& from, const std::string& where, const Scene& scene,
                      std::span<const SceneChange> earlier) {
  Body body;
  if (from.body != nullptr) {
    std::size_t size = 0;
    Result<Body> given = body_of(from.body, where + "body", size);
    if (!given) return given;
    body = std::move(given).value();
    if (body.vertex_count != 0 && body.vertex_count != from.vertex_count)
      return invalid_argument(where + "body.vertex_count: is " + std::to_string(body.vertex_count) +
                              ", and the change's vertex_count is " + std::to_string(from.vertex_count) +
                              "; give the same, or leave the body's 0");
  } else if (from.what == WF_REPLACE_BODY) {
    body = described(scene, earlier, from.index);
    if (body.kind == BodyKind::kRemoved && from.vertex_count > 0)
      return invalid_argument(where + "body: is null, and body " + std::to_string(from.index) +
                              " was removed; describe the one that takes its place");
  }
  body.vertex_count = from.vertex_count;
  return body;
}

template <class Change>
Status take_mesh(const wf_change& from, const std::string& where, Change& into) {
  if (Status taken = copy_rows(from.faces, from.face_count, where + "faces", into.faces); !taken)
    return taken;
  return copy_rows(from.edges, from.edge_count, where + "edges", into.edges);
}

Result<SceneChange> put_change(const wf_change& from, const std::string& where, const wf_session& session,
                               std::span<const SceneChange> earlier) {
  BodyAddition addition;
  Result<Body> body = put_body(from, where, session.local->collider().scene(), earlier);
  if (!body) return body.error();
  addition.body = std::move(body).value();
  if (Status taken = take_mesh(from, where, addition); !taken) return taken.error();
  copy_optional(from.thickness, from.vertex_count, addition.thickness);
  const Result<Positions> given =
      positions(from.positions, std::size_t{3} * from.vertex_count, session.float32, where + "positions");
  if (!given) return given.error();
  std::vector<double> at =
      std::visit([](auto rows) { return std::vector<double>(rows.begin(), rows.end()); }, given.value());
  if (from.what == WF_ADD_BODY) return SceneChange(AddBody{std::move(addition), std::move(at)});
  return SceneChange(ReplaceBody{from.index, std::move(addition), std::move(at)});
}

/// `where`: "changes[i].".
Result<SceneChange> change_of(const wf_change& from, const std::string& where, const wf_session& session,
                              std::span<const SceneChange> earlier) {
  if (from.what < WF_ADD_BODY || from.what > WF_CHANGE_EXCLUDED_PAIRS)
    return out_of(where + "what", from.what, WF_CHANGE_EXCLUDED_PAIRS);
  if (const char* field = useless_field(from))
    return invalid_argument(where + field + ": a " + name_of(from.what) +
                            " has no use for it; leave it as wf_change_init() does, or correct `what`");
  if (const auto forgotten = forgotten_count(from))
    return invalid_argument(where + forgotten->name + ": is given, and " + forgotten->counted_by +
                            " is 0; say how many there are, or give NULL for none");
  switch (from.what) {
    case WF_CHANGE_BODY: {
      if (from.body == nullptr)
        return invalid_argument(where + "body: is null; give what the body is from now on");
      std::size_t size = 0;
      Result<Body> body = body_of(from.body, where + "body", size);
      if (!body) return body.error();
      return SceneChange(ChangeBody{from.index, std::move(body).value()});
    }
    case WF_REPLACE_ELEMENTS: {
      ReplaceElements change{from.index, {}};
      if (Status taken = take_mesh(from, where, change); !taken) return taken.error();
      return SceneChange(std::move(change));
    }
    case WF_CHANGE_FILTERS: {
      Result<PairFilters> filters = filters_of(from, where);
      if (!filters) return filters.error();
      return SceneChange(ChangeFilters{std::move(filters).value()});
    }
    case WF_CHANGE_EXCLUDED_PAIRS: {
      ChangeExcludedPairs change;
      if (Status taken = copy_rows(from.excluded_pairs, from.excluded_pair_count, where + "excluded_pairs",
                                   change.pairs);
          !taken)
        return taken.error();
      return SceneChange(std::move(change));
    }
    default:
      return put_change(from, where, session, earlier);
  }
}

Result<std::vector<SceneChange>> changes_of(const wf_session& session, const wf_change* first,
                                            std::size_t count) {
  if (first == nullptr && count > 0) return invalid_argument("changes: is null; give an array of wf_change");
  std::vector<SceneChange> changes;
  const auto* at = reinterpret_cast<const char*>(first);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string where = "changes[" + std::to_string(i) + "]";
    // The caller's array has structs of the caller's size.
    const Result<wf_change> given = read(reinterpret_cast<const wf_change*>(at), wf_change{}, "change");
    if (!given) return Error{given.error().code, where + ": " + given.error().message};
    at += given.value().size;
    Result<SceneChange> change = change_of(given.value(), where + ".", session, changes);
    if (!change) return change.error();
    changes.push_back(std::move(change).value());
  }
  return changes;
}

/// Null: none.
Result<std::optional<ColliderOptions>> other_options(const wf_session& session, const wf_options* given) {
  if (given == nullptr) return std::optional<ColliderOptions>();
  const Result<wf_options> from = read(given, initial_options(), "options");
  if (!from) return from.error();
  const std::uint32_t threads = from.value().threads;
  if (threads != 0 && threads != session.threads)
    return invalid_argument("options.threads: is " + std::to_string(threads) + ", and the session has " +
                            std::to_string(session.threads) +
                            " (0: one for each core) for good; give the same, or leave it 0");
  const Result<ColliderOptions> options = options_of(from.value());
  if (!options) return options.error();
  if (const Status valid = validate(options.value()); !valid)
    return invalid_argument("options." + valid.error().message);
  return std::optional(options.value());
}

}  // namespace

wf_code wf_change_scene(wf_session* session, const wf_change* changes, size_t change_count,
                        const wf_options* options, const wf_flag* cancelled) {
  return guarded([&]() -> wf_code {
    if (session == nullptr) return fail(WF_INVALID_ARGUMENT, "session: is null");
    Result<std::vector<SceneChange>> list = changes_of(*session, changes, change_count);
    if (!list) return fail(list.error());
    const Result<std::optional<ColliderOptions>> others = other_options(*session, options);
    if (!others) return fail(others.error());
    std::size_t failed = 0;
    const Status status = session->local->collider().change(
        std::move(list).value(), cancelled == nullptr ? nullptr : &cancelled->value, &failed, others.value());
    if (status) return WF_OK;
    if (status.error().code == ErrorCode::kCancelled) return fail(status.error());
    const std::string where =
        failed < change_count ? "changes[" + std::to_string(failed) + "]: " : "options.";
    return fail({status.error().code, where + status.error().message});
  });
}

wf_code wf_count(const wf_session* session, wf_counts* counts, size_t counts_size) {
  if (session == nullptr || counts == nullptr) return fail(WF_INVALID_ARGUMENT, "session or counts: is null");
  const Scene& scene = session->local->collider().scene();
  const wf_counts now{.frame = session->local->frame(),
                      .vertices = scene.vertex_count(),
                      .faces = scene.face_count(),
                      .edges = scene.edge_count(),
                      .bodies = scene.bodies().size()};
  write(counts, counts_size, now);
  return WF_OK;
}
