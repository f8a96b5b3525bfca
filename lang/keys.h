// SPDX-License-Identifier: Apache-2.0
// `keys` tables: values at instants, and what lies between, as graphs of the clock.
//
// At a key's time the value is the key's value, bit for bit (rotations: it or its negative, the
// same rotation); a span belongs to [its key, the next key), so a step jumps just at its key's
// time. Under `loop` the first key follows the last without delay: at the last key's time the value
// is the first key's. Key times are constants. Values are mostly constants, and then looked up in
// tables; values that move are chosen between.
//
// Spans. linear: v + s dv, s going from 0 to 1. smooth: cubic Hermite whose speed at a key is that
// of the parabola through it and its two neighbours (Catmull-Rom on non-uniform times: Barry and
// Goldman, SIGGRAPH 1988); at the ends, and beside a step, the missing neighbour is the other one
// reflected; under `loop` with equal first and last keys, and under `offset`, it is the one round
// the corner. The others are v + f(s) dv with f(0) = 0 and f(1) = 1:
//   ease          s s (3 - 2 s)
//   ease(a, b)    constant acceleration for a span's first part a, constant speed, constant braking
//                 for its last part b
//   bezier        y(q) where x(q) = s; |x(q) - s| <= 2^-46
//   spring(f, d)  1 - g(s), g the fall of a damped oscillator from 1 at rest, f its frequency (Hz)
//                 without damping; what remains of g at the span's end is made up for by an ease
// Rotations: slerp the shorter way with the same s or f(s). smooth: Hermite's curve on the sphere
// (Kim, Kim and Shin, "A General Construction Scheme for Unit Quaternion Curves with Simple High
// Order Derivatives", SIGGRAPH 1995), angular velocities at the keys found as speeds are above.
// About one axis it is the curve of the angles; a squad loses its speed where spans differ much.
#ifndef LANG_KEYS_H
#define LANG_KEYS_H

#include "lang/spatial.h"

typedef enum {
#define MODE(id, name, n_arguments, help) KEYS_##id,
#include "lang/keys.def"
#undef MODE
    KEYS_CURVES
} KeysCurve;

typedef enum {
#define END(id, name, help) KEYS_END_##id,
#include "lang/keys.def"
#undef END
    KEYS_ENDS
} KeysEnd;

typedef struct {
    const char *name, *help;
    uint32_t n_arguments;
} KeysWord;
extern const KeysWord keys_curves[KEYS_CURVES];
extern const KeysWord keys_ends[KEYS_ENDS]; // n_arguments is 0

typedef struct {
    KeysCurve curve;
    double arguments[4];
} KeysMode;

typedef struct {
    uint32_t n;            // >= 1; one key is a constant
    const double *times;   // ascending, no two equal, finite: see keys_disorder
    const KeysMode *modes; // [n]: of the span that follows the key; the last is not used
    KeysEnd before, after;
} Keys;

// The curve of that name that takes so many arguments. KEYS_CURVES: none.
KeysCurve keys_find_curve(const char *name, uint32_t n_arguments);
KeysEnd keys_find_end(const char *name); // KEYS_ENDS: none

// What is wrong with a mode's arguments, or NULL: "x1 and x2 must be in 0..1".
const char *keys_check_mode(const KeysMode *mode);

// The first key that is not later than the one before it; n: none.
uint32_t keys_disorder(const double *times, uint32_t n);

// values[n][width], any scalars that go by components: numbers, angles, vectors, colours.
// out[width].
void keys_values(Dag *dag, const Keys *keys, Ref clock, const Ref *values, uint32_t width,
                 Ref *out);
RefQuat keys_rotation(Dag *dag, const Keys *keys, Ref clock, const RefQuat *values);
// By their parts: translation, rotation, scale.
RefMap keys_map(Dag *dag, const Keys *keys, Ref clock, const RefMap *values);

#endif
