// SPDX-License-Identifier: Apache-2.0
// The language's functions that are more than one operation, as graphs (lang/dag.h).
//
// rand and its kin are stateless hashes of their arguments: the same arguments give the same value
// in any scene, order and thread, and different ones are independent.
#ifndef LANG_FUNCTIONS_H
#define LANG_FUNCTIONS_H

#include "lang/spatial.h"

enum { FUNCTIONS_MAX_OCTAVES = 24 };

Ref functions_clamp(Dag *dag, Ref x, Ref lo, Ref hi);
// a (1 - w) + b w: exactly a at w = 0, exactly b at w = 1.
Ref functions_mix(Dag *dag, Ref a, Ref b, Ref w);
Ref functions_step(Dag *dag, Ref edge, Ref x); // 1 from the edge on
// s s (3 - 2 s), where s goes from 0 at lo to 1 at hi; falls where hi < lo.
Ref functions_smoothstep(Dag *dag, Ref lo, Ref hi, Ref x);

// n >= 1 arguments (the evaluator gives the components of vectors one by one).
Ref functions_rand(Dag *dag, const Ref *k, uint32_t n);     // uniform in [0, 1)
Ref functions_randn(Dag *dag, const Ref *k, uint32_t n);    // normal, mean 0, deviation 1
Ref3 functions_randdir(Dag *dag, const Ref *k, uint32_t n); // uniform on the unit sphere

// Gradient noise in [-1, 1], 0 at integer points.
Ref functions_noise(Dag *dag, Ref3 p);
// The sum over octaves k = 0.. of gain^k noise(lacunarity^k p), each octave shifted so that their
// zeros do not meet. 1 <= octaves <= FUNCTIONS_MAX_OCTAVES.
Ref functions_fbm(Dag *dag, Ref3 p, uint32_t octaves, double lacunarity, double gain);

// 0 or 1: cubes of the given edge, alternating. The lattice is moved by a millionth of a cube, so
// that a surface that lies in one of its planes has one colour on either side of rounding.
Ref functions_checker(Dag *dag, Ref3 p, Ref size);

#endif
