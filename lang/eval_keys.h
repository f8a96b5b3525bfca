// SPDX-License-Identifier: Apache-2.0
// `keys { ... }` expressions: checked, then built by lang/keys.h.
#ifndef LANG_EVAL_KEYS_H
#define LANG_EVAL_KEYS_H

#include "lang/eval.h"

Value eval_keys(Eval *ev, const Env *env, NodeId node);

#endif
