// SPDX-License-Identifier: Apache-2.0
// One self-contained page that shows the moving meshes, what was found in each frame (contacts by their time
// of impact, pairs by their distance), and the timeline. Styles and scripts are the files in html/. Used by
// one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/mesh.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "engine/screw.h"

namespace warmfront::client {

/// What was asked. The number of a row's kind is in the order of the kinds named here; its vertices are as
/// ContactRecord or, where said, others have them.
enum class PageOf : std::uint8_t {
  /// From frame to frame: vertex-face, edge-edge, vertex-half-space, vertex-edge and vertex-vertex contacts;
  /// by their time of impact.
  kSteps,
  kNear,          ///< of each frame: the same kinds of pairs, by the share of what counts as near
  kClosestPairs,  ///< the same of closest pairs: by ClosestFeatures, then half-spaces'; as Stencil has them
  kTangled,       ///< of each frame: an edge and a face, by five vertices
};

/// Of kSteps and kNear, the number of a kind on the page; edge-face is no such kind.
constexpr std::uint8_t page_kind(ContactKind kind) {
  constexpr std::array<std::uint8_t, kContactKinds> kNumbers{0, 1, 0, 3, 4, 2};
  return kNumbers.at(static_cast<std::size_t>(kind));
}

/// What the page carries, each in a <script> of its own: `scene`, JSON; and in base64, little-endian: `faces`
/// (m, 3) and `lone-edges` (k, 2) uint32; `positions` (frames, n, 3) uint16, in quanta from the origin;
/// `contact-v` (k, 4), or (k, 5) of kTangled, uint32; `contact-kind` (k) uint8; and (k) float32: of steps
/// `contact-toi`, of kNear and kClosestPairs `contact-share`. Of steps with bodies along screws, `twists`
/// (steps, bodies, 9) float64. A step is from one frame to the next; else a frame is a step of its own. Where
/// the topology changes, `parts` in `scene` says what each part has, and from which step on; faces, edges and
/// positions are those of the parts in turn, and a part's first frame stands for the same moment as the last
/// one before it.
class HtmlPage {
 public:
  /// A page for `frames` frames of the scene, the first one included. kResourceExhausted, naming sizes and
  /// options, when its positions alone would take more than `limit` bytes.
  static Result<HtmlPage> start(PageOf asked, std::string name, const SceneDescription& scene,
                                std::uint64_t frames, std::uint64_t limit);

  PageOf asked() const { return asked_; }

  /// Of kSteps, behind a step: what follows is of another scene, and starts with a frame of that. Fails as
  /// start().
  Status begin_part(const SceneDescription& scene, std::uint64_t frames);

  /// The positions of each frame in turn.
  void add_frame(const Positions& positions);
  /// Of kSteps: the twist of each body that moves along a screw in the step at hand.
  void add_twists(std::span<const Twist> twists);
  /// A row of the step at hand, by 4 or 5 vertices; `value` is what colours it.
  void add_row(std::span<const std::uint32_t> vertices, std::uint8_t kind, double value);
  /// Ends a step's rows. kResourceExhausted when the page would be larger than its limit.
  Status end_step();

  /// Positions are rounded to 65,536 steps of the whole motion's extent along each axis; the page states the
  /// largest error, at most half of such a step. `told`: further fields of `scene`, for html/asked.js: how it
  /// was asked, and columns with a value a step, of which there must be `steps` (frame numbers), `ms` and
  /// the counts of each kind.
  Status write(const std::string& path, const nlohmann::ordered_json& told) const;

 private:
  HtmlPage() = default;
  std::uint64_t size() const;
  /// The name of the blob of values; empty where there are none.
  std::string_view values_name() const;

  PageOf asked_ = PageOf::kSteps;
  struct Part {
    SceneDescription scene;
    std::uint64_t frames = 0;
    std::uint64_t first_step = 0;  ///< steps before it
  };

  std::string name_;
  std::vector<Part> parts_;
  std::uint64_t limit_ = 0;
  std::vector<PositionBuffer> positions_;  // by frame
  std::vector<double> twists_;             // angular, centre and linear of each body's, by step
  std::vector<std::uint32_t> row_vertices_;
  std::vector<std::uint8_t> row_kinds_;
  std::vector<float> row_values_;        // empty where there are none
  std::vector<std::uint64_t> row_ends_;  // of each step
};

/// The page before and after its data (html/page.html with style and scripts in it).
extern const std::string_view kHtmlHead;
extern const std::string_view kHtmlTail;

}  // namespace warmfront::client
