// SPDX-License-Identifier: Apache-2.0
// `keys` tables.
#include "lang/eval_keys.h"

Value eval_keys(Eval *ev, const Env *env, NodeId id) {
    return eval_error(ev, env, id, NULL, "not supported yet: keys");
}
