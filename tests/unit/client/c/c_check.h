/* SPDX-License-Identifier: Apache-2.0
 * What the tests in C share: checks that are counted, and two triangles. */
#ifndef C_CHECK_H
#define C_CHECK_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "client/c/warmfront.h"

static int failures = 0;
#define CHECK(condition)                                                                        \
  do {                                                                                          \
    if (!(condition)) {                                                                         \
      ++failures;                                                                               \
      fprintf(stderr, "%s:%d: %s (last error: %s)\n", __FILE__, __LINE__, #condition, wf_last_error()); \
    }                                                                                           \
  } while (0)
#define REFUSED(call, code, words) CHECK((call) == (code) && strstr(wf_last_error(), words) != NULL)

/* The second triangle falls through the first, which stays. */
static const double before[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, .25, .25, 1, 1.25, .25, 1, .25, 1.25, 1};
static const double after[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, .25, .25, -1, 1.25, .25, -1, .25, 1.25, -1};
static const int32_t faces[6] = {0, 1, 2, 3, 4, 5};

static inline wf_scene triangles(void) {
  wf_scene scene;
  wf_scene_init(&scene, sizeof scene);
  scene.positions = before;
  scene.vertex_count = 6;
  scene.faces = faces;
  scene.face_count = 2;
  return scene;
}
static inline wf_session* created(const wf_scene* scene, const wf_options* options) {
  wf_session* session = NULL;
  CHECK(wf_create(scene, options, &session) == WF_OK);
  if (session == NULL) exit(1);
  return session;
}
static inline wf_frame to(const double* positions) {
  wf_frame frame;
  wf_frame_init(&frame, sizeof frame);
  frame.positions = positions;
  return frame;
}
static inline int all_right(void) {
  if (failures == 0) printf("all right\n");
  return failures == 0 ? 0 : 1;
}

#endif
