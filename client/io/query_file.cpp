// SPDX-License-Identifier: Apache-2.0
// Query files: see query_file.h.
#include "client/io/query_file.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "client/io/file.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

// A fraction's parts may share factors, so they may be longer than any double's (1,075 digits).
constexpr std::size_t kMostDigits = 10'000;
constexpr int kRows = 8;

bool parse_integer(std::string_view word, mpz_class& value) {
  std::string_view digits = word;
  if (digits.starts_with('-') || digits.starts_with('+')) digits.remove_prefix(1);
  if (digits.empty() || digits.size() > kMostDigits) return false;
  if (!std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; })) return false;
  value = mpz_class(std::string(digits), 10);
  if (word.starts_with('-')) value = -value;
  return true;
}

// numerator / denominator as a double, if it is exactly one.
std::optional<double> exact_double(const mpz_class& numerator, const mpz_class& denominator) {
  mpq_class q(numerator, denominator);
  q.canonicalize();
  if (q == 0) return 0.0;
  const mpz_class& n = q.get_num();
  const mpz_class& d = q.get_den();
  const mp_bitcnt_t halvings = mpz_scan1(d.get_mpz_t(), 0);
  if (mpz_sizeinbase(d.get_mpz_t(), 2) != halvings + 1) return std::nullopt;
  // q = odd * 2^exponent: a double if the odd part has at most 53 bits, the lowest of all at or above 2^-1074
  // and the highest below 2^1024.
  const mp_bitcnt_t zeros = mpz_scan1(n.get_mpz_t(), 0);
  const mpz_class odd = n >> zeros;
  const auto bits = static_cast<long>(mpz_sizeinbase(odd.get_mpz_t(), 2));
  const long exponent = static_cast<long>(zeros) - static_cast<long>(halvings);
  if (bits > 53 || exponent < -1074 || bits + exponent > 1024) return std::nullopt;
  return std::ldexp(odd.get_d(), static_cast<int>(exponent));
}

// The content of a row, or its error.
struct Row {
  std::array<double, 4> position{};
  bool truth = false;
};

Result<Row> parse_row(std::string_view line) {
  std::array<std::string_view, 7> fields;
  std::size_t count = 0;
  for (;;) {
    const std::size_t comma = line.find(',');
    if (count < fields.size()) fields[count] = line.substr(0, comma);
    ++count;
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  if (count != fields.size()) {
    return invalid_argument(std::to_string(count) +
                            " fields where x_num,x_den,y_num,y_den,z_num,z_den,truth are 7");
  }
  Row row;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    mpz_class numerator, denominator;
    for (std::size_t part = 0; part < 2; ++part) {
      const std::string_view word = fields[2 * axis + part];
      if (!parse_integer(word, part == 0 ? numerator : denominator)) {
        return invalid_argument(in_quotes(word) + " is no integer of at most " + std::to_string(kMostDigits) +
                                " digits");
      }
    }
    const std::string coordinate(1, "xyz"[axis]);
    if (denominator == 0) return invalid_argument("the denominator of " + coordinate + " is 0");
    const std::optional<double> value = exact_double(numerator, denominator);
    if (!value) return invalid_argument(coordinate + " is not exactly a double");
    row.position[axis] = *value;
  }
  if (fields[6] != "0" && fields[6] != "1") {
    return invalid_argument("truth is " + in_quotes(fields[6]) + ", neither 0 nor 1");
  }
  row.truth = fields[6] == "1";
  return row;
}

Status collect(const std::string& path, std::vector<std::string>& files) {
  namespace fs = std::filesystem;
  std::error_code code;
  if (!fs::exists(path, code)) return invalid_argument(path + ": no such file or folder");
  if (!fs::is_directory(path, code)) {
    files.push_back(path);
    return {};
  }
  std::vector<std::string> found;
  fs::recursive_directory_iterator entries(path, code);
  for (; !code && entries != fs::recursive_directory_iterator(); entries.increment(code)) {
    if (entries->path().extension() == ".csv" && entries->is_regular_file(code)) {
      found.push_back(entries->path().string());
    }
  }
  if (code) return invalid_argument(path + ": cannot read the folder: " + code.message());
  if (found.empty()) return invalid_argument(path + ": no .csv file in this folder");
  std::ranges::sort(found);
  files.insert(files.end(), found.begin(), found.end());
  return {};
}

}  // namespace

Result<std::vector<KnownQuery>> parse_queries(std::string_view text, std::string_view name) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.remove_suffix(1);
  std::vector<KnownQuery> queries;
  LineScanner lines(text);
  int row_in_query = 0;
  for (std::string_view line; lines.next(line); row_in_query = (row_in_query + 1) % kRows) {
    const Result<Row> row = parse_row(line);
    if (!row) return error_at_line(name, lines.line_number(), row.error().message);
    const auto& [position, truth] = row.value();
    if (row_in_query == 0) queries.push_back({{}, truth});
    KnownQuery& query = queries.back();
    if (truth != query.truth) {
      return error_at_line(name, lines.line_number(), "truth differs from that of the query's first row");
    }
    VertexMotion& vertex = query.vertices[row_in_query % 4];
    (row_in_query < 4 ? vertex.t0 : vertex.t1) = position;
  }
  if (row_in_query != 0) {
    return error_at_line(name, lines.line_number(),
                         "the last query has " + std::to_string(row_in_query) + " of its 8 rows");
  }
  if (queries.empty()) return error_at_line(name, 1, "no query in this file");
  return queries;
}

std::optional<ContactKind> query_kind_of(std::string_view path) {
  while (!path.empty()) {
    const std::size_t slash = path.find_last_of('/');
    std::string_view part = slash == std::string_view::npos ? path : path.substr(slash + 1);
    part = part.substr(0, part.find('.'));
    if (part == "vertex-face" || part == "vf") return ContactKind::kVertexFace;
    if (part == "edge-edge" || part == "ee") return ContactKind::kEdgeEdge;
    path = slash == std::string_view::npos ? std::string_view{} : path.substr(0, slash);
  }
  return std::nullopt;
}

Result<std::vector<QueryFile>> read_query_files(std::span<const std::string> paths,
                                                std::optional<ContactKind> kind) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    if (Status status = collect(path, files); !status) return status.error();
  }
  std::vector<QueryFile> sets;
  for (const std::string& path : files) {
    const std::optional<ContactKind> its_kind = kind ? kind : query_kind_of(path);
    if (!its_kind) {
      return invalid_argument(path +
                              ": nothing in the path says vertex-face or edge-edge; give --type vf or ee");
    }
    const Result<std::string> text = read_file(path);
    if (!text) return text.error();
    Result<std::vector<KnownQuery>> queries = parse_queries(text.value(), path);
    if (!queries) return queries.error();
    sets.push_back({path, *its_kind, std::move(queries).value()});
  }
  return sets;
}

}  // namespace warmfront::client
