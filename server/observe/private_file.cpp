// SPDX-License-Identifier: Apache-2.0
#include "server/observe/private_file.h"

#include <fcntl.h>

#include <cerrno>
#include <system_error>

namespace warmfront::server {

Result<int> open_private_file(const std::string& setting, const std::string& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (file >= 0) return file;
  return invalid_argument(setting + " " + path + ": it cannot be opened for writing (" +
                          std::generic_category().message(errno) + ")");
}

}  // namespace warmfront::server
