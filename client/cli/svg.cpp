// SPDX-License-Identifier: Apache-2.0
// Axes and text: see svg.h.
#include "client/cli/svg.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace warmfront::client {

std::string svg_file_name(std::string name) {
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_'; },
      '-');
  return name + ".svg";
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return print("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor) + escaped(text) + "</text>\n";
}

std::string line(double x0, double y0, double x1, double y1) {
  return print("<path d=\"M%.1f %.1fL%.1f %.1f\"/>\n", x0, y0, x1, y1);
}

LogAxis::LogAxis(const std::vector<double>& values, double first, double last, bool with_zero)
    : first_(with_zero ? first + 0.12 * (last - first) : first), last_(last), zero_(first) {
  double low = INFINITY;
  double high = 0;
  for (const double x : values) {
    if (!(x > 0) || !std::isfinite(x)) continue;
    low = std::min(low, x);
    high = std::max(high, x);
  }
  if (high == 0) low = high = 1;
  const auto decade = static_cast<int>(std::floor(std::log10(low)));
  marks_ = {std::pow(10.0, decade)};
  for (int e = decade; marks_.back() <= high; ++e) {
    for (const double step : {2, 5, 10}) {
      if (marks_.back() <= low && step * std::pow(10.0, e) <= low) marks_.clear();
      marks_.push_back(step * std::pow(10.0, e));
      if (marks_.back() > high) break;
    }
  }
  low_ = std::log10(marks_.front());
  high_ = std::log10(marks_.back());
  thin_out();
}

double LogAxis::at(double x) const {
  if (!(x > 0)) return zero_;
  return first_ + std::clamp((std::log10(x) - low_) / (high_ - low_), 0.0, 1.0) * (last_ - first_);
}

// At most eight marks: only decades where 1, 2, 5 would be too many, and then every k-th.
void LogAxis::thin_out() {
  constexpr std::size_t kMost = 8;
  if (marks_.size() <= kMost) return;
  std::erase_if(marks_, [](double x) {
    const double e = std::log10(x);
    return std::fabs(e - std::round(e)) > 0.1;
  });
  const std::size_t stride = (marks_.size() + kMost - 1) / kMost;
  std::vector<double> kept;
  for (std::size_t i = 0; i < marks_.size(); i += stride) kept.push_back(marks_[i]);
  marks_ = std::move(kept);
}

LinearAxis::LinearAxis(double most, double first, double last) : most_(most), first_(first), last_(last) {
  // Four to ten marks, at 1, 2 or 5 times a power of ten.
  const double decade = std::pow(10.0, std::floor(std::log10(most)));
  const double step = most < 2 * decade ? decade / 5 : most < 5 * decade ? decade / 2 : decade;
  for (int k = 0; k * step <= most * (1 + 1e-9); ++k) marks_.push_back(k * step);
}

}  // namespace warmfront::client
