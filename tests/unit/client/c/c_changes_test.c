/* SPDX-License-Identifier: Apache-2.0
 * The C interface's changes of a scene between frames, from C: what each does, all or none, and what is refused in which words. */
#include <math.h>

#include "c_check.h"

/* The two triangles as two bodies: "sheet", below, and "falling". */
static wf_session* two_bodies(const wf_options* options) {
  static wf_body bodies[2];
  wf_scene scene = triangles();
  for (int b = 0; b < 2; ++b) {
    wf_body_init(&bodies[b], sizeof bodies[b]);
    bodies[b].vertex_count = 3;
    bodies[b].name = b == 0 ? "sheet" : "falling";
  }
  scene.bodies = bodies;
  scene.body_count = 2;
  return created(&scene, options);
}
static wf_change changed(int32_t what) {
  wf_change change;
  wf_change_init(&change, sizeof change);
  change.what = what;
  return change;
}
/* Of a body: where it rests, and its faces. */
static wf_change meshed(int32_t what, const double* positions, uint32_t vertices, const int32_t* with, size_t count) {
  wf_change change = changed(what);
  change.vertex_count = vertices;
  change.positions = positions;
  change.faces = with;
  change.face_count = count;
  return change;
}
static wf_code one_change(wf_session* session, const wf_change* change) {
  return wf_change_scene(session, change, 1, NULL, NULL);
}
static wf_counts counted(const wf_session* session) {
  wf_counts counts;
  CHECK(wf_count(session, &counts, sizeof counts) == WF_OK);
  return counts;
}
/* How many contacts the motion to these positions has. */
static size_t met(wf_session* session, const double* to_here) {
  const wf_frame there = to(to_here);
  wf_answer answer;
  CHECK(wf_trial(session, &there, NULL, &answer, sizeof answer) == WF_OK);
  return answer.rows;
}

/* A third triangle below the sheet: the falling one goes on to meet it. */
static const int32_t face[3] = {0, 1, 2};
static const double lower[9] = {0, 0, -0.5, 1, 0, -0.5, 0, 1, -0.5};

static void test_add_change_remove(void) {
  wf_session* session = two_bodies(NULL);
  CHECK(met(session, after) == 3);
  wf_change add = meshed(WF_ADD_BODY, lower, 3, face, 1);
  wf_body body;
  wf_body_init(&body, sizeof body);
  body.name = "lower";
  body.kind = WF_STATIC;
  add.body = &body;
  CHECK(one_change(session, &add) == WF_OK);
  wf_counts counts = counted(session);
  CHECK(counts.bodies == 3 && counts.vertices == 9 && counts.faces == 3 && counts.edges == 9 && counts.frame == 0);
  double at[27];
  CHECK(wf_positions(session, at, 27) == WF_OK && memcmp(at + 18, lower, sizeof lower) == 0);
  memcpy(at, after, sizeof after);
  CHECK(met(session, at) == 6);
  CHECK(one_change(session, &add) == WF_OK);
  REFUSED(wf_commit(session, 1), WF_FAILED_PRECONDITION, "trial");

  wf_change others = changed(WF_CHANGE_BODY); /* the sheet's: meets nothing of group 1 */
  body.kind = WF_DEFORMABLE;
  body.group = body.mask = 2;
  others.body = &body;
  CHECK(one_change(session, &others) == WF_OK);
  double four[36];
  memcpy(four, after, sizeof after);
  memcpy(four + 18, lower, sizeof lower);
  memcpy(four + 27, lower, sizeof lower);
  CHECK(met(session, four) == 6); /* with either copy of the lower one */
  wf_change removed = changed(WF_CHANGE_BODY);
  body.kind = WF_REMOVED;
  removed.index = 3;
  removed.body = &body;
  CHECK(one_change(session, &removed) == WF_OK && met(session, four) == 3);
  REFUSED(one_change(session, &removed), WF_INVALID_ARGUMENT, "changes[0]: body 3 (\"lower\") was removed");
  counts = counted(session);
  CHECK(counts.bodies == 4 && counts.vertices == 12); /* which keep their numbers */

  wf_change freed = changed(WF_REPLACE_BODY); /* and now they are free */
  freed.index = 3;
  freed.body = &body;
  CHECK(one_change(session, &freed) == WF_OK);
  counts = counted(session);
  CHECK(counts.bodies == 4 && counts.vertices == 9 && counts.faces == 3);
  const wf_frame there = to(four);
  CHECK(wf_step(session, &there, NULL, NULL, 0) == WF_OK && counted(session).frame == 1);
  wf_free(session);
}

static void test_replace(void) {
  wf_session* session = two_bodies(NULL);
  /* The sheet in two, without other vertices, and then with a fourth one; the description stays. */
  wf_change elements = changed(WF_REPLACE_ELEMENTS);
  static const int32_t sides[4] = {0, 1, 1, 2};
  elements.edges = sides;
  elements.edge_count = 2;
  CHECK(one_change(session, &elements) == WF_OK && counted(session).faces == 1 && counted(session).edges == 5);
  const uint32_t* edges;
  size_t edge_count;
  CHECK(wf_edges(session, &edges, &edge_count) == WF_OK && edge_count == 5 && edges[2] == 1 && edges[3] == 2);
  CHECK(met(session, after) == 2); /* two sides of the falling face, and the edge (1, 2), which is in their way */

  static const double square[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  static const int32_t halves[6] = {0, 1, 2, 2, 1, 3};
  wf_change mesh = meshed(WF_REPLACE_BODY, square, 4, halves, 2);
  /* Both in one list, with a description between them that the second one keeps. */
  wf_body body;
  wf_body_init(&body, sizeof body);
  body.kind = WF_STATIC;
  body.thickness = 0.25;
  wf_change list[3] = {elements, changed(WF_CHANGE_BODY), mesh};
  list[1].body = &body;
  CHECK(wf_change_scene(session, list, 3, NULL, NULL) == WF_OK);
  CHECK(counted(session).vertices == 7 && counted(session).faces == 3 && counted(session).bodies == 2);
  double at[21];
  memcpy(at, square, sizeof square);
  memcpy(at + 12, after + 9, sizeof lower);
  const wf_frame there = to(at);
  wf_answer answer;
  CHECK(wf_trial(session, &there, NULL, &answer, sizeof answer) == WF_OK && answer.rows > 0);
  CHECK((answer.vertices[0] >= 4) != (answer.vertices[1] >= 4)); /* the falling one's vertices come behind */
  CHECK(answer.earliest_toi > 0.37 && answer.earliest_toi <= 0.375); /* 0.25 above it: it is thick still */
  at[2] = 1;
  REFUSED(wf_step(session, &there, NULL, NULL, 0), WF_INVALID_ARGUMENT, "static");
  wf_free(session);

  /* Of a scene without declared bodies, index 0 is all of it. */
  const wf_scene scene = triangles();
  session = created(&scene, NULL);
  wf_change other = changed(WF_REPLACE_ELEMENTS);
  other.faces = faces;
  other.face_count = 1;
  CHECK(one_change(session, &other) == WF_OK && counted(session).faces == 1 && counted(session).bodies == 0);
  CHECK(met(session, after) == 1); /* the first face, and a point that was a corner */
  REFUSED(one_change(session, &mesh), WF_FAILED_PRECONDITION, "changes[0]: bodies: the scene declares none");
  wf_free(session);
}

static void test_what_does_not_count(void) {
  wf_session* session = two_bodies(NULL);
  wf_change filters = changed(WF_CHANGE_FILTERS);
  static const uint32_t patches[6] = {1, 1, 1, 1, 1, 1};
  filters.patches = patches;
  filters.vertex_count = 6;
  CHECK(one_change(session, &filters) == WF_OK && met(session, after) == 0);
  filters = changed(WF_CHANGE_FILTERS);
  static const uint32_t sewn[2] = {0, 3};
  filters.excluded_vertex_pairs = sewn;
  filters.excluded_vertex_pair_count = 1;
  CHECK(one_change(session, &filters) == WF_OK && met(session, after) == 2); /* but no corner 3 */
  filters = changed(WF_CHANGE_FILTERS); /* none */
  CHECK(one_change(session, &filters) == WF_OK && met(session, after) == 3);
  filters.near_at_rest = 10;
  REFUSED(one_change(session, &filters), WF_INVALID_ARGUMENT, "changes[0]: filters.rest_positions");
  filters.rest_positions = before;
  filters.vertex_count = 6;
  CHECK(one_change(session, &filters) == WF_OK && met(session, after) == 0);

  wf_change pairs[2] = {changed(WF_CHANGE_FILTERS), changed(WF_CHANGE_EXCLUDED_PAIRS)};
  static const uint32_t both[2] = {0, 1};
  pairs[1].excluded_pairs = both;
  pairs[1].excluded_pair_count = 1;
  CHECK(wf_change_scene(session, pairs, 2, NULL, NULL) == WF_OK && met(session, after) == 0);
  CHECK(one_change(session, &pairs[0]) == WF_OK && met(session, after) == 0); /* pairs stay */
  pairs[1] = changed(WF_CHANGE_EXCLUDED_PAIRS);
  CHECK(one_change(session, &pairs[1]) == WF_OK && met(session, after) == 3);
  wf_free(session);
}

static void test_options(void) {
  wf_options options;
  wf_options_init(&options, sizeof options);
  options.threads = 2;
  wf_session* session = two_bodies(&options);
  wf_options_init(&options, sizeof options);
  options.min_separation = 0.5;
  options.fields = WF_NORMAL;
  CHECK(wf_change_scene(session, NULL, 0, &options, NULL) == WF_OK);
  const wf_frame there = to(after);
  wf_answer answer;
  CHECK(wf_trial(session, &there, NULL, &answer, sizeof answer) == WF_OK && answer.normal != NULL);
  CHECK(answer.earliest_toi > 0.2499 && answer.earliest_toi <= 0.25);
  options.threads = 2; /* what it was */
  CHECK(wf_change_scene(session, NULL, 0, &options, NULL) == WF_OK);
  options.threads = 1;
  REFUSED(wf_change_scene(session, NULL, 0, &options, NULL), WF_INVALID_ARGUMENT, "options.threads: is 1, and the session has 2");
  options.threads = 0;
  options.tolerance = 7;
  REFUSED(wf_change_scene(session, NULL, 0, &options, NULL), WF_INVALID_ARGUMENT, "options.tolerance: 7");
  options.tolerance = 1e-6;
  options.tier = WF_FAST;
  REFUSED(wf_change_scene(session, NULL, 0, &options, NULL), WF_INVALID_ARGUMENT, "options.min_separation");
  CHECK(wf_change_scene(session, NULL, 0, NULL, NULL) == WF_OK); /* nothing */
  wf_free(session);
}

/* Of a list that fails, nothing is carried out. */
static void test_all_or_none(void) {
  wf_session* session = two_bodies(NULL);
  const wf_counts first = counted(session);
  wf_body body;
  wf_body_init(&body, sizeof body);
  wf_change add = meshed(WF_ADD_BODY, lower, 3, face, 1);
  wf_options options;
  wf_options_init(&options, sizeof options);
  options.report = WF_COUNT;
  wf_change list[2] = {add, changed(WF_CHANGE_BODY)};
#define FAILS(code, words) REFUSED(wf_change_scene(session, list, 2, &options, NULL), code, words)
  list[1].body = &body;
  list[1].index = 7;
  FAILS(WF_INVALID_ARGUMENT, "changes[1]: index: body 7 is not in [0, 3)");
  list[1].index = 2; /* which the first one adds */
  body.kind = 5;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].body.kind: 5 is not in [0, 3]");
  body.kind = WF_DEFORMABLE;
  list[1].body = NULL;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].body: is null");
  list[1] = add;
  static const int32_t beyond[3] = {0, 1, 3};
  list[1].faces = beyond;
  FAILS(WF_INVALID_ARGUMENT, "changes[1]: bodies[3]: faces[0]");
  list[1] = add;
  list[1].positions = NULL;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].positions: is null, and 9 numbers are expected");
  double nowhere[9];
  memcpy(nowhere, lower, sizeof nowhere);
  nowhere[7] = INFINITY;
  list[1].positions = nowhere;
  FAILS(WF_INVALID_ARGUMENT, "changes[1]: positions[2].y");
  list[1] = add;
  list[1].body = &body;
  body.vertex_count = 4;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].body.vertex_count: is 4, and the change's vertex_count is 3");
  body.vertex_count = 3;
  list[1].excluded_pair_count = 1;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].excluded_pairs: a WF_ADD_BODY has no use for it");
  list[1] = add;
  list[1].index = 2;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].index: a WF_ADD_BODY");
  list[1] = add;
  list[1].face_count = 0;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].faces: is given, and face_count is 0; say how many there are, or give NULL");
  const uint32_t some[2] = {0, 1};
  wf_change_init(&list[1], sizeof list[1]);
  list[1].what = WF_CHANGE_FILTERS;
  list[1].patches = some;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].patches: is given, and vertex_count is 0");
  list[1] = add;
  list[1].what = 6;
  FAILS(WF_INVALID_ARGUMENT, "changes[1].what: 6 is not in [0, 5]");
  list[1] = add;
  list[1].size = 0;
  FAILS(WF_INVALID_ARGUMENT, "changes[1]: change.size: is 0; initialize the struct with wf_change_init");
  list[1] = add;
  options.max_contacts = 0;
  options.tier = 9;
  FAILS(WF_INVALID_ARGUMENT, "options.tier: 9");
#undef FAILS
  REFUSED(wf_change_scene(session, NULL, 1, NULL, NULL), WF_INVALID_ARGUMENT, "changes: is null");
  REFUSED(wf_change_scene(NULL, &add, 1, NULL, NULL), WF_INVALID_ARGUMENT, "session: is null");
  REFUSED(wf_count(session, NULL, 0), WF_INVALID_ARGUMENT, "counts: is null");
  wf_flag* flag;
  CHECK(wf_flag_create(&flag) == WF_OK);
  wf_flag_set(flag, 1);
  REFUSED(wf_change_scene(session, &add, 1, NULL, flag), WF_CANCELLED, "cancelled");
  const wf_counts last = counted(session);
  CHECK(memcmp(&first, &last, sizeof first) == 0 && met(session, after) == 3);
  wf_flag_set(flag, 0);
  CHECK(wf_change_scene(session, &add, 1, NULL, flag) == WF_OK && counted(session).bodies == 3);
  wf_flag_free(flag);
  wf_free(session);
}

static void test_float32_and_other_sizes(void) {
  float x0[18], x1[27], third[9];
  for (int i = 0; i < 18; ++i) {
    x0[i] = (float)before[i];
    x1[i] = (float)after[i];
  }
  for (int i = 0; i < 9; ++i) x1[18 + i] = third[i] = (float)lower[i];
  wf_body bodies[2];
  wf_scene scene = triangles();
  for (int b = 0; b < 2; ++b) {
    wf_body_init(&bodies[b], sizeof bodies[b]);
    bodies[b].vertex_count = 3;
  }
  scene.bodies = bodies;
  scene.body_count = 2;
  scene.positions = x0;
  scene.type = WF_FLOAT32;
  wf_session* session = created(&scene, NULL);
  /* Changes that are longer than this library's, and an answer that is shorter. */
  struct {
    wf_change change;
    double more[3];
  } longer[2];
  memset(longer, 0, sizeof longer);
  for (int i = 0; i < 2; ++i) {
    longer[i].change = changed(i == 0 ? WF_ADD_BODY : WF_CHANGE_EXCLUDED_PAIRS);
    longer[i].change.size = sizeof longer[i];
  }
  longer[0].change.vertex_count = 3;
  longer[0].change.positions = third;
  longer[0].change.faces = face;
  longer[0].change.face_count = 1;
  static const uint32_t pair[2] = {2, 1};
  longer[1].change.excluded_pairs = pair;
  longer[1].change.excluded_pair_count = 1;
  wf_frame frame;
  wf_frame_init(&frame, sizeof frame);
  frame.positions = x1;
  wf_answer answer;
  CHECK(wf_change_scene(session, &longer[0].change, 1, NULL, NULL) == WF_OK);
  CHECK(wf_trial(session, &frame, NULL, &answer, sizeof answer) == WF_OK && answer.rows == 6);
  CHECK(wf_change_scene(session, &longer[0].change, 2, NULL, NULL) == WF_OK); /* a fourth one; 1 and 2 do not meet */
  wf_counts counts;
  memset(&counts, 0x5a, sizeof counts);
  CHECK(wf_count(session, &counts, offsetof(wf_counts, edges)) == WF_OK && counts.faces == 4 && counts.vertices == 12);
  CHECK(memcmp(&counts.edges, "\x5a\x5a\x5a\x5a", 4) == 0);
  wf_free(session);
}

int main(void) {
  test_add_change_remove();
  test_replace();
  test_what_does_not_count();
  test_options();
  test_all_or_none();
  test_float32_and_other_sizes();
  return all_right();
}
