// SPDX-License-Identifier: Apache-2.0
// Writes contacts to a file, frame by frame. A writer is used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "client/io/contact_record.h"
#include "engine/collider.h"
#include "engine/result.h"

namespace warmfront::client {

/// What is written of a contact besides its features, time and status.
struct WrittenFields : ContactFields {
  WrittenFields() = default;
  WrittenFields(const ContactFields& fields) : ContactFields(fields) {}

  bool closest_pair = false;  ///< of rows of a reduced answer
  bool continuity = false;    ///< are they new? Then rows that ended may be written, too
};

class ContactWriter {
 public:
  virtual ~ContactWriter() = default;

  /// Writes a step's contacts. `frame` is the index of the step's end frame; `start` and `end` are the
  /// positions at both ends of the step. `geometry` has an entry per contact if the writer was opened with
  /// any fields, but for ended rows, which come last. A full disk may be reported here or by close().
  virtual Status write(std::uint64_t frame, const Positions& start, const Positions& end,
                       std::span<const ContactRecord> contacts,
                       std::span<const ContactGeometry> geometry) = 0;

  /// Flushes and closes; fails when any written data did not reach the file. Only then has the file, or the
  /// series, its name: without this nothing is left of it, and what was there stays.
  virtual Status close() = 0;
};

/// "vf", "ee", "ve", "vv" and "vh"; "ef" of intersections.
std::string_view short_name(ContactKind kind);
/// "new", "kept", "ended".
std::string_view to_string(RowContinuity continuity);
/// "vv", "ev", "ee" and "fv".
std::string_view short_name(ClosestFeatures closest);
/// "hit", "possible", "overlap_at_start", "budget".
std::string_view to_string(ContactStatus status);

/// Appends `value` with 17 significant digits, which read back as the same double.
void append_round_trip(std::string& out, double value);

/// Whether the name ends in .csv, .jsonl or .vtp, or is "-".
bool is_contact_file_name(std::string_view path);

/// A writer by the extension of `path`, of contacts with the fields asked for:
/// - .csv, or "-" for the same on stdout: `frame,type,v0,v1,v2,v3,toi,status`, a line a contact; then
///   `w0,w1,w2,w3` (weights), `nx,ny,nz` (normal), `ax,ay,az,bx,by,bz` (points), `dx,dy,dz` (direction),
///   `squared_distance`, `closest` (vv, ev, ee or fv), `multiplicity,stencil` (of a reduced answer, see
///   ClosestPair), `continuity` (new, kept or ended; of an ended row the columns from toi to before this one
///   are empty). Of type vh v0, v1 and v2 are the vertex, and v3 is the number of the body that is the
///   half-space;
/// - .jsonl: `{"frame":1,"type":"vf","v0":0,"v1":1,"v2":2,"v3":3,"toi":0.5,"status":"hit"}`, a line a
/// contact; then `"weights":[..]`, `"normal":[..]`, `"points":[[..],[..]]`, `"direction":[..]`,
/// `"squared_distance":0.25`, `"closest":"fv"`, `"multiplicity":1,"stencil":15`,
/// `"continuity":"new"`, before which an ended row has its features alone;
/// - .vtp: NAME_000001.vtp, ... one VTK PolyData file a frame, and NAME.pvd, which lists them: each contact
/// is a point at
///   the mean of its four vertices (of a half-space's row the vertex) at the time of impact, with arrays toi,
///   kind, status, frame and vertices (its four, as v0 to v3), weights, normal, point_a and point_b,
///   direction, squared_distance, closest (numbers of ClosestFeatures), multiplicity and stencil, continuity
///   (numbers of RowContinuity). No ended rows, which are nowhere.
Result<std::unique_ptr<ContactWriter>> open_contact_writer(const std::string& path,
                                                           const WrittenFields& fields = {});

/// The three, each for its own extension.
Result<std::unique_ptr<ContactWriter>> open_csv_contact_writer(const std::string& path,
                                                               const WrittenFields& fields);
Result<std::unique_ptr<ContactWriter>> open_jsonl_contact_writer(const std::string& path,
                                                                 const WrittenFields& fields);
Result<std::unique_ptr<ContactWriter>> open_vtp_contact_writer(const std::string& path,
                                                               const WrittenFields& fields);

}  // namespace warmfront::client
