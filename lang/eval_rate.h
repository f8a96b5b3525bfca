// SPDX-License-Identifier: Apache-2.0
// Rates of change, and what is read of transforms and rotations by name.
#ifndef LANG_EVAL_RATE_H
#define LANG_EVAL_RATE_H

#include "lang/eval.h"

// d(e): by the second of its clock; of a rotation its angular velocity, in radians per second.
// Poison: it has none (reported).
Value eval_rate(Eval *ev, const Env *env, NodeId node, const Value *e);

// at(e, when).
Value eval_at(Eval *ev, const Env *env, NodeId node, const Value *e, Ref when);

// spin of a rotation; pos, vel, spin or turn of a transform: where it takes the origin, the rate of
// that, and of the rotation that it turns by, and that itself. False: there is no such member.
bool eval_motion_member(Eval *ev, const Env *env, NodeId node, const Value *e, const char *member,
                        Value *value);

#endif
