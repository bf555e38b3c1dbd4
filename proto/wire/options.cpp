// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/options.h"

#include "proto/wire/enums.h"

namespace warmfront::wire {

v1::ContactFields to_proto(const ContactFields& fields) {
  v1::ContactFields message;
  message.set_weights(fields.weights);
  message.set_normal(fields.normal);
  message.set_points(fields.points);
  message.set_direction(fields.direction);
  message.set_squared_distance(fields.squared_distance);
  message.set_closest(fields.closest);
  return message;
}

ContactFields fields_from(const v1::ContactFields& message) {
  return {.weights = message.weights(),
          .normal = message.normal(),
          .points = message.points(),
          .direction = message.direction(),
          .squared_distance = message.squared_distance(),
          .closest = message.closest()};
}

v1::ColliderOptions to_proto(const ColliderOptions& options) {
  v1::ColliderOptions message;
  message.set_tier(to_proto(options.tier));
  message.set_report(to_proto(options.report));
  message.set_front(to_proto(options.front));
  message.set_bounds(to_proto(options.bounds));
  message.set_find_bodies(options.find_bodies);
  message.set_find_rigid(options.find_rigid);
  message.set_separate_parts(options.separate_parts);
  message.set_explain(options.explain);
  message.set_tolerance(options.tolerance);
  message.set_min_separation(options.min_separation);
  message.set_normal_cones(options.normal_cones);
  message.set_lazy_front(options.lazy_front);
  message.set_leaf_size(options.leaf_size);
  *message.mutable_fields() = to_proto(options.fields);
  message.set_rebuild_after_stalled_steps(options.rebuild_after_stalled_steps);
  message.set_rebuild_every_steps(options.rebuild_every_steps);
  message.set_max_front_bytes(options.max_front_bytes);
  message.set_max_contacts(options.max_contacts);
  return message;
}

Result<ColliderOptions> options_from(const v1::ColliderOptions& message) {
  ColliderOptions options;
  if (Status known = read(message.tier(), "options.tier", options.tier); !known) return known.error();
  if (Status known = read(message.report(), "options.report", options.report); !known) return known.error();
  if (Status known = read(message.front(), "options.front", options.front); !known) return known.error();
  if (Status known = read(message.bounds(), "options.bounds", options.bounds); !known) return known.error();
  if (message.has_find_bodies()) options.find_bodies = message.find_bodies();
  if (message.has_find_rigid()) options.find_rigid = message.find_rigid();
  if (message.has_separate_parts()) options.separate_parts = message.separate_parts();
  options.explain = message.explain();
  if (message.has_tolerance()) options.tolerance = message.tolerance();
  if (message.has_min_separation()) options.min_separation = message.min_separation();
  if (message.has_normal_cones()) options.normal_cones = message.normal_cones();
  if (message.has_lazy_front()) options.lazy_front = message.lazy_front();
  options.fields = fields_from(message.fields());
  if (message.has_leaf_size()) options.leaf_size = message.leaf_size();
  if (message.has_rebuild_after_stalled_steps())
    options.rebuild_after_stalled_steps = message.rebuild_after_stalled_steps();
  if (message.has_rebuild_every_steps()) options.rebuild_every_steps = message.rebuild_every_steps();
  if (message.has_max_front_bytes()) options.max_front_bytes = message.max_front_bytes();
  if (message.has_max_contacts()) options.max_contacts = message.max_contacts();
  return options;
}

}  // namespace warmfront::wire
