// SPDX-License-Identifier: Apache-2.0
// Outputs of `detect` besides its table: files of contacts, meshes, a page. Used by the main thread only.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/detect/report_json.h"
#include "client/cli/detect/stepper.h"
#include "client/cli/frames/frame_steps.h"
#include "client/cli/html/html_options.h"
#include "client/cli/html/html_page.h"
#include "client/io/contact_writer.h"
#include "client/io/vtp_mesh_writer.h"
#include "engine/screw.h"

namespace warmfront::client {

/// File names; empty: not written.
struct OutputFiles {
  std::string contacts;     ///< .csv, .jsonl or .vtp
  bool continuity = false;  ///< with whether each contact was there in the step before
  bool ended = false;       ///< with those that were, and are not any more
  std::string meshes;       ///< .vtp
  HtmlArguments html;
};

class DetectOutputs {
 public:
  /// kInvalidArgument for unknown file name endings, for a list of contacts when only counts are reported,
  /// and for contact fields without a contact file. Opens nothing.
  static Status check(const OutputFiles& files, const ColliderOptions& options);

  /// Creates the files, and writes the first positions of `steps`.
  static Result<DetectOutputs> open(const OutputFiles& files, const ContactFields& fields,
                                    const std::string& name, const SceneDescription& scene,
                                    const FrameSteps& steps);

  /// Behind a step: what follows has another topology, and starts at the first positions of `steps`. --meshes
  /// has those of the moment itself with the topology before it.
  Status begin_part(const SceneDescription& scene, const FrameSteps& steps);

  /// The contacts of the step that ends where the first one starts: what --continuity compares that with.
  void remember(std::vector<ContactRecord> before) { before_ = std::move(before); }

  /// Rows of contacts that were written.
  std::uint64_t rows() const { return rows_; }
  /// Is there any output? Then each answer must be taken before the next step.
  bool any() const { return contacts_ || meshes_ || page_; }
  /// Writes the current step of `steps`, its answer, and the twists of the bodies that move along a screw.
  Status step(const FrameSteps& steps, const StepAnswer& answer, std::span<const Twist> twists);
  /// Writes buffered data; fails when any data did not reach its file.
  Status close(const DetectReport& report);

 private:
  // The contacts with what the step before says of them; with `ended_`, those that ended behind them.
  std::vector<ContactRecord> with_continuity(const std::vector<ContactRecord>& contacts);

  bool continuity_ = false;
  bool ended_ = false;
  std::uint64_t rows_ = 0;
  std::vector<ContactRecord> before_;  // with continuity_, the contacts of the step before
  std::string html_file_;
  std::unique_ptr<ContactWriter> contacts_;
  std::optional<VtpMeshWriter> meshes_;
  std::optional<HtmlPage> page_;
};

}  // namespace warmfront::client
