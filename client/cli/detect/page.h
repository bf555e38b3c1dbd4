// SPDX-License-Identifier: Apache-2.0
// What the page of `detect` holds: the contacts of each step, counts and stage times. Pure functions.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>

#include "client/cli/detect/report_json.h"
#include "client/cli/html/html_page.h"
#include "client/io/contact_record.h"

namespace warmfront::client {

/// Adds a step's contacts; fails as HtmlPage::end_step() does.
Status add_contacts(HtmlPage& page, std::span<const ContactRecord> contacts);

/// What the page tells besides, for HtmlPage::write().
nlohmann::ordered_json told_of(const DetectReport& report);

}  // namespace warmfront::client
