// SPDX-License-Identifier: Apache-2.0
// Where part of a motion ends, for those who keep positions of their own. Pure functions.
#include <algorithm>
#include <string>

#include "client/c/errors.h"
#include "client/c/reading.h"
#include "client/c/warmfront.h"
#include "engine/digits.h"
#include "engine/part_way.h"
#include "engine/screw.h"

using namespace warmfront;
using namespace warmfront::c;

namespace {

Status check(double fraction, std::int32_t type) {
  if (!(fraction >= 0 && fraction <= 1))
    return invalid_argument("fraction: " + digits_of(fraction) + " is not in [0, 1]");
  if (type != WF_FLOAT64 && type != WF_FLOAT32) return out_of("type", type, WF_FLOAT32);
  return {};
}

double rounded(double number, bool single) {
  if (!single) return number;
  const volatile float at = static_cast<float>(number);  // which no compiler leaves out, as in part_way()
  return at;
}

Result<Pose> pose_of(const double* numbers, const char* field, bool single) {
  Pose pose;
  std::copy_n(numbers, pose.matrix.size(), pose.matrix.begin());
  if (single) pose = in_float32(pose);
  if (Status rigid = check_pose(pose, field); !rigid) return rigid.error();
  return pose;
}

}  // namespace

wf_code wf_part_way(const double* from, const double* to, size_t count, double fraction, int32_t type,
                    double* way) {
  return guarded([&]() -> wf_code {
    if (count > 0 && (from == nullptr || to == nullptr || way == nullptr))
      return fail(WF_INVALID_ARGUMENT, "from, to or way: is null");
    if (Status valid = check(fraction, type); !valid) return fail(valid.error());
    const bool single = type == WF_FLOAT32;
    for (std::size_t i = 0; i < count; ++i)
      way[i] = part_way(rounded(from[i], single), rounded(to[i], single), fraction, single);
    return WF_OK;
  });
}

wf_code wf_screw_way(const double* from, const double* to, double fraction, int32_t type, double* way) {
  return guarded([&]() -> wf_code {
    if (from == nullptr || to == nullptr || way == nullptr)
      return fail(WF_INVALID_ARGUMENT, "from, to or way: is null");
    if (Status valid = check(fraction, type); !valid) return fail(valid.error());
    const bool single = type == WF_FLOAT32;
    const Result<Pose> first = pose_of(from, "from", single);
    if (!first) return fail(first.error());
    const Result<Pose> last = pose_of(to, "to", single);
    if (!last) return fail(last.error());
    std::ranges::copy(screw_way(first.value(), last.value(), fraction, single).matrix, way);
    return WF_OK;
  });
}
