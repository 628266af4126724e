/* Recognises which limp a walking figure has, from the positions of its joints over time. It computes what
   hobble.gait does in Python. Optional: the runtime does not need it. Nothing is allocated; about 150 kB of
   stack are used. */
#ifndef HOBBLE_GAIT_H
#define HOBBLE_GAIT_H

#include "hobble.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HOBBLE_GAIT_FRAMES 240 /* the most frames that are read; three seconds are enough for an answer */
/* Numbers of a profile: 8 measures of a cycle, then the range over a cycle of each of 15 curves, then their
   means. */
#define HOBBLE_GAIT_PROFILE 38
#define HOBBLE_GAIT_FEATURES 21
#define HOBBLE_GAIT_KINDS 32 /* the most kinds of limp */

/* Places in `joints`. Those of the right side follow those of the left one. */
enum { HOBBLE_GAIT_HIPS, HOBBLE_GAIT_TRUNK, HOBBLE_GAIT_LEFT, HOBBLE_GAIT_RIGHT = 7, HOBBLE_GAIT_JOINTS = 12 };

/* Measures the walk in frames of 1/60 s, (count, width, 3) in cm, Y up. joints: for each side hip, knee, heel,
   shoulder and hand, as numbers of columns; a hand may be -1. Returns the number of cycles straight ahead, of
   the leg that has fewer; without any, `profile` (HOBBLE_GAIT_PROFILE) is not written. */
HOBBLE_API int hobble_gait_profile(const double *frames, int count, int width, const int *joints,
                                   double *profile);
/* What hurts in a walk. learnt: what was learnt from people who limp: the number of kinds of limp, the number of
   strengths, the strengths that are tried (1 is the mean of people), the covariance (features, features) of
   healthy walks; then for each kind a number that all sides of a limp share, the mean (features) of limps of
   strength 1, and their covariance. healthy: the profile of the healthy walk of the same figure. answer:
   number of the likeliest kind, or -1 if nothing hurts; strength of the limp; distance from the likeliest walk
   in standard deviations; probability that nothing hurts, and of each kind. */
HOBBLE_API void hobble_gait_recognise(const double *learnt, const double *walk, const double *healthy,
                                      double *answer);

#ifdef __cplusplus
}
#endif

#endif
