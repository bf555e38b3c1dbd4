// SPDX-License-Identifier: Apache-2.0
// Collecting and writing the page: see html_page.h.
#include "client/cli/html/html_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "client/cli/print.h"
#include "client/io/endian.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kSteps = 65535;

std::uint64_t base64_size(std::uint64_t bytes) {
  return (bytes + 2) / 3 * 4;
}

std::string mebibytes(std::uint64_t bytes) {
  if (bytes < (1 << 20)) return print("%.1f KiB", static_cast<double>(bytes) / (1 << 10));
  return print("%.1f MiB", static_cast<double>(bytes) / (1 << 20));
}

Error too_large(const std::string& what, std::uint64_t bytes, std::uint64_t limit) {
  return {ErrorCode::kResourceExhausted, "--html: " + what + " take " + mebibytes(bytes) +
                                             " of the page, above its limit of " + mebibytes(limit) +
                                             "; give fewer --frames, or a larger --html-limit"};
}

/// A file's base64 (RFC 4648), in pieces of whole triples.
void write_base64(OutputFile& file, std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  constexpr std::size_t kPiece = 3 << 14;
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t given = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 3; ++i)
      word = word << 8 | (i < given ? static_cast<unsigned char>(bytes[at + i]) : 0u);
    for (std::size_t i = 0; i < 4; ++i) text += i <= given ? kDigits[word >> (18 - 6 * i) & 63] : '=';
    if (text.size() >= kPiece) file.write(std::exchange(text, {}));
  }
  file.write(text);
}

/// A script that holds the values.
template <class T>
void write_blob(OutputFile& file, std::string_view id, std::span<const T> values) {
  std::string bytes;
  bytes.reserve(values.size_bytes());
  for (const T value : values) append_little(bytes, value);
  file.write("<script type=\"application/octet-stream\" id=\"" + std::string(id) + "\">");
  write_base64(file, bytes);
  file.write("</script>\n");
}

/// The whole motion's extent, in steps of uint16.
struct Quantizer {
  std::array<double, 3> origin{};
  std::array<double, 3> quantum{};

  explicit Quantizer(std::span<const PositionBuffer> frames) {
    std::array<double, 3> high{};
    origin.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const PositionBuffer& frame : frames) {
      const Positions positions = view(frame);
      for (std::size_t i = 0; i < 3 * vertex_count(frame); ++i) {
        const double x = coordinate(positions, i);
        origin[i % 3] = std::min(origin[i % 3], x);
        high[i % 3] = std::max(high[i % 3], x);
      }
    }
    // Halved, since the difference of finite numbers may overflow.
    for (std::size_t axis = 0; axis < 3; ++axis)
      quantum[axis] = (0.5 * high[axis] - 0.5 * origin[axis]) / kSteps * 2;
  }

  std::uint16_t round(double x, std::size_t axis) const {
    if (!(quantum[axis] > 0)) return 0;
    const double steps = (0.5 * x - 0.5 * origin[axis]) / (0.5 * quantum[axis]);
    return static_cast<std::uint16_t>(std::clamp(std::nearbyint(steps), 0.0, kSteps));
  }
  double error(double x, std::uint16_t steps, std::size_t axis) const {
    return std::fabs(origin[axis] + quantum[axis] * steps - x);
  }
};

/// The quantised frame; raises `error` to the largest error along any axis.
std::vector<std::uint16_t> quantize(const PositionBuffer& frame, const Quantizer& quantizer, double& error) {
  const Positions positions = view(frame);
  std::vector<std::uint16_t> steps(3 * vertex_count(frame));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double x = coordinate(positions, i);
    steps[i] = quantizer.round(x, i % 3);
    error = std::max(error, quantizer.error(x, steps[i], i % 3));
  }
  return steps;
}

Json bodies_of(const SceneDescription& scene, PageOf asked) {
  static constexpr std::array kNames{"deformable", "rigid", "static", "removed"};
  Json bodies = Json::array();
  for (const Body& body : scene.bodies) {
    bodies.push_back({{"name", body.name},
                      {"first_vertex", body.first_vertex},
                      {"vertex_count", body.vertex_count},
                      {"kind", kNames.at(static_cast<std::size_t>(body.kind))}});
    if (asked == PageOf::kSteps && body.screw) bodies.back()["screw"] = true;
    if (body.half_space && body.kind != BodyKind::kRemoved)
      bodies.back()["half_space"] = {{"point", body.half_space->point}, {"normal", body.half_space->normal}};
  }
  if (bodies.empty())
    bodies.push_back(
        {{"name", ""}, {"first_vertex", 0}, {"vertex_count", scene.vertex_count}, {"kind", "deformable"}});
  return bodies;
}

Json contents_of(const SceneDescription& scene, PageOf asked) {
  return {{"vertices", scene.vertex_count},
          {"triangles", scene.faces.size()},
          {"edges", scene.edges.size()},
          {"bodies", bodies_of(scene, asked)}};
}

/// JSON in which an HTML parser finds no end of the script.
std::string script_safe(const Json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', true, Json::error_handler_t::replace))
    c == '<' ? text += "\\u003c" : text += c;
  return text;
}

}  // namespace

Result<HtmlPage> HtmlPage::start(PageOf asked, std::string name, const SceneDescription& scene,
                                 std::uint64_t frames, std::uint64_t limit) {
  HtmlPage page;
  page.asked_ = asked;
  page.name_ = std::move(name);
  page.limit_ = limit;
  if (Status status = page.begin_part(scene, frames); !status) return status.error();
  return page;
}

Status HtmlPage::begin_part(const SceneDescription& scene, std::uint64_t frames) {
  parts_.push_back({scene, frames, row_ends_.size()});
  if (size() <= limit_) return {};
  std::uint64_t all = 0;
  for (const Part& part : parts_) all += part.frames;
  return too_large("the positions of " + std::to_string(all) + " frames", size(), limit_);
}

std::string_view HtmlPage::values_name() const {
  static constexpr std::array<std::string_view, 4> kNames{"contact-toi", "contact-share", "contact-share",
                                                          ""};
  return kNames.at(static_cast<std::size_t>(asked_));
}

std::uint64_t HtmlPage::size() const {
  std::uint64_t positions = 0, faces = 0, edges = 0;
  for (const Part& part : parts_) {
    positions += part.scene.vertex_count * part.frames;
    faces += part.scene.faces.size();
    edges += part.scene.edges.size();
  }
  return base64_size(6 * positions) + base64_size(12 * faces) + base64_size(8 * edges) +
         base64_size(8 * twists_.size()) +
         base64_size(4 * row_vertices_.size() + 4 * row_values_.size() + row_kinds_.size());
}

void HtmlPage::add_frame(const Positions& positions) {
  std::visit([&](auto values) { positions_.emplace_back(std::vector(values.begin(), values.end())); },
             positions);
}

void HtmlPage::add_twists(std::span<const Twist> twists) {
  for (const Twist& twist : twists)
    for (const auto& part : {twist.angular, twist.centre, twist.linear})
      twists_.insert(twists_.end(), part.begin(), part.end());
}

void HtmlPage::add_row(std::span<const std::uint32_t> vertices, std::uint8_t kind, double value) {
  row_vertices_.insert(row_vertices_.end(), vertices.begin(), vertices.end());
  row_kinds_.push_back(kind);
  if (!values_name().empty()) row_values_.push_back(static_cast<float>(value));
}

Status HtmlPage::end_step() {
  row_ends_.push_back(row_kinds_.size());
  if (size() <= limit_) return {};
  const std::string steps = std::to_string(row_ends_.size());
  const std::string rows =
      asked_ == PageOf::kSteps ? "the contacts up to step " + steps : "the pairs so far";
  return too_large("positions and " + rows, size(), limit_);
}

Status HtmlPage::write(const std::string& path, const Json& told) const {
  Result<OutputFile> created = OutputFile::create(path);
  if (!created) return created.error();
  OutputFile& file = created.value();
  file.write(kHtmlHead);

  std::vector<std::uint32_t> corners, ends;
  for (const Part& part : parts_) {
    for (const auto& face : part.scene.faces) corners.insert(corners.end(), face.begin(), face.end());
    for (const auto& edge : part.scene.edges) ends.insert(ends.end(), edge.begin(), edge.end());
  }
  write_blob<std::uint32_t>(file, "faces", corners);
  write_blob<std::uint32_t>(file, "lone-edges", ends);
  const Quantizer quantizer(positions_);
  double error = 0;
  std::vector<std::uint16_t> steps;
  for (const PositionBuffer& frame : positions_) {
    const std::vector<std::uint16_t> next = quantize(frame, quantizer, error);
    steps.insert(steps.end(), next.begin(), next.end());
  }
  write_blob<std::uint16_t>(file, "positions", steps);
  if (!twists_.empty()) write_blob<double>(file, "twists", twists_);
  write_blob<std::uint32_t>(file, "contact-v", row_vertices_);
  if (!values_name().empty()) write_blob<float>(file, values_name(), row_values_);
  write_blob<std::uint8_t>(file, "contact-kind", row_kinds_);

  static constexpr std::array kAsked{"steps", "near", "closest", "tangled"};
  Json json{{"name", name_},
            {"asked", kAsked.at(static_cast<std::size_t>(asked_))},
            {"origin", quantizer.origin},
            {"quantum", quantizer.quantum},
            {"error", error},
            {"contact_ends", row_ends_}};
  json.update(contents_of(parts_.front().scene, asked_));
  for (const Part& part : parts_) {
    if (parts_.size() == 1) break;
    Json& listed = json["parts"].emplace_back(contents_of(part.scene, asked_));
    listed["first_step"] = part.first_step;
  }
  json.update(told);
  file.write("<script type=\"application/json\" id=\"scene\">" + script_safe(json) + "</script>\n");
  file.write(kHtmlTail);
  return file.close();
}

}  // namespace warmfront::client
