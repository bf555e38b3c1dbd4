// SPDX-License-Identifier: Apache-2.0
// The page of `detect`: see detect_page.h.
#include "client/cli/detect/page.h"

#include <nlohmann/json.hpp>

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// A column of the timeline: a number a step.
template <class Value>
Json column(const DetectReport& report, Value value) {
  Json values = Json::array();
  for (const FrameReport& frame : report.frames) values.push_back(value(frame));
  return values;
}

Json timeline(const DetectReport& report) {
  const auto ms = [&](double StageTimes::*stage) {
    return column(report, [stage](const FrameReport& f) { return f.statistics.ms.*stage; });
  };
  return {
      {"steps", column(report, [](const FrameReport& f) { return f.frame; })},
      {"vf", column(report, [](const FrameReport& f) { return f.vf; })},
      {"ee", column(report, [](const FrameReport& f) { return f.ee; })},
      {"vh", column(report, [](const FrameReport& f) { return f.vh; })},
      {"possible", column(report, [](const FrameReport& f) { return f.possible; })},
      {"earliest_toi",
       column(report, [](const FrameReport& f) { return f.earliest_toi ? Json(*f.earliest_toi) : Json(); })},
      {"ms",
       {{"total", ms(&StageTimes::total)},
        {"refit", ms(&StageTimes::refit)},
        {"front", ms(&StageTimes::front)},
        {"elementary", ms(&StageTimes::elementary)},
        {"adjacent", ms(&StageTimes::adjacent)}}}};
}

}  // namespace

Status add_contacts(HtmlPage& page, std::span<const ContactRecord> contacts) {
  for (const ContactRecord& contact : contacts)
    page.add_row(contact.vertices, page_kind(contact.kind), contact.toi);
  return page.end_step();
}

Json told_of(const DetectReport& report) {
  Json told{{"tier", to_string(report.options.tier)},
            {"tolerance", report.options.tolerance},
            {"min_separation", report.options.min_separation},
            {"front", to_string(report.options.front)},
            {"bounds", to_string(report.options.bounds)},
            {"threads", report.threads},
            {"contacts_hash", report.contacts_hash}};
  told.update(timeline(report));
  return told;
}

}  // namespace warmfront::client
