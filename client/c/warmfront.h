/* SPDX-License-Identifier: Apache-2.0
 *
 * Warmfront for C, and for whatever calls C: continuous collision detection in this process.
 *
 *   wf_scene scene;
 *   wf_scene_init(&scene, sizeof scene);
 *   scene.positions = x0; scene.vertex_count = n; scene.faces = faces; scene.face_count = m;
 *   wf_session* session;
 *   if (wf_create(&scene, NULL, &session) != WF_OK) fail(wf_last_error());
 *   wf_frame frame;
 *   wf_frame_init(&frame, sizeof frame);
 *   frame.positions = x1;
 *   wf_answer answer;
 *   if (wf_step(session, &frame, NULL, &answer, sizeof answer) != WF_OK) fail(wf_last_error());
 *   for (size_t i = 0; i < answer.rows; ++i) use(answer.kind[i], answer.vertices + 4 * i, answer.toi[i]);
 *   wf_free(session);
 *
 * Every function but those that return nothing returns a code; the text that belongs to it is wf_last_error(). What fails
 * leaves the session as it was. No exception and no signal leaves the library. A session is used by one thread at a time;
 * different sessions are independent, and share the threads of the process. All arrays are row-major, and of the caller: they
 * are looked at during the call alone. Lengths are in the scene's unit, times in [0, 1] of the step.
 *
 * Structs that are given grow at their end in later versions: initialize them with their size as the caller knows it. Those that
 * are filled take the size, too, and nothing beyond it is written. What a newer header has and an older library does not know is
 * 0 after initialization and in an answer; a library that is asked for more fails with WF_UNIMPLEMENTED.
 */
#ifndef WARMFRONT_H
#define WARMFRONT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define WF_API __attribute__((visibility("default")))
#else
#define WF_API
#endif

/* Canonical codes, by their numbers in gRPC. */
typedef int32_t wf_code;
enum {
  WF_OK = 0,
  WF_CANCELLED = 1,           /* by a flag */
  WF_INVALID_ARGUMENT = 3,    /* the text names the field and the first offender */
  WF_RESOURCE_EXHAUSTED = 8,  /* a stated limit was met, or there is no memory */
  WF_FAILED_PRECONDITION = 9, /* the input is valid, but not in this state */
  WF_UNIMPLEMENTED = 12,
  WF_INTERNAL = 13,
  WF_DATA_LOSS = 15
};

/* What went wrong in the last call of this thread that failed: what, where, and what to do. UTF-8, never NULL; valid until the
 * thread's next call that fails. Cut after 2,047 bytes. */
WF_API const char* wf_last_error(void);

/* "MAJOR.MINOR.PATCH". */
WF_API const char* wf_version(void);

/* Types of positions. */
enum { WF_FLOAT64 = 0, WF_FLOAT32 = 1 };

/* How a body moves. */
enum { WF_DEFORMABLE = 0, WF_RIGID = 1, WF_STATIC = 2, WF_REMOVED = 3 };

/* A range of vertices, behind those of the bodies before it; or a half-space, which has none. */
typedef struct wf_body {
  size_t size;             /* of this struct, as wf_body_init() sets it */
  const char* name;        /* NULL: none */
  uint32_t vertex_count;
  int32_t kind;            /* WF_DEFORMABLE */
  int32_t self_collision;  /* 1; of a deformable body */
  uint32_t group; /* 1; two bodies are tested when the group of each has a bit in the mask of the other */
  uint32_t mask;           /* all bits */
  uint32_t world;          /* 0: in all; bodies of two others never meet */
  double thickness;        /* 0; added to the separation of every pair that one of its vertices is in */
  int32_t screw;           /* 0; of a rigid body: moves along the screw between two poses */
  int32_t is_half_space;   /* 0; 1: all x with normal . (x - point) <= 0, WF_STATIC or WF_RIGID */
  double point[3];
  double normal[3];
} wf_body;
WF_API void wf_body_init(wf_body* body, size_t size);

/* Pointers are NULL, and counts 0, where there is nothing. */
typedef struct wf_scene {
  size_t size;
  const void* positions;      /* (vertex_count, 3), of `type`: where everything is at first, finite */
  int32_t type;               /* WF_FLOAT64; also of the positions of every frame */
  uint32_t vertex_count;
  const int32_t* faces;       /* (face_count, 3) vertices */
  size_t face_count;
  const int32_t* edges;       /* (edge_count, 2) vertices: hair and rods */
  size_t edge_count;
  const wf_body* bodies;      /* cover all vertices in order; none: everything is deformable */
  size_t body_count;
  const uint32_t* excluded_pairs; /* (excluded_pair_count, 2) bodies that are not tested against each other */
  size_t excluded_pair_count;
  const double* thickness;    /* (vertex_count), besides the bodies' */
  /* Pairs of features that do not count: see engine/pair_filters.h. */
  uint32_t within_edges;      /* 0 to 3 */
  double near_at_rest;        /* 0: off */
  const double* rest_positions;           /* (vertex_count, 3); NULL: `positions` */
  const uint32_t* excluded_vertex_pairs;  /* (excluded_vertex_pair_count, 2) */
  size_t excluded_vertex_pair_count;
  const uint32_t* patches;                /* (vertex_count) */
} wf_scene;
WF_API void wf_scene_init(wf_scene* scene, size_t size);

enum { WF_FAST = 0, WF_CERTIFIED = 1, WF_EXACT = 2 };
enum { WF_ALL = 0, WF_EARLIEST = 1, WF_COUNT = 2, WF_CANDIDATES = 3, WF_ANY = 4 };
/* Bits: what to tell of a contact besides kind, status, vertices, features and time. */
enum {
  WF_WEIGHTS = 1,
  WF_NORMAL = 2,
  WF_POINTS = 4,
  WF_DIRECTION = 8,
  WF_SQUARED_DISTANCE = 16,
  WF_CLOSEST = 32
};

/* Of a session. See engine/options.h. */
typedef struct wf_options {
  size_t size;
  int32_t tier;           /* WF_CERTIFIED */
  int32_t report;         /* WF_ALL */
  uint32_t fields;        /* 0: none */
  double tolerance;       /* 1e-6 */
  double min_separation;  /* 0 */
  uint64_t max_contacts;  /* 50,000,000: a question with more fails with WF_RESOURCE_EXHAUSTED */
  uint64_t max_front_bytes;
  uint32_t threads;       /* 0: one for each core; answers are the same bits for any number */
} wf_options;
WF_API void wf_options_init(wf_options* options, size_t size);

typedef struct wf_session wf_session;

/* options: NULL for the defaults. *session is NULL after an error. */
WF_API wf_code wf_create(const wf_scene* scene, const wf_options* options, wf_session** session);
/* NULL: nothing. */
WF_API void wf_free(wf_session* session);

/* Where everything goes: either all positions, or what moved, in any mixture; the rest rests. */
typedef struct wf_frame {
  size_t size;
  const void* positions;        /* (vertex_count, 3) of the scene's type; then nothing else */
  const uint32_t* bodies;       /* (body_count) */
  size_t body_count;
  const void* body_positions;   /* of all vertices of these bodies, one after the other */
  const uint32_t* pose_bodies;  /* (pose_count) rigid bodies */
  size_t pose_count;
  const double* poses;          /* (pose_count, 3, 4) [R t], of the shapes that they had at rest */
  const uint32_t* vertices;     /* (vertex_count) of deformable bodies, each once */
  size_t vertex_count;
  const void* vertex_positions; /* (vertex_count, 3) */
} wf_frame;
WF_API void wf_frame_init(wf_frame* frame, size_t size);

/* Stops a question from any thread: it fails with WF_CANCELLED. */
typedef struct wf_flag wf_flag;
WF_API wf_code wf_flag_create(wf_flag** flag);
WF_API void wf_flag_set(wf_flag* flag, int32_t value);
WF_API void wf_flag_free(wf_flag* flag);

enum { WF_BASE = 0, WF_TRIAL_END = 1 };

/* Options of one question; what is as wf_question_init() leaves it, is as the session has it. See engine/question.h. */
typedef struct wf_question {
  size_t size;
  int32_t tier;                /* -1 */
  int32_t report;              /* -1 */
  int64_t fields;              /* -1 */
  double tolerance;            /* NaN */
  double min_separation;       /* NaN */
  uint64_t max_contacts;       /* UINT64_MAX */
  double keep_distance;        /* NaN; of wf_max_step() */
  int32_t leave_out_overlaps;  /* 0; of wf_max_step() */
  int32_t reduced;             /* 0; of wf_proximity() */
  int32_t where;               /* WF_BASE; of questions without a motion */
  const wf_flag* cancelled;    /* NULL */
} wf_question;
WF_API void wf_question_init(wf_question* question, size_t size);

/* What a row is a pair of: the first side, then the second. `features` numbers both. */
enum {
  WF_VERTEX_FACE = 0,
  WF_EDGE_EDGE = 1,
  WF_EDGE_FACE = 2,        /* of wf_intersections() alone */
  WF_VERTEX_EDGE = 3,      /* an isolated vertex and an edge in no face; within a separation or distance */
  WF_VERTEX_VERTEX = 4,    /* two isolated vertices; the same */
  WF_VERTEX_HALF_SPACE = 5 /* the second is the half-space's body */
};
/* What is known of a row. Pairs that are proved to stay apart have none. */
enum {
  WF_HIT = 1,              /* proved: they meet within the step, or are within the distance */
  WF_POSSIBLE = 2,         /* they come within the tolerance of that, and neither was proved */
  WF_OVERLAP_AT_START = 3, /* not provably apart at time 0: its toi is 0 */
  WF_BUDGET = 4            /* the test ended undecided: its toi is the earliest time that is not yet excluded */
};
/* Of `closest`: what has the closest points, of one side and of the other; an edge's or a face's interior
 * where it says so. */
enum {
  WF_CLOSEST_VERTEX_VERTEX = 0,
  WF_CLOSEST_EDGE_VERTEX = 1,
  WF_CLOSEST_EDGE_EDGE = 2,
  WF_CLOSEST_FACE_VERTEX = 3
};

/* Columns are NULL where they were not asked for, and valid until the session's next call. */
typedef struct wf_answer {
  uint64_t frame;              /* its number; of what moves nothing, that of the next one */
  uint64_t vf, ee, ve, vv, ef, vh; /* how many of each kind; ve and vv are among ee */
  uint64_t possible;           /* of these, neither proved nor excluded */
  uint64_t overlaps_at_start;  /* of wf_max_step(): left out, or coming no nearer; not among the rows */
  double earliest_toi;         /* infinity without a contact */
  size_t rows;                 /* sorted by kind and features */
  const uint8_t* kind;
  const uint8_t* status;
  const uint32_t* vertices;    /* (rows, 4); of wf_intersections() (rows, 5): the edge's, then the face's */
  const uint32_t* features;    /* (rows, 2): numbers of the vertex, edge, face or half-space's body of either side */
  const double* toi;           /* in [0, 1], not above the first time of contact (tier WF_FAST: near it); without a motion 0, or
                                * 1 at a trial's end */
  /* At the toi, in floating point: not proofs. */
  const double* weights;       /* (rows, 4), barycentric, of `vertices`: vertex-face 1 and the face's three, else each edge's two */
  const double* normal;        /* (rows, 3): the face's, or the one that both edges have, towards the first side */
  const double* points;        /* (rows, 2, 3): the closest ones, first side first */
  const double* direction;     /* (rows, 3): from the second side's closest point to the first's, of length 1; 0 where they touch */
  const double* squared_distance; /* of the closest points */
  const uint8_t* closest;      /* WF_CLOSEST_... */
  /* Of a reduced answer, in which a closest pair that several rows share comes once. */
  const uint32_t* multiplicity; /* in how many rows it was */
  const uint8_t* stencil;      /* bit k: the k-th of the row's four vertices is of the closest features. Two bits are two vertices,
                                * three an edge and a vertex, four what the kind says; a half-space's row has the vertex's alone */
  size_t distances;            /* of wf_vertex_distances(): how many */
  const double* vertex_distances;
  size_t world_count;          /* of report WF_EARLIEST in a scene with worlds */
  const uint32_t* worlds;      /* ascending; 0 where bodies are in none */
  const double* world_tois;    /* of each the least toi, or infinity: it may take min(1, toi) of the motion */
  double ms;                   /* that the engine took */
} wf_answer;

/* `question` may be NULL. `frame` NULL: nothing moves. `answer` NULL: nothing is told; else its size in bytes. */

/* What does the motion to this frame meet? Everything is at its end from then on. */
WF_API wf_code wf_step(wf_session*, const wf_frame*, const wf_question*, wf_answer*, size_t answer_size);
/* The same, and everything stays where it is. */
WF_API wf_code wf_trial(wf_session*, const wf_frame*, const wf_question*, wf_answer*, size_t answer_size);
/* How far may it go before anything touches? In [0, 1]; a trial, which may be committed. The answer has what
 * comes first. Except in tier fast it leaves room for what a commit rounds, which is less than r, 2^-44 of
 * the largest coordinate, at either end, of those of a pair's vertices that move (WF_FLOAT32: 2^-22): beyond
 * the separation, a pair stops at 4 r, or, where it starts within that, at 2 r. What starts nearer still may
 * move apart, or along, and the answer is 0 where any of it comes nearer. */
WF_API wf_code wf_max_step(wf_session*, const wf_frame*, const wf_question*, double* fraction, wf_answer*,
                           size_t answer_size);
/* Goes to a fraction in [0, 1] of the last trial or wf_max_step(). WF_FAILED_PRECONDITION where there is
 * none. Part of the way is rounded, and nothing is tested: wf_max_step() leaves room for that, and a trial
 * does not. */
WF_API wf_code wf_commit(wf_session*, double fraction);
/* Puts everything there, without a motion. */
WF_API wf_code wf_place(wf_session*, const wf_frame*);
/* Which pairs are within the distance, where everything is or at the last trial's end? */
WF_API wf_code wf_proximity(wf_session*, double distance, const wf_question*, wf_answer*, size_t answer_size);
/* How far is each vertex from anything, at most the distance? */
WF_API wf_code wf_vertex_distances(wf_session*, double distance, const wf_question*, wf_answer*, size_t answer_size);
/* Which edges meet which faces? */
WF_API wf_code wf_intersections(wf_session*, const wf_question*, wf_answer*, size_t answer_size);

/* What a change of the scene is. Numbers and warmth after each: see engine/scene.h and engine/collider.h. */
enum {
  WF_ADD_BODY = 0,         /* behind all others; its index is the number of bodies before */
  WF_CHANGE_BODY = 1,      /* another description; WF_REMOVED takes it out for good */
  WF_REPLACE_BODY = 2,     /* another body with the same index: remeshed, refined, or in place of one that was removed */
  WF_REPLACE_ELEMENTS = 3, /* other faces and edges for the same vertices: cut, torn, flipped */
  WF_CHANGE_FILTERS = 4,   /* in place of all that there are */
  WF_CHANGE_EXCLUDED_PAIRS = 5 /* in place of all that there are */
};

/* One change. What it has no use for is left as wf_change_init() leaves it: else it is refused. */
typedef struct wf_change {
  size_t size;
  int32_t what;              /* WF_ADD_BODY */
  uint32_t index;            /* of the body that is changed or replaced; also of one that an earlier change of the list adds.
                              * WF_REPLACE_ELEMENTS: 0 is all of a scene without declared bodies */
  /* WF_ADD_BODY, WF_CHANGE_BODY and WF_REPLACE_BODY. Its vertex_count is 0 or the change's; WF_CHANGE_BODY ignores it. NULL: a
   * body as wf_body_init() leaves it is added; the description of one that is replaced stays. */
  const wf_body* body;
  /* WF_ADD_BODY and WF_REPLACE_BODY: the body's. WF_CHANGE_FILTERS: of all vertices that there are then, where arrays say
   * something of each. */
  uint32_t vertex_count;
  const void* positions;     /* (vertex_count, 3), of the scene's type: where the body rests. No motion leads there */
  const double* thickness;   /* (vertex_count), as wf_scene's; where the vertices before had one, WF_REPLACE_BODY needs it */
  /* WF_ADD_BODY, WF_REPLACE_BODY and WF_REPLACE_ELEMENTS: number the body's own vertices from 0. */
  const int32_t* faces;      /* (face_count, 3) */
  size_t face_count;
  const int32_t* edges;      /* (edge_count, 2) */
  size_t edge_count;
  /* WF_CHANGE_FILTERS: as wf_scene's; with near_at_rest, rest_positions are needed. */
  uint32_t within_edges;
  double near_at_rest;
  const double* rest_positions;          /* (vertex_count, 3) */
  const uint32_t* excluded_vertex_pairs; /* (excluded_vertex_pair_count, 2) */
  size_t excluded_vertex_pair_count;
  const uint32_t* patches;               /* (vertex_count) */
  /* WF_CHANGE_EXCLUDED_PAIRS */
  const uint32_t* excluded_pairs;        /* (excluded_pair_count, 2) bodies */
  size_t excluded_pair_count;
} wf_change;
WF_API void wf_change_init(wf_change* change, size_t size);

/* Carries out the changes in order, all or none, from the next question on. `options`: NULL, or others in place of all that the
 * session has, in the same step; `threads` stays, and is 0 or what it was. `cancelled` may be NULL. The text of an error begins
 * with the change at fault, "changes[i]", or with "options". A trial cannot be committed afterwards, and what wf_edges() gave is
 * not valid any more. */
WF_API wf_code wf_change_scene(wf_session*, const wf_change* changes, size_t change_count, const wf_options* options,
                               const wf_flag* cancelled);

/* How much there is now; what was removed and keeps its numbers is counted. */
typedef struct wf_counts {
  uint64_t frame; /* the last one */
  size_t vertices;
  size_t faces;
  size_t edges;   /* as wf_edges() lists them */
  size_t bodies;  /* of a scene without declared ones, 0 */
} wf_counts;
WF_API wf_code wf_count(const wf_session*, wf_counts* counts, size_t counts_size);

/* Where everything is: (vertex_count, 3) float64 into `positions`, which has room for `count` numbers. */
WF_API wf_code wf_positions(const wf_session*, double* positions, size_t count);
/* At which poses bodies are: (body_count, 3, 4) into `poses`, which has room for `count` numbers. Of a rigid
 * body, half-spaces that move among them, the pose of its shape at rest, which is where its positions last
 * given, or its description, put it; the identity of one that has not moved by poses since, and of all
 * others. */
WF_API wf_code wf_poses(const wf_session*, double* poses, size_t count);
/* For those who keep positions of their own: where wf_commit() puts what goes from `from` to `to`, 12 numbers
 * of a pose or any number of positions, at a fraction in [0, 1] of the way, in a scene of this type, to which
 * all numbers are rounded first. The same bits on every machine. `way` may be `from` or `to`. */
WF_API wf_code wf_part_way(const double* from, const double* to, size_t count, double fraction, int32_t type,
                           double* way);
/* The same of a body that moves along the screw between two poses, 12 numbers each, which are rotations and
 * translations. */
WF_API wf_code wf_screw_way(const double* from, const double* to, double fraction, int32_t type, double* way);
/* The scene's edges, (edge_count, 2) vertices, which `features` number; valid until the scene is changed or the session freed. */
WF_API wf_code wf_edges(const wf_session*, const uint32_t** edges, size_t* edge_count);

#ifdef __cplusplus
}
#endif
#endif
