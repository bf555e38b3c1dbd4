// SPDX-License-Identifier: Apache-2.0
// Reads the query sets' format: 8 rows a query, x_num,x_den,y_num,y_den,z_num,z_den,truth (big rationals that
// are doubles).
#pragma once

#include <gmpxx.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "engine/contact.h"
#include "engine/motion/motion.h"

namespace warmfront::testing {

struct FileQuery {
  std::array<VertexMotion, 4> vertices;  ///< vertex, face's three; or edge, edge
  bool truth;
};

inline std::vector<FileQuery> read_queries(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<std::array<double, 3>> rows;
  std::vector<bool> truths;
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::array<double, 3> row{};
    bool good = true;
    for (double& x : row) {
      std::string numerator;
      std::string denominator;
      good = good && static_cast<bool>(fields >> numerator >> denominator);
      if (good) x = mpq_class(mpz_class(numerator), mpz_class(denominator)).get_d();
    }
    std::string truth;
    if (!good || !(fields >> truth)) continue;
    rows.push_back(row);
    truths.push_back(truth == "1");
  }
  std::vector<FileQuery> queries;
  for (std::size_t i = 0; i + 8 <= rows.size(); i += 8) {
    FileQuery query{{}, truths[i]};
    for (int k = 0; k < 4; ++k) {
      query.vertices[k].t0 = {rows[i + k][0], rows[i + k][1], rows[i + k][2], 0};
      query.vertices[k].t1 = {rows[i + 4 + k][0], rows[i + 4 + k][1], rows[i + 4 + k][2], 0};
    }
    queries.push_back(query);
  }
  return queries;
}

}  // namespace warmfront::testing
