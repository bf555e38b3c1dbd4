// SPDX-License-Identifier: Apache-2.0
// The page of verbs that ask about states: each frame as it stands, with the pairs that were found there.
// Used by the main thread only.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/html/html_options.h"
#include "client/cli/html/html_page.h"
#include "client/cli/states/states.h"
#include "client/lib/answer.h"

namespace warmfront::client {

class StatesPage {
 public:
  /// Fails as HtmlPage::start() does. `input`: the page's name is made of it.
  static Result<StatesPage> start(const HtmlArguments& html, PageOf asked, const std::string& input,
                                  const States& states);

  /// The frame at hand, and what is within `distance` there: an answer that lists pairs, with their squared
  /// distances; a reduced one of PageOf::kClosestPairs. `ms`: how long the question took.
  Status add_near(const States& states, double distance, const Answer& answer, double ms);
  /// The frame at hand, and which edges meet which faces there.
  Status add_tangled(const States& states, const Answer& answer, double ms);

  /// `question`: how it was asked, as the subtitle tells it.
  Status write(const nlohmann::ordered_json& question) const;

 private:
  StatesPage(HtmlPage page, std::string file) : page_(std::move(page)), file_(std::move(file)) {}
  void add_frame(const States& states, double ms);
  double thickness_of(std::span<const std::uint32_t> vertices) const;
  void add_rows(const ContactTable& table, double distance);

  HtmlPage page_;
  std::string file_;
  std::vector<double> thickness_;       // by vertex; empty where nothing is thick
  std::vector<double> body_thickness_;  // by body
  nlohmann::ordered_json columns_ = {{"steps", nlohmann::ordered_json::array()}};
};

}  // namespace warmfront::client
