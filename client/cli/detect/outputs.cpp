// SPDX-License-Identifier: Apache-2.0
// Files of frames and contacts: see detect_outputs.h.
#include "client/cli/detect/outputs.h"

#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/cli/detect/page.h"
#include "client/cli/verb.h"
#include "engine/continuity.h"

namespace warmfront::client {

Status DetectOutputs::check(const OutputFiles& files, const ColliderOptions& options) {
  if (!files.meshes.empty() && !files.meshes.ends_with(".vtp"))
    return invalid_argument("--meshes " + files.meshes + ": the name must end in .vtp");
  if (files.contacts.empty()) {
    if (options.fields.any())
      return invalid_argument("--fields says what --contacts writes of a contact; name a file");
    if (files.continuity || files.ended)
      return invalid_argument("--continuity and --ended say what --contacts writes; name a file");
    return {};
  }
  if (!is_contact_file_name(files.contacts))
    return invalid_argument("--contacts " + files.contacts +
                            ": the name must end in .csv, .jsonl or .vtp, or be - for CSV on stdout");
  if (options.report == Report::kCount)
    return invalid_argument("--contacts needs --report all or earliest: count gives no list");
  if ((files.continuity || files.ended) && options.report == Report::kEarliest)
    return invalid_argument(
        "--continuity and --ended need all contacts of each step; leave out --report earliest");
  if (files.ended && files.contacts.ends_with(".vtp"))
    return invalid_argument("--ended: contacts that ended are nowhere for .vtp; use .csv or .jsonl");
  return {};
}

Result<DetectOutputs> DetectOutputs::open(const OutputFiles& files, const ContactFields& fields,
                                          const std::string& name, const SceneDescription& scene,
                                          const FrameSteps& steps) {
  DetectOutputs outputs;
  outputs.continuity_ = files.continuity || files.ended;
  outputs.ended_ = files.ended;
  WrittenFields written = fields;
  written.continuity = outputs.continuity_;
  if (!files.contacts.empty()) {
    Result<std::unique_ptr<ContactWriter>> created = open_contact_writer(files.contacts, written);
    if (!created) return created.error();
    outputs.contacts_ = std::move(created).value();
  }
  if (!files.meshes.empty()) {
    Result<VtpMeshWriter> created = VtpMeshWriter::create(files.meshes, scene);
    if (!created) return created.error();
    outputs.meshes_.emplace(std::move(created).value());
    if (Status status = outputs.meshes_->write(steps.number(), steps.end(), {}); !status)
      return status.error();
  }
  if (!files.html.file.empty()) {
    Result<HtmlPage> started =
        HtmlPage::start(PageOf::kSteps, short_name(name), scene, steps.step_count() + 1, files.html.limit);
    if (!started) return started.error();
    outputs.html_file_ = files.html.file;
    outputs.page_.emplace(std::move(started).value());
    outputs.page_->add_frame(steps.end());
  }
  return outputs;
}

Status DetectOutputs::begin_part(const SceneDescription& scene, const FrameSteps& steps) {
  if (meshes_) meshes_->take_scene(scene);
  if (!page_) return {};
  Status begun = page_->begin_part(scene, steps.step_count() + 1);
  if (begun) page_->add_frame(steps.end());
  return begun;
}

std::vector<ContactRecord> DetectOutputs::with_continuity(const std::vector<ContactRecord>& contacts) {
  struct Columns {
    explicit Columns(const std::vector<ContactRecord>& rows) {
      for (const ContactRecord& row : rows) {
        kind.push_back(row.kind);
        vertices.push_back(row.vertices);
      }
    }
    std::vector<ContactKind> kind;
    std::vector<std::array<std::uint32_t, 4>> vertices;
  };
  const Columns earlier(before_), now(contacts);
  const Continuity of = continuity({earlier.kind, earlier.vertices}, {now.kind, now.vertices});
  std::vector<ContactRecord> told = contacts;
  for (std::size_t i = 0; i < told.size(); ++i)
    told[i].continuity = of.earlier[i] == Continuity::kNew ? RowContinuity::kNew : RowContinuity::kKept;
  if (ended_) {
    for (const std::size_t row : of.ended) {
      told.push_back(before_[row]);
      told.back().continuity = RowContinuity::kEnded;
    }
  }
  before_ = contacts;
  return told;
}

Status DetectOutputs::step(const FrameSteps& steps, const StepAnswer& answer, std::span<const Twist> twists) {
  if (contacts_) {
    const std::vector<ContactRecord> told =
        continuity_ ? with_continuity(answer.contacts) : std::vector<ContactRecord>();
    Status status = contacts_->write(steps.number(), steps.start(), steps.end(),
                                     continuity_ ? told : answer.contacts, answer.geometry);
    if (!status) return status;
    rows_ += continuity_ ? told.size() : answer.contacts.size();
  }
  if (meshes_) {
    if (Status status = meshes_->write(steps.number(), steps.end(), answer.contacts); !status) return status;
  }
  if (page_) {
    page_->add_frame(steps.end());
    page_->add_twists(twists);
    if (Status status = add_contacts(*page_, answer.contacts); !status) return status;
  }
  return {};
}

Status DetectOutputs::close(const DetectReport& report) {
  if (contacts_) {
    if (Status status = contacts_->close(); !status) return status;
  }
  if (meshes_) {
    if (Status status = meshes_->close(); !status) return status;
  }
  return page_ ? page_->write(html_file_, told_of(report)) : Status();
}

}  // namespace warmfront::client
