// SPDX-License-Identifier: Apache-2.0
// Building blocks of the command line's verbs. Used by the main thread only.
#pragma once

#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/result.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace warmfront::client {

/// Runs a verb after its arguments are parsed; returns the exit code (exit_codes.h).
using Verb = std::function<int()>;

/// Prints "warmfront: MESSAGE" on stderr, in one line, and returns the exit code: `failure` or `usage_error`.
int failure(const std::string& message);
int usage_error(const std::string& message);

/// Prints an input's notes, one per line, on stderr.
void print_notes(std::span<const std::string> notes);

/// Flushes stdout; kExitFailed, with a message, when something printed could not be written (a full disk).
int finish_output();

/// An input's name for tables: the last component of a path, or the part after "builtin:".
std::string short_name(const std::string& path);

/// Writes `text` to the file, or to stdout for "-".
Status write_text(const std::string& path, const std::string& text);

/// Defines the syntax of options that take a list, in every verb: `--x a,b`, or `--x a --x b`, or both mixed.
/// A word after a space is not part of the list: it may be an INPUT.
CLI::Option* take_list(CLI::Option* option);

/// Fails when two of the files, by the names of their options, are stdout ("-").
Status check_one_stdout(std::initializer_list<std::pair<const char*, std::string>> files);

/// Groups inputs to be measured one after the other: mesh files are the frames of one, every other path is
/// its own.
std::vector<std::vector<std::string>> group_inputs(std::span<const std::string> paths);

/// Fails for the first path that does not exist. If the path is one of `words`, the values of list options,
/// the message explains the syntax of lists. builtin:NAME passes.
Status check_paths(std::span<const std::string> paths, std::span<const std::string> words);

}  // namespace warmfront::client
