/* SPDX-License-Identifier: Apache-2.0
 * What in_process_bench.py gives the programs in C and C++ that it compares: one file, native numbers. */
#ifndef WARMFRONT_TESTS_BENCH_IN_PROCESS_STEPS_H
#define WARMFRONT_TESTS_BENCH_IN_PROCESS_STEPS_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct steps {
  uint32_t vertices, faces, frames;
  float* positions; /* (frames, vertices, 3) */
  int32_t* indices; /* (faces, 3) */
} steps;

static inline steps read_steps(const char* path) {
  steps all;
  FILE* file = fopen(path, "rb");
  uint32_t counts[3];
  if (file == NULL || fread(counts, sizeof counts[0], 3, file) != 3) exit(2);
  all.vertices = counts[0];
  all.faces = counts[1];
  all.frames = counts[2];
  const size_t numbers = (size_t)3 * all.vertices * all.frames, corners = (size_t)3 * all.faces;
  all.positions = (float*)malloc(numbers * sizeof(float));
  all.indices = (int32_t*)malloc(corners * sizeof(int32_t));
  if (all.positions == NULL || all.indices == NULL || fread(all.indices, sizeof(int32_t), corners, file) != corners ||
      fread(all.positions, sizeof(float), numbers, file) != numbers)
    exit(2);
  fclose(file);
  return all;
}

static inline double seconds(void) {
  struct timespec now;
  timespec_get(&now, TIME_UTC);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

#endif
