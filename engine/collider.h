// SPDX-License-Identifier: Apache-2.0
// The one door to the engine: a scene, kept warm, stepped from frame to frame.
// A Collider is used by one thread at a time; different colliders are independent and may share Workers.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/frame.h"
#include "engine/options.h"
#include "engine/question.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "engine/step_result.h"
#include "engine/workers.h"

namespace warmfront {

/// Incremental continuous collision detection (Tang, Manocha, Tong 2009): each step tests the linear motion
/// from the positions last given to the new ones. A step's contacts are the same bits for any number of
/// threads, any front mode and either kind of bounds, whether the collider is warm or was just created from
/// the positions before.
class Collider {
 public:
  /// Builds the hierarchy over `positions` (frame 0). Fails with kInvalidArgument for a wrong length or a
  /// coordinate that is not finite (the message names the vertex and the axis), options out of range, or a
  /// tier this build lacks; with kResourceExhausted for a vertex of too many faces (the message names it);
  /// with kCancelled when `cancelled` became true on the way, as step().
  static Result<Collider> create(std::shared_ptr<const Scene> scene, const Positions& positions,
                                 const ColliderOptions& options, std::shared_ptr<Workers> workers,
                                 const std::atomic<bool>* cancelled = nullptr);
  ~Collider();
  Collider(Collider&&) noexcept;
  Collider& operator=(Collider&&) noexcept;

  /// Tests the motion from where everything is to where `frame` puts it, and makes that current. On an error
  /// the collider is as it was before the call, but for its warmth, and may be stepped again:
  /// kInvalidArgument as in create(), or when the frame does not fit the scene (the message names the field
  /// and the first offender), kResourceExhausted above max_contacts, kCancelled when `cancelled` became true
  /// on the way (looked at between grains of work; any thread may set it), and what `accept` refused it with.
  /// The same holds for an exception (std::bad_alloc).
  ///
  /// `options`: of this step alone; kInvalidArgument where they are out of range, as in create().
  Result<StepResult> step(const Frame& frame, const std::atomic<bool>* cancelled = nullptr,
                          const AcceptStep& accept = {}, const QuestionOptions& options = {});

  /// Answers as step() does and leaves all positions unchanged: what would this motion meet? Further trials
  /// from the same positions take less time than the first. Trials change no later answer. Fails as step()
  /// does; like a failed step, a failed trial leaves the front cold. A trial can be committed until the next
  /// step, trial, change of the scene or place(), whether or not that succeeds.
  Result<StepResult> trial(const Frame& frame, const QuestionOptions& options = {},
                           const std::atomic<bool>* cancelled = nullptr, const AcceptStep& accept = {});
  /// The largest fraction of the motion to `frame` before which nothing touches or comes within the
  /// separation: a trial() with Report::kEarliest, which can be committed. With
  /// QuestionOptions::keep_distance, before which no pair comes nearer than that share of its own distance.
  ///
  /// Except in tier fast there is room for what commit() rounds, which is less than r, 2^-44 (float32: 2^-22)
  /// of the largest coordinate, at either end, of those of a pair's vertices that move, and 2^-44 of the
  /// pair's size and separation at least; of bodies that go by poses more (CommitRoom). With m the separation
  /// and the thickness of both, a pair is in contact when it comes within m + 4 r, or where it starts within
  /// that, within m + 2 r. So a commit of as much or less takes nothing through anything, and leaves nothing
  /// within m.
  ///
  /// What starts nearer still is counted. It may move apart, or along; where it comes nearer at any time, be
  /// it by r from beyond m + r, the fraction is 0. Only the roundings of motions along may bring it within m.
  /// What starts within r may do what no rounding makes a passage; else the fraction is 0 though it moves
  /// apart: what touches a face or an edge exactly is on neither side of it, and held; what touches a
  /// half-space, or is in it, may leave it or go along. With `leave_out_overlaps`, what starts so near is
  /// asked about without its separation, and what touches at the start is not asked about: that may be taken
  /// through, as by its roundings what starts within r.
  Result<MaxStep> max_step(const Frame& frame, bool leave_out_overlaps = false,
                           const QuestionOptions& options = {}, const std::atomic<bool>* cancelled = nullptr,
                           Rounding rounding = Rounding::kFloat64);
  /// All vertex-face and edge-edge pairs without a common vertex that are within `distance` (scene units,
  /// finite, >= 0), and the thickness of both, of each other where everything is, or at the end of the last
  /// trial: rows as step()'s, with toi 0 or 1, of Report::kAll or kCount (kVertexDistances: see
  /// vertex_distances()). Tier exact decides the distance exactly; certified (which tier
  /// fast is here) misses none and may hold pairs up to 2^-19 of the pair's size beyond it. A second question
  /// for the same pairs costs nothing while nothing moves. Leaves all positions and the last trial as
  /// they are, whether or not it succeeds. kFailedPrecondition for a trial's end without a trial; else fails
  /// as trial() does.
  Result<StepResult> proximity(double distance, Where where = Where::kBase,
                               const QuestionOptions& options = {},
                               const std::atomic<bool>* cancelled = nullptr, const AcceptStep& accept = {});
  /// How far each vertex is from anything beyond their thickness, at most `distance`: a proximity() question
  /// whose answer is StepResult::vertex_distances, and no row of it is kept, so that it takes O(n) memory
  /// however many pairs are near. The distances are proved in both tiers, lower bounds: within 2^-19 of a
  /// pair's size of its own distance, and far nearer unless the pair is degenerate. A vertex that is
  /// displaced by less than half of its bound, as all others are, meets nothing: what methods that bound
  /// displacements ask for (Chen et al. 2025, "Offset Geometric Contact"). Fails as proximity().
  Result<StepResult> vertex_distances(double distance, Where where = Where::kBase,
                                      const QuestionOptions& options = {},
                                      const std::atomic<bool>* cancelled = nullptr,
                                      const AcceptStep& accept = {});
  /// All edges and faces without a common vertex that meet where everything is, or at the end of the last
  /// trial, by exact arithmetic on the given doubles, coplanar and degenerate ones included: rows of kind
  /// edge-face, sorted by (edge, face), StepResult::ef their number. Report::kAll, kCount, or kAny (stop at
  /// the first). Neighbours that fold onto each other along a common edge have no such pair. Changes nothing
  /// and fails as proximity().
  Result<StepResult> intersections(Where where = Where::kBase, const QuestionOptions& options = {},
                                   const std::atomic<bool>* cancelled = nullptr,
                                   const AcceptStep& accept = {});
  /// step(), trial(), max_step(), proximity() or intersections(), whichever the question is, which all answer
  /// as trial() does here. kInvalidArgument for a frame that is not empty where the question has no motion.
  Result<StepResult> ask(const Frame& frame, const Question& question,
                         const std::atomic<bool>* cancelled = nullptr, const AcceptStep& accept = {});
  /// Takes the last trial, or max_step(), up to `fraction` in [0, 1]: each vertex that it moves is then at
  /// part_way(X, Y, fraction) of where it was, X, and would have gone, Y; a pose likewise, or by screw_way().
  /// Nothing is sent or tested again: what is nearer to each other then than part_way() rounds may be taken
  /// through, for which a trial() leaves no room, and max_step() does. kFailedPrecondition unless a
  /// trial was answered since the last step, commit or change of the scene; kInvalidArgument for a fraction
  /// outside [0, 1] (or NaN). Nothing has changed after an error.
  Result<CommitResult> commit(double fraction = 1, Rounding rounding = Rounding::kFloat64);

  /// Puts everything where the frame says, or what it gives where it says, without a motion: nothing is
  /// tested between before and after, and the next step, trial or question is about the new state. For resets
  /// and teleports. Frames as of step(), where poses may also be part of the way from one to another, as a
  /// commit leaves them; and its errors and exceptions, after which nothing has changed.
  /// Bodies keep their hierarchies; what the front has of bodies that moved is built again, by the next
  /// question that needs it.
  Status place(const Frame& frame, const std::atomic<bool>* cancelled = nullptr,
               const AcceptStep& accept = {});

  /// Puts rigid bodies at poses of their reference shapes, stationary, before the first step: a scene as it
  /// was left, also by a commit of part of a trial. kInvalidArgument and kCancelled as in step(),
  /// kFailedPrecondition after the first step; nothing has changed then.
  Status place(std::span<const BodyPose> poses, const std::atomic<bool>* cancelled = nullptr);

  /// Appends a body to the scene, at rest at `positions`, (k, 3), from the next step on. Its index is the
  /// number of bodies before, its vertices and faces come after all others; what was there stays warm. Fails
  /// as Scene::with_body() and create() do. Whether it fails so or by an exception, the collider is as it
  /// was.
  Result<std::uint32_t> add_body(BodyAddition addition, const Positions& positions,
                                 const std::atomic<bool>* cancelled = nullptr);
  /// Changes a body's description from the next step on: kind, self-collision, group, mask, thickness, name;
  /// its range stays. Another thickness makes the next step a cold one. kRemoved removes it, and only
  /// replace_body() brings another one back. The
  /// current positions of a body that becomes rigid are its reference shape. Other bodies stay warm; an equal
  /// description changes nothing. kInvalidArgument for an unknown or removed body, and as Scene::create();
  /// kResourceExhausted and kCancelled as create(). Whether it fails so or by an exception, the collider is
  /// as it was. O(bodies), and as much more as the body itself takes.
  Status change_body(std::uint32_t index, Body body, const std::atomic<bool>* cancelled = nullptr);

  /// Other filters from the next question on, in place of all that there are; of all vertices that there are
  /// now. Equal ones change nothing. kInvalidArgument as Scene::create(), kResourceExhausted and kCancelled
  /// as create(); an error or an exception leaves the collider as it was. O(scene).
  Status change_filters(PairFilters filters, const std::atomic<bool>* cancelled = nullptr);

  /// Other pairs of bodies that are not tested against each other, from the next step on, in place of all
  /// that there are. Equal ones change nothing; what was known of bodies and of pairs that stay holds.
  /// kInvalidArgument as Scene::create(); an error or an exception leaves the collider as it was. O(bodies).
  Status change_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs,
                               const std::atomic<bool>* cancelled = nullptr);
  /// Other options from the next question on. Those that say what is kept between steps (front, lazy_front,
  /// find_rigid, separate_parts, rebuild_..., max_front_bytes) make the next step a cold one; all others cost
  /// nothing by themselves. kInvalidArgument as create(), and where `bounds`, `find_bodies`, `leaf_size`,
  /// `normal_cones` or `explain`, which are fixed, differ. An error or an exception leaves the collider as it
  /// was, but for its warmth.
  Status change_options(const ColliderOptions& options);

  /// Other faces and edges for the vertices of a body, which stay where they are, from the next step on;
  /// index 0 of a scene without declared bodies is all of it. Numbers are then as ReplaceElements and
  /// ReplaceBody say: those of a collider created from the bodies that there are. Contacts are those of such
  /// a collider, bit for bit. Other bodies stay warm: only the body's hierarchy and its pairs with others are
  /// built again, beside O(scene) of copying. Without declared bodies everything is built again. Fails as
  /// add_body() does; an error or an exception leaves the collider as it was.
  Status replace_elements(std::uint32_t index, std::vector<std::array<std::int32_t, 3>> faces,
                          std::vector<std::array<std::int32_t, 2>> edges = {},
                          const std::atomic<bool>* cancelled = nullptr);
  /// Another body with this index, at rest at `positions`, (k, 3): remeshed, refined, or in place of one that
  /// was removed. Of kind kRemoved, without vertices, it frees what the body took. As replace_elements();
  /// fails as Scene::with_changes() does, too.
  Status replace_body(std::uint32_t index, BodyAddition addition, const Positions& positions,
                      const std::atomic<bool>* cancelled = nullptr);

  /// Carries out changes as the functions above do, one after the other, all of
  /// them or none: as one, so that O(scene) is paid once however many bodies are added or replaced. Looks at
  /// `cancelled` between the changes and within each. With an error, `failed`, unless it is null, is the
  /// change that it is of. `options`: with change_options(), in the same transaction; an error of these is of
  /// change number changes.size().
  Status change(std::vector<SceneChange> changes, const std::atomic<bool>* cancelled = nullptr,
                std::size_t* failed = nullptr, const std::optional<ColliderOptions>& options = std::nullopt);

  /// Checks what is kept between steps: kDataLoss or kInternal as self_check() in self_check.h says,
  /// kCancelled as create().
  Status self_check(const std::atomic<bool>* cancelled = nullptr);
  /// Makes the next step a cold one: what is kept for speed is rebuilt from the scene and its positions.
  void forget_warmth();

  /// The scene as it is, with the bodies added and changed since.
  const Scene& scene() const;
  /// The same, to be kept: it stays as it is when the collider's is changed. Never null.
  std::shared_ptr<const Scene> shared_scene() const;
  const ColliderOptions& options() const;
  /// The current positions, at which trials begin, row-major (n, 3); of removed bodies the last.
  std::vector<double> positions() const;
  /// Where each rigid body is, half-spaces that move among them, in order: its pose, to the bit. It is of the
  /// body's reference shape: where the body was when it last moved by positions, or as it was described; the
  /// identity, if it has not moved by poses since. positions() has its vertices at Pose::place() of these.
  /// Trials begin there.
  std::vector<BodyPose> poses() const;
  /// Bytes held by this collider, the scene and the front included.
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  explicit Collider(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront
