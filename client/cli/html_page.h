// SPDX-License-Identifier: Apache-2.0
// `detect --html`: one self-contained page that shows the moving meshes, the contacts of each frame by their
// time of impact, and the timeline. Styles and scripts are the files in html/. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/report_json.h"
#include "client/io/contact_record.h"
#include "client/io/mesh.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

/// What the page carries, each in a <script> of its own: `scene`, JSON; and in base64, little-endian: `faces`
/// (m, 3) uint32; `positions` (frames, n, 3) uint16, in quanta from the origin; `contact-v` (k, 4) uint32;
/// `contact-toi` (k) float32; `contact-kind` (k) uint8.
class HtmlPage {
 public:
  /// A page for `frames` frames of the scene, the first one included. kResourceExhausted, naming sizes and
  /// options, when its positions alone would take more than `limit` bytes.
  static Result<HtmlPage> start(std::string name, const SceneDescription& scene, std::uint64_t frames,
                                std::uint64_t limit);

  /// The positions at the beginning, and then those at the end of each step with its contacts.
  void add_frame(const Positions& positions);
  /// kResourceExhausted when the page would be larger than its limit.
  Status add_contacts(std::span<const ContactRecord> contacts);

  /// Positions are rounded to 65,536 steps of the whole motion's extent along each axis; the page states the
  /// largest error, at most half of such a step.
  Status write(const std::string& path, const DetectReport& report) const;

 private:
  HtmlPage() = default;
  std::uint64_t size() const;

  std::string name_;
  SceneDescription scene_;
  std::uint64_t limit_ = 0;
  std::uint64_t frames_ = 0;
  std::vector<PositionBuffer> positions_;  // by frame
  std::vector<std::uint32_t> contact_vertices_;
  std::vector<float> contact_toi_;
  std::vector<std::uint8_t> contact_kind_;
  std::vector<std::uint64_t> contact_ends_;  // of each step
};

/// The page before and after its data (html/page.html with style and scripts in it).
extern const std::string_view kHtmlHead;
extern const std::string_view kHtmlTail;

}  // namespace warmfront::client
