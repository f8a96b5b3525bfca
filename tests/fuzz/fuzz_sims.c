// SPDX-License-Identifier: Apache-2.0
// Simulations, as lang/eval_sim*.c read them: blocks of equations and of bodies, and their members.
#include "tests/fuzz/fuzz_grammar.h"

// ---- Equations

static void write_states(Writer *w, int depth) {
    static const WriteType types[] = {WRITE_NUMBER, WRITE_NUMBER, WRITE_VEC3, WRITE_ANGLE,
                                      WRITE_COLOR,  WRITE_VEC2,   WRITE_BOOL, WRITE_ROTATION};
    for (uint32_t i = 0, n = 1 + fuzz_random(w, 3); i < n; i++) {
        WriteType type = types[fuzz_random(w, N_OF(types))];
        fuzz_put(w, "%c = ", "abc"[i]);
        fuzz_write(w, type, depth - 1);
        fuzz_put(w, "\n");
        if (!fuzz_one_in(w, 4)) {
            fuzz_put(w, "%c' = ", "abc"[i]);
            fuzz_write(w, type == WRITE_ROTATION ? WRITE_VEC3 : type, depth - 1);
            fuzz_put(w, "\n");
        }
    }
}

static void write_event(Writer *w, int depth) {
    static const char *const conditions[] = {"a < 0", "a.y < 0", "b > t", "a < b", "t > 0.5"};
    fuzz_put(w, "when ");
    if (fuzz_one_in(w, 2)) {
        PUT_ONE_OF(w, conditions);
    } else {
        fuzz_write(w, WRITE_BOOL, depth - 1);
    }
    fuzz_put(w, " { ");
    for (uint32_t i = 0, n = 1 + fuzz_random(w, 2); i < n; i++) {
        fuzz_put(w, "%c = ", "abc"[fuzz_random(w, 3)]);
        fuzz_write_expression(w, depth - 1);
        fuzz_put(w, "  ");
    }
    fuzz_put(w, "}\n");
}

static void write_state(Writer *w, int depth) {
    if (fuzz_one_in(w, 2)) {
        fuzz_put(w, "count = %u  ", fuzz_random(w, 6));
    }
    if (fuzz_one_in(w, 3)) {
        fuzz_write_properties(w, OBJECT_SIM_STATE, depth);
    }
    if (fuzz_one_in(w, 4)) {
        fuzz_put(w, "let g = id\n");
    }
    write_states(w, depth);
    while (fuzz_one_in(w, 2)) {
        static const char *const around[] = {"", "", "for i in 0..2 {\n", "if true {\n",
                                             "if a > 0 {\n"};
        uint32_t which = fuzz_random(w, N_OF(around));
        fuzz_put(w, "%s", around[which]);
        write_event(w, depth);
        fuzz_put(w, which > 1 ? "}\n" : "");
    }
}

// ---- Bodies

static void write_label(Writer *w) {
    static const char *const labels[] = {"a", "b", "a[0]", "a[1]", "a[i]", "b[j]"};
    PUT_ONE_OF(w, labels);
}

static void write_body(Writer *w, int depth) {
    static const ObjectKind kinds[] = {OBJECT_BOX, OBJECT_SPHERE, OBJECT_CYLINDER, OBJECT_PLANE,
                                       OBJECT_GROUP};
    if (fuzz_one_in(w, 4)) {
        fuzz_put(w, "fixed { ");
    } else {
        fuzz_put(w, "body ");
        write_label(w);
        fuzz_put(w, " { ");
    }
    for (uint32_t i = 0, n = 1 + fuzz_random(w, 2); i < n; i++) {
        ObjectKind kind = kinds[fuzz_random(w, N_OF(kinds))];
        fuzz_put(w, "%s { ", node_infos[kind].name);
        if (fuzz_one_in(w, 2)) {
            fuzz_write_properties(w, kind, depth - 1);
        }
        fuzz_put(w, "}  ");
    }
    if (fuzz_one_in(w, 2)) {
        fuzz_write_properties(w, OBJECT_BODY, depth);
    }
    if (fuzz_one_in(w, 2)) {
        fuzz_write_statement(w, depth - 1);
    }
    fuzz_put(w, "}\n");
}

static void write_joint(Writer *w, int depth) {
    static const char *const kinds[] = {"hinge", "ball", "slider", "fixed", "state"};
    fuzz_put(w, "joint ");
    PUT_ONE_OF(w, kinds);
    fuzz_put(w, fuzz_one_in(w, 2) ? " " : fuzz_one_in(w, 2) ? " g " : " g[1] ");
    fuzz_put(w, "{ a = ");
    write_label(w);
    if (fuzz_one_in(w, 2)) {
        fuzz_put(w, "  b = ");
        write_label(w);
    }
    fuzz_put(w, "  ");
    fuzz_write_properties(w, OBJECT_JOINT, depth);
    fuzz_put(w, "}\n");
}

static void write_rigid(Writer *w, int depth) {
    if (fuzz_one_in(w, 3)) {
        fuzz_write_properties(w, OBJECT_SIM_RIGID, depth);
    }
    for (uint32_t i = 0, n = 1 + fuzz_random(w, 4); i < n; i++) {
        bool is_loop = fuzz_one_in(w, 4);
        fuzz_put(w, is_loop ? "for i in 0..2 {\n" : "");
        if (fuzz_one_in(w, 4)) {
            write_joint(w, depth);
        } else {
            write_body(w, depth);
        }
        fuzz_put(w, is_loop ? "}\n" : "");
    }
}

// ---- Both

void fuzz_write_sim(Writer *w, int depth) {
    bool is_rigid = fuzz_one_in(w, 3);
    fuzz_put(w, is_rigid ? "sim rigid E {\n" : "sim state D {\n");
    if (is_rigid) {
        write_rigid(w, depth);
    } else {
        write_state(w, depth);
    }
    if (fuzz_one_in(w, 6)) {
        fuzz_write_statement(w, depth - 1);
    }
    fuzz_put(w, "}\n");
}

void fuzz_write_sim_member(Writer *w) {
    static const char *const members[] = {"D.a",      "D.b",     "D.a[0]",    "D.a[i]",  "D.a[9*t]",
                                          "D.a[1].x", "E.a",     "E.a[1]",    "E.a.pos", "E.b.spin",
                                          "E.b.vel",  "D.alive", "E.a[i]",    "D",       "d(D.a)",
                                          "d(E.b)",   "E.a * x", "at(D.a, 2)"};
    PUT_ONE_OF(w, members);
}
