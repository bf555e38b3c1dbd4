// SPDX-License-Identifier: Apache-2.0
#include "client/c/structs.h"

#include <cstdint>
#include <limits>

#include "engine/options.h"

namespace warmfront::c {
namespace {

template <class T>
void initialize(T* to, std::size_t size, T initial) {
  if (to == nullptr) return;
  initial.size = size;
  write(to, size, initial);
}

}  // namespace

wf_body initial_body() {
  wf_body body{};
  body.self_collision = 1;
  body.group = 1;
  body.mask = 0xffffffff;
  return body;
}
wf_options initial_options() {
  const ColliderOptions defaults;
  wf_options options{};
  options.tier = static_cast<std::int32_t>(defaults.tier);
  options.report = static_cast<std::int32_t>(defaults.report);
  options.tolerance = defaults.tolerance;
  options.min_separation = defaults.min_separation;
  options.max_contacts = defaults.max_contacts;
  options.max_front_bytes = defaults.max_front_bytes;
  return options;
}
wf_question initial_question() {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  wf_question question{};
  question.tier = question.report = -1;
  question.fields = -1;
  question.tolerance = question.min_separation = question.keep_distance = kNone;
  question.max_contacts = UINT64_MAX;
  return question;
}

}  // namespace warmfront::c

using namespace warmfront::c;

void wf_body_init(wf_body* body, size_t size) {
  initialize(body, size, initial_body());
}
void wf_scene_init(wf_scene* scene, size_t size) {
  initialize(scene, size, wf_scene{});
}
void wf_change_init(wf_change* change, size_t size) {
  initialize(change, size, wf_change{});
}
void wf_options_init(wf_options* options, size_t size) {
  initialize(options, size, initial_options());
}
void wf_frame_init(wf_frame* frame, size_t size) {
  initialize(frame, size, wf_frame{});
}
void wf_question_init(wf_question* question, size_t size) {
  initialize(question, size, initial_question());
}
