#include "client/cli/load/report.h"
namespace warmfront::client::load {
std::string format_html(const Report&) {
  return "";
}
}  // namespace warmfront::client::load
