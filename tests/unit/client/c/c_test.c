/* SPDX-License-Identifier: Apache-2.0
 * The C interface, from C: what is asked, what is refused and in which words, and structs of other versions. */
#include <math.h>

#include "c_check.h"

static void test_questions(void) {
  const wf_scene scene = triangles();
  wf_session* session = created(&scene, NULL);
  const wf_frame there = to(after), back = to(before);
  wf_answer answer;
  CHECK(wf_step(session, &there, NULL, &answer, sizeof answer) == WF_OK);
  CHECK(answer.frame == 1 && answer.rows == 3 && answer.vf == 1 && answer.ee == 2 && answer.possible == 0);
  CHECK(answer.kind[0] == WF_VERTEX_FACE && answer.status[0] == WF_HIT && answer.vertices[0] == 3);
  CHECK(answer.vertices[1] == 0 && answer.vertices[2] == 1 && answer.vertices[3] == 2);
  CHECK(answer.features[0] == 3 && answer.features[1] == 0); /* vertex 3, face 0 */
  CHECK(answer.toi[0] > 0.4999 && answer.toi[0] <= 0.5 && answer.earliest_toi <= answer.toi[0]);
  CHECK(answer.weights == NULL && answer.normal == NULL && answer.multiplicity == NULL && answer.ms > 0);
  const uint32_t* edges;
  size_t edge_count;
  CHECK(wf_edges(session, &edges, &edge_count) == WF_OK && edge_count == 6);
  for (size_t i = 1; i < 3; ++i) /* of both edges, the vertices that the numbers name */
    for (int side = 0; side < 2; ++side) {
      const uint32_t* named = edges + 2 * answer.features[2 * i + (size_t)side];
      CHECK(answer.kind[i] == WF_EDGE_EDGE && named[0] == answer.vertices[4 * i + 2 * (size_t)side] &&
            named[1] == answer.vertices[4 * i + 2 * (size_t)side + 1]);
    }

  double fraction = -1;
  CHECK(wf_max_step(session, &back, NULL, &fraction, NULL, 0) == WF_OK && fraction > 0.4999 && fraction <= 0.5);
  CHECK(wf_commit(session, 0.25) == WF_OK);
  REFUSED(wf_commit(session, 0.25), WF_FAILED_PRECONDITION, "trial");
  double at[18];
  CHECK(wf_positions(session, at, 18) == WF_OK && at[11] == -0.5 && at[2] == 0);
  REFUSED(wf_positions(session, at, 17), WF_INVALID_ARGUMENT, "18 are needed");
  wf_question question;
  wf_question_init(&question, sizeof question);
  question.fields = WF_WEIGHTS | WF_SQUARED_DISTANCE | WF_POINTS;
  CHECK(wf_proximity(session, 0.6, &question, &answer, sizeof answer) == WF_OK && answer.rows > 0);
  CHECK(answer.frame == 3 && isinf(answer.earliest_toi) && answer.direction == NULL);
  for (size_t i = 0; i < answer.rows; ++i) {
    const double* p = answer.points + 6 * i;
    const double d = (p[0] - p[3]) * (p[0] - p[3]) + (p[1] - p[4]) * (p[1] - p[4]) + (p[2] - p[5]) * (p[2] - p[5]);
    CHECK(fabs(d - answer.squared_distance[i]) < 1e-12 && d < 0.36 * 1.0001);
  }
  question.fields = -1;
  question.reduced = 1;
  CHECK(wf_proximity(session, 0.6, &question, &answer, sizeof answer) == WF_OK);
  CHECK(answer.multiplicity != NULL && answer.stencil != NULL && answer.rows <= answer.vf + answer.ee);
  CHECK(wf_vertex_distances(session, 0.6, NULL, &answer, sizeof answer) == WF_OK && answer.distances == 6);
  CHECK(answer.vertex_distances[3] <= 0.5 && answer.vertex_distances[3] > 0.4999 && answer.rows == 0);
  CHECK(wf_intersections(session, NULL, &answer, sizeof answer) == WF_OK && answer.ef == 0);
  CHECK(wf_place(session, &back) == WF_OK);
  /* Half of this motion has the triangles in one plane: all of three edges meet the face that they cross. */
  CHECK(wf_trial(session, &there, NULL, &answer, sizeof answer) == WF_OK && answer.rows == 3);
  CHECK(wf_commit(session, 0.5) == WF_OK);
  CHECK(wf_intersections(session, NULL, &answer, sizeof answer) == WF_OK && answer.ef == answer.rows && answer.rows > 0);
  CHECK(answer.kind[0] == WF_EDGE_FACE && answer.vertices[0] != answer.vertices[2]);
  wf_free(session);
}

static void test_parts_and_bodies(void) {
  wf_scene scene = triangles();
  wf_body bodies[3];
  for (int b = 0; b < 3; ++b) wf_body_init(&bodies[b], sizeof bodies[b]);
  bodies[0].vertex_count = bodies[1].vertex_count = 3;
  bodies[0].name = "sheet";
  bodies[1].kind = WF_RIGID;
  bodies[2].kind = WF_STATIC;
  bodies[2].is_half_space = 1;
  bodies[2].point[2] = -0.5;
  bodies[2].normal[2] = 1;
  scene.bodies = bodies;
  scene.body_count = 3;
  wf_session* session = created(&scene, NULL);
  wf_frame frame;
  wf_frame_init(&frame, sizeof frame);
  const uint32_t rigid = 1;
  const double pose[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -2};
  frame.pose_bodies = &rigid;
  frame.pose_count = 1;
  frame.poses = pose;
  wf_answer answer;
  CHECK(wf_trial(session, &frame, NULL, &answer, sizeof answer) == WF_OK);
  CHECK(answer.vf == 1 && answer.ee == 2 && answer.vh == 3);
  CHECK(answer.kind[answer.rows - 1] == WF_VERTEX_HALF_SPACE && answer.features[2 * answer.rows - 1] == 2);
  const uint32_t sheet = 0, one = 0;
  double lifted[9];
  memcpy(lifted, before, sizeof lifted);
  for (int v = 0; v < 3; ++v) lifted[3 * v + 2] = 2;
  wf_frame_init(&frame, sizeof frame);
  frame.bodies = &sheet;
  frame.body_count = 1;
  frame.body_positions = lifted;
  CHECK(wf_trial(session, &frame, NULL, &answer, sizeof answer) == WF_OK && answer.vf == 1 && answer.ee == 2);
  wf_frame_init(&frame, sizeof frame);
  frame.vertices = &one;
  frame.vertex_count = 1;
  frame.vertex_positions = lifted;
  CHECK(wf_step(session, &frame, NULL, NULL, 0) == WF_OK);
  double at[18];
  CHECK(wf_positions(session, at, 18) == WF_OK && at[2] == 2 && at[5] == 0);
  frame.positions = after;
  REFUSED(wf_step(session, &frame, NULL, NULL, 0), WF_INVALID_ARGUMENT, "frame 2: ");
  wf_frame_init(&frame, sizeof frame);
  frame.body_count = 1;
  REFUSED(wf_step(session, &frame, NULL, NULL, 0), WF_INVALID_ARGUMENT, "bodies: is null");
  const uint32_t nobody = 7;
  frame.bodies = &nobody;
  REFUSED(wf_step(session, &frame, NULL, NULL, 0), WF_INVALID_ARGUMENT, "body 7 is not in [0, 3)");
  wf_free(session);
  bodies[1].kind = 9;
  REFUSED(wf_create(&scene, NULL, &session), WF_INVALID_ARGUMENT, "bodies[1].kind: 9");
  CHECK(session == NULL);
}

static void turn(double angle, double pose[12]) {
  const double about_z[12] = {cos(angle), 0 - sin(angle), 0, 0, sin(angle), cos(angle), 0, 0, 0, 0, 1, 0};
  memcpy(pose, about_z, sizeof about_z);
}

/* Two rigid triangles that turn, the second along a screw, and a static ground. */
static void test_poses(void) {
  wf_body bodies[3];
  for (int b = 0; b < 3; ++b) {
    wf_body_init(&bodies[b], sizeof bodies[b]);
    bodies[b].kind = b == 2 ? WF_STATIC : WF_RIGID;
    bodies[b].vertex_count = b == 2 ? 0 : 3;
  }
  bodies[1].screw = 1;
  bodies[2].is_half_space = 1;
  bodies[2].point[2] = -9;
  bodies[2].normal[2] = 1;
  wf_scene scene = triangles();
  scene.bodies = bodies;
  scene.body_count = 3;
  wf_session* session = created(&scene, NULL);
  const uint32_t rigid[2] = {0, 1};
  double poses[24], here[12], told[36], way[12];
  turn(0, here);
  turn(0.8, poses);
  turn(1.2, poses + 12);
  wf_frame frame;
  wf_frame_init(&frame, sizeof frame);
  frame.pose_bodies = rigid;
  frame.pose_count = 2;
  frame.poses = poses;
  CHECK(wf_trial(session, &frame, NULL, NULL, 0) == WF_OK && wf_poses(session, told, 36) == WF_OK);
  for (int b = 0; b < 3; ++b) CHECK(memcmp(told + 12 * b, here, sizeof here) == 0);
  CHECK(wf_commit(session, 0.3) == WF_OK && wf_poses(session, told, 36) == WF_OK);
  CHECK(wf_part_way(here, poses, 12, 0.3, WF_FLOAT64, way) == WF_OK && memcmp(told, way, sizeof way) == 0);
  CHECK(wf_screw_way(here, poses + 12, 0.3, WF_FLOAT64, way) == WF_OK && memcmp(told + 12, way, sizeof way) == 0);
  CHECK(fabs(way[0] - cos(0.36)) < 1e-12 && memcmp(told + 24, here, sizeof here) == 0);
  double at[18];
  CHECK(wf_positions(session, at, 18) == WF_OK && fabs(at[10] - (way[4] * .25 + way[5] * .25)) < 1e-12);
  CHECK(wf_screw_way(here, poses, 0.3, WF_FLOAT32, here) == WF_OK && here[0] == (float)here[0]);
  REFUSED(wf_poses(session, told, 35), WF_INVALID_ARGUMENT, "36 are needed");
  REFUSED(wf_part_way(poses, poses, 12, 1.5, WF_FLOAT64, way), WF_INVALID_ARGUMENT, "fraction: 1.5");
  REFUSED(wf_part_way(poses, NULL, 12, 1, WF_FLOAT64, way), WF_INVALID_ARGUMENT, "is null");
  REFUSED(wf_screw_way(poses, poses, 1, 2, way), WF_INVALID_ARGUMENT, "type: 2");
  poses[0] = 3;
  REFUSED(wf_screw_way(way, poses, 1, WF_FLOAT64, way), WF_INVALID_ARGUMENT, "to: is not rigid");
  wf_free(session);
}

static void test_float32(void) {
  float x0[18], x1[18];
  for (int i = 0; i < 18; ++i) {
    x0[i] = (float)before[i];
    x1[i] = (float)after[i];
  }
  wf_scene scene = triangles();
  scene.positions = x0;
  scene.type = WF_FLOAT32;
  wf_session* session = created(&scene, NULL);
  wf_frame frame;
  wf_frame_init(&frame, sizeof frame);
  frame.positions = x1;
  wf_answer answer;
  CHECK(wf_trial(session, &frame, NULL, &answer, sizeof answer) == WF_OK && answer.rows == 3);
  CHECK(wf_commit(session, 1 / 3.0) == WF_OK);
  double at[18];
  CHECK(wf_positions(session, at, 18) == WF_OK && at[11] == (float)(1 + 1 / 3.0 * -2.0));
  wf_free(session);
}

static void test_refusals(void) {
  wf_session* session = NULL;
  REFUSED(wf_create(NULL, NULL, &session), WF_INVALID_ARGUMENT, "scene: is null");
  wf_scene scene = triangles();
  REFUSED(wf_create(&scene, NULL, NULL), WF_INVALID_ARGUMENT, "session: is null");
  static const int32_t beyond[6] = {0, 1, 2, 3, 4, 6};
  scene.faces = beyond;
  REFUSED(wf_create(&scene, NULL, &session), WF_INVALID_ARGUMENT, "faces[1]");
  scene = triangles();
  scene.faces = NULL;
  REFUSED(wf_create(&scene, NULL, &session), WF_INVALID_ARGUMENT, "faces: is null");
  scene = triangles();
  scene.type = 2;
  REFUSED(wf_create(&scene, NULL, &session), WF_INVALID_ARGUMENT, "type: 2");
  scene = triangles();
  scene.size = 0;
  REFUSED(wf_create(&scene, NULL, &session), WF_INVALID_ARGUMENT, "wf_scene_init");
  double nowhere[18];
  memcpy(nowhere, before, sizeof nowhere);
  nowhere[4] = NAN;
  scene = triangles();
  scene.positions = nowhere;
  REFUSED(wf_create(&scene, NULL, &session), WF_INVALID_ARGUMENT, "positions[1].y: is not a number");
  scene = triangles();
  wf_options options;
  wf_options_init(&options, sizeof options);
  options.tolerance = 7;
  REFUSED(wf_create(&scene, &options, &session), WF_INVALID_ARGUMENT, "tolerance");
  wf_options_init(&options, sizeof options);
  options.fields = 64;
  REFUSED(wf_create(&scene, &options, &session), WF_INVALID_ARGUMENT, "options.fields: 64");
  CHECK(session == NULL);

  REFUSED(wf_step(NULL, NULL, NULL, NULL, 0), WF_INVALID_ARGUMENT, "session: is null");
  REFUSED(wf_commit(NULL, 1), WF_INVALID_ARGUMENT, "session: is null");
  wf_options_init(&options, sizeof options);
  options.max_contacts = 2;
  session = created(&scene, &options);
  const wf_frame there = to(after), bad = to(nowhere);
  REFUSED(wf_step(session, &there, NULL, NULL, 0), WF_RESOURCE_EXHAUSTED, "contacts");
  REFUSED(wf_step(session, &bad, NULL, NULL, 0), WF_INVALID_ARGUMENT, "frame 1: positions[1].y");
  wf_question question;
  wf_question_init(&question, sizeof question);
  question.where = WF_TRIAL_END;
  REFUSED(wf_trial(session, &there, &question, NULL, 0), WF_INVALID_ARGUMENT, "question.where");
  REFUSED(wf_proximity(session, 0.5, &question, NULL, 0), WF_FAILED_PRECONDITION, "trial");
  wf_question_init(&question, sizeof question);
  question.keep_distance = 0.5;
  REFUSED(wf_trial(session, &there, &question, NULL, 0), WF_INVALID_ARGUMENT, "question.keep_distance");
  wf_question_init(&question, sizeof question);
  question.tier = 3;
  REFUSED(wf_trial(session, &there, &question, NULL, 0), WF_INVALID_ARGUMENT, "question.tier: 3 is not in [0, 2]");
  wf_flag* flag;
  CHECK(wf_flag_create(&flag) == WF_OK);
  wf_flag_set(flag, 1);
  wf_question_init(&question, sizeof question);
  question.cancelled = flag;
  question.report = WF_COUNT;
  REFUSED(wf_step(session, &there, &question, NULL, 0), WF_CANCELLED, "cancelled");
  wf_flag_set(flag, 0);
  wf_answer answer;
  /* Nothing of this has moved anything. */
  CHECK(wf_step(session, &there, &question, &answer, sizeof answer) == WF_OK && answer.frame == 1 && answer.vf == 1);
  CHECK(answer.rows == 0 && answer.kind == NULL);
  wf_flag_free(flag);
  wf_flag_free(NULL);
  wf_free(session);
  wf_free(NULL);
}

/* Of a program that was built with an earlier, shorter struct: what is beyond is neither read nor written. */
static void test_shorter_structs(void) {
  const wf_scene scene = triangles();
  wf_session* session = created(&scene, NULL);
  const wf_frame there = to(after);
  wf_question question;
  memset(&question, 0x5a, sizeof question);
  wf_question_init(&question, offsetof(wf_question, report));
  CHECK(question.size == offsetof(wf_question, report) && question.tier == -1 && question.report == 0x5a5a5a5a);
  question.tier = WF_EXACT;
  wf_answer answer;
  memset(&answer, 0x5a, sizeof answer);
  CHECK(wf_step(session, &there, &question, &answer, offsetof(wf_answer, kind)) == WF_OK);
  CHECK(answer.rows == 3 && memcmp(&answer.kind, "\x5a\x5a\x5a\x5a", 4) == 0 && memcmp(&answer.ms, "\x5a\x5a\x5a\x5a", 4) == 0);
  wf_free(session);
}

/* Of a program that was built with a later, longer struct: what this library does not know is 0, or refused. */
static void test_longer_structs(void) {
  const wf_frame there = to(after);
  wf_answer answer;
  struct {
    wf_body body;
    double more[3];
  } longer[2];
  memset(longer, 0x5a, sizeof longer);
  for (int b = 0; b < 2; ++b) {
    wf_body_init(&longer[b].body, sizeof longer[b]);
    CHECK(longer[b].body.size == sizeof longer[b] && longer[b].more[0] == 0 && longer[b].more[2] == 0);
    longer[b].body.vertex_count = 3;
  }
  wf_scene two = triangles();
  two.bodies = &longer[0].body;
  two.body_count = 2;
  wf_session* session = created(&two, NULL);
  CHECK(wf_step(session, &there, NULL, &answer, sizeof answer) == WF_OK && answer.rows == 3);
  struct {
    wf_answer answer;
    double more;
  } more;
  memset(&more, 0x5a, sizeof more);
  CHECK(wf_proximity(session, 3, NULL, &more.answer, sizeof more) == WF_OK && more.answer.rows > 0 &&
        more.more == 0);
  wf_free(session);

  longer[1].more[2] = 1;
  REFUSED(wf_create(&two, NULL, &session), WF_UNIMPLEMENTED, "bodies[1]: body: what is behind the");
  longer[1].more[2] = 0;
  longer[1].body.size = (size_t)-1;
  REFUSED(wf_create(&two, NULL, &session), WF_INVALID_ARGUMENT,
          "bodies[1]: body.size: is 18446744073709551615; initialize");
}

int main(void) {
  CHECK(strcmp(wf_last_error(), "") == 0 && strchr(wf_version(), '.') != NULL);
  test_questions();
  test_parts_and_bodies();
  test_poses();
  test_float32();
  test_refusals();
  test_shorter_structs();
  test_longer_structs();
  return all_right();
}
