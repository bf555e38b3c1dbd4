// SPDX-License-Identifier: Apache-2.0
// The page of states: see states_page.h.
#include "client/cli/states/page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "client/cli/frames/model_summary.h"
#include "client/cli/verb.h"
#include "engine/stencil.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// The vertices' own and their bodies', added; empty where nothing is thick.
std::vector<double> thickness_by_vertex(const SceneDescription& scene) {
  if (summary_of(scene).most_thickness == 0) return {};
  std::vector<double> of = scene.thickness;
  of.resize(scene.vertex_count, 0);
  for (const Body& body : scene.bodies)
    for (double& one : std::span(of).subspan(body.first_vertex, body.vertex_count)) one += body.thickness;
  return of;
}

/// Of what counts as near: 0 where both are 0.
double share(double squared_distance, double most) {
  return squared_distance == 0 ? 0 : std::sqrt(squared_distance) / most;
}

}  // namespace

Result<StatesPage> StatesPage::start(const HtmlArguments& html, PageOf asked, const std::string& input,
                                     const States& states) {
  Result<HtmlPage> page =
      HtmlPage::start(asked, short_name(input), states.scene(), states.count(), html.limit);
  if (!page) return page.error();
  return StatesPage(std::move(page).value(), html.file);
}

void StatesPage::add_frame(const States& states, double ms) {
  page_.add_frame(states.positions());
  columns_["steps"].push_back(states.number());
  columns_["ms"]["total"].push_back(ms);
}

double StatesPage::thickness_of(std::span<const std::uint32_t> vertices) const {
  double most = 0;
  if (!thickness_.empty())
    for (const std::uint32_t v : vertices) most = std::max(most, thickness_[v]);
  return most;
}

void StatesPage::add_rows(const ContactTable& table, double distance) {
  constexpr std::array kNames{"vv", "ev", "ee", "fv", "vh"};  // by ClosestFeatures, and of half-spaces
  std::array<std::uint64_t, kNames.size()> counts{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::span<const std::uint32_t> row = table.vertices[i];
    const std::size_t first = vertices_of_first(table.kind[i]);  // vertices of the first one
    const bool of_half_space = table.kind[i] == ContactKind::kVertexHalfSpace;
    const double of_second = of_half_space ? body_thickness_[row[3]] : thickness_of(row.subspan(first));
    const double most = distance + thickness_of(row.first(first)) + of_second;
    const double value = share(table.squared_distance[i], most);
    if (page_.asked() == PageOf::kClosestPairs) {
      Stencil closest = stencil_of(table.kind[i], table.vertices[i], table.stencil[i]);
      if (of_half_space) closest.vertices.fill(row[0]);
      const std::size_t kind = of_half_space ? kNames.size() - 1 : static_cast<std::size_t>(closest.kind);
      ++counts.at(kind);
      page_.add_row(closest.vertices, static_cast<std::uint8_t>(kind), value);
    } else {
      page_.add_row(row, page_kind(table.kind[i]), value);
    }
  }
  if (page_.asked() != PageOf::kClosestPairs) return;
  for (std::size_t i = 0; i < kNames.size(); ++i) columns_["rows"][kNames[i]].push_back(counts[i]);
}

Status StatesPage::add_near(const States& states, double distance, const Answer& answer, double ms) {
  if (columns_["steps"].empty()) {
    thickness_ = thickness_by_vertex(states.scene());  // which is valid by now
    for (const Body& body : states.scene().bodies) body_thickness_.push_back(body.thickness);
  }
  add_frame(states, ms);
  const ContactTable& table = answer.contacts;
  columns_["vf"].push_back(answer.vf);
  columns_["ee"].push_back(answer.ee);
  columns_["vh"].push_back(answer.vh);
  columns_["possible"].push_back(answer.possible);
  columns_["least_distance"].push_back(
      table.size() > 0 ? Json(std::sqrt(*std::ranges::min_element(table.squared_distance))) : Json());
  add_rows(table, distance);
  return page_.end_step();
}

Status StatesPage::add_tangled(const States& states, const Answer& answer, double ms) {
  add_frame(states, ms);
  columns_["ef"].push_back(answer.ef);
  for (const auto& vertices : answer.contacts.edge_faces) page_.add_row(vertices, 0, 0);
  return page_.end_step();
}

Status StatesPage::write(const Json& question) const {
  Json told = question;
  told["thick"] = !thickness_.empty();
  told.update(columns_);
  return page_.write(file_, told);
}

}  // namespace warmfront::client
