// SPDX-License-Identifier: Apache-2.0
// Runs: statements of a generated file that follow each other and differ in their numbers alone.
//
// A program that writes a million spheres writes one statement a million times. The first of a run
// is parsed, the others are compared with its text, number by number, and leave nothing but a row
// of a table. The run is then evaluated once, as the body of a `for` is, its numbers looked up by
// the row. Where one of them must be known (a label's index, what an `if` asks for), or something
// is wrong, the statements are parsed and evaluated one by one after all, each in its own place.
#ifndef LANG_RUN_H
#define LANG_RUN_H

#include "lang/parser.h"

enum {
    RUN_MIN = 64,        // statements; fewer are parsed as they stand
    RUN_MAX_SLOTS = 64,  // numbers in one statement
    RUN_MAX_TOKENS = 512 // of one statement
};

// A number of the first statement that is another one elsewhere.
typedef struct {
    NodeId node;          // NODE_NUMBER
    const double *values; // [n], unit not applied; what the first statement's tree makes of the
                          // sign is left to it
} RunSlot;

struct Run {
    NodeId first;            // NODE_OBJECT
    NodeId node_lo, node_hi; // of the first statement: [lo, hi)
    uint32_t n, n_slots;
    const uint32_t *at;   // [n] offsets of the statements
    const RunSlot *slots; // ascending by node
};

// As syntax_parse, but statements may be NODE_RUN. The tables live in `lasting`.
Syntax *syntax_parse_runs(Arena *arena, Arena *lasting, Symbols *symbols, const SourceFile *file,
                          Diag *diag);

// After a statement that was parsed from `lo` to where the parser stands, with nodes from node_lo
// on: takes those like it. Returns the NODE_RUN, or the statement where too few follow.
NodeId run_gather(Parser *p, NodeId statement, NodeId node_lo, uint32_t lo);

// The number of the run that a node stands for; NULL: it is the same in all statements.
const RunSlot *run_slot(const Run *run, NodeId node);

// Parses one statement of a run by itself; its nodes follow the tree's.
NodeId run_parse_statement(Parser *p, uint32_t offset);

#endif
