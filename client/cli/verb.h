// SPDX-License-Identifier: Apache-2.0
// What every verb of the command line is made of. Used by the main thread only.
#pragma once

#include <functional>
#include <string>

#include "engine/result.h"

namespace CLI {
class App;
}

namespace warmfront::client {

/// What a verb does once its arguments are parsed; gives the exit code (exit_codes.h).
using Verb = std::function<int()>;

/// Says "warmfront: MESSAGE" on stderr, in one line, and gives the exit code: `failure` or `usage_error`.
int failure(const std::string& message);
int usage_error(const std::string& message);

/// Flushes stdout; kExitFailed, with a message, when something printed could not be written (a full disk).
int finish_output();

/// An input's name for tables: the last part of a path, or what comes behind "builtin:".
std::string short_name(const std::string& path);

/// Writes `text` to the file, or to stdout for "-".
Status write_text(const std::string& path, const std::string& text);

}  // namespace warmfront::client
