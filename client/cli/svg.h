// SPDX-License-Identifier: Apache-2.0
// Plain SVG for diagrams: axes, marks and text. Pure functions and constant values.
#pragma once

#include <string>
#include <vector>

#include "client/cli/print.h"

namespace warmfront::client {

/// The name of a plot's file: characters that every file system accepts, and ".svg".
std::string svg_file_name(std::string name);

/// Text escaped for XML and HTML.
std::string escaped(const std::string& text);

/// `anchor`: start, middle or end.
std::string text_at(double x, double y, const char* anchor, const std::string& text);
std::string line(double x0, double y0, double x1, double y1);

/// A logarithmic axis from pixel `first` to pixel `last`; at `first` there is optionally a mark for 0.
class LogAxis {
 public:
  /// From a mark below the positive values to one above them.
  LogAxis(const std::vector<double>& values, double first, double last, bool with_zero);

  double at(double x) const;
  const std::vector<double>& marks() const { return marks_; }

 private:
  void thin_out();

  double first_;
  double last_;
  double zero_;
  double low_ = 0;
  double high_ = 1;
  std::vector<double> marks_;
};

/// A linear axis from 0 at pixel `first` to `most` > 0 at pixel `last`.
class LinearAxis {
 public:
  LinearAxis(double most, double first, double last);

  double at(double x) const { return first_ + x / most_ * (last_ - first_); }
  const std::vector<double>& marks() const { return marks_; }

 private:
  double most_;
  double first_;
  double last_;
  std::vector<double> marks_;
};

}  // namespace warmfront::client
