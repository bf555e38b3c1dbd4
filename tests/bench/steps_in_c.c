/* SPDX-License-Identifier: Apache-2.0
 * steps_in_c FILE ROUNDS THREADS: the steps of the file through the C interface; prints of each round the seconds, then the rows
 * told. */
#include "client/c/warmfront.h"
#include "tests/bench/in_process_steps.h"

int main(int count, char** arguments) {
  if (count != 4) return 3;
  const steps all = read_steps(arguments[1]);
  wf_options options;
  wf_options_init(&options, sizeof options);
  options.threads = (uint32_t)atoi(arguments[3]);
  unsigned long long told = 0;
  for (int round = 0; round < atoi(arguments[2]); ++round) {
    wf_scene scene;
    wf_scene_init(&scene, sizeof scene);
    scene.positions = all.positions;
    scene.type = WF_FLOAT32;
    scene.vertex_count = all.vertices;
    scene.faces = all.indices;
    scene.face_count = all.faces;
    wf_session* session;
    if (wf_create(&scene, &options, &session) != WF_OK) return 2;
    const double begin = seconds();
    for (uint32_t k = 1; k < all.frames; ++k) {
      wf_frame frame;
      wf_frame_init(&frame, sizeof frame);
      frame.positions = all.positions + (size_t)3 * all.vertices * k;
      wf_answer answer;
      if (wf_step(session, &frame, NULL, &answer, sizeof answer) != WF_OK) return 2;
      told += answer.rows;
    }
    printf("%.9f\n", seconds() - begin);
    wf_free(session);
  }
  printf("%llu\n", told);
  return 0;
}
