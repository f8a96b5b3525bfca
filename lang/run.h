// SPDX-License-Identifier: Apache-2.0
// Runs: statements of a generated file that differ from each other in their numbers alone.
//
// A program that writes a million spheres writes one statement a million times; one that writes a
// million things of some kinds writes some statements many times each, in any order. The first of
// each is parsed, the others are compared with its text, number by number, and leave nothing but a
// row of a table. A run is then evaluated once, as the body of a `for` is, its numbers looked up by
// the row. Where one of them must be known (a label's index, what an `if` asks for), or something
// is wrong, its statements are parsed and evaluated one by one after all, each in its own place.
#ifndef LANG_RUN_H
#define LANG_RUN_H

#include "lang/parser.h"

enum {
    RUN_MIN = 64,           // objects of a block that are parsed as they stand
    RUN_MAX_PATTERNS = 128, // of one group
    RUN_MAX_SLOTS = 64,     // numbers in one statement
    RUN_MAX_TOKENS = 512,   // of one statement
    RUN_SINGLE = 255
};

// A number of the first statement that is another one elsewhere.
typedef struct {
    NodeId node;          // NODE_NUMBER; of what a label ends with: its NODE_OBJECT
    const double *values; // [n], unit not applied; what the first statement's tree makes of the
                          // sign is left to it
} RunSlot;

typedef struct {
    NodeId first;            // NODE_OBJECT
    NodeId node_lo, node_hi; // of the first statement: [lo, hi)
    uint32_t n, n_slots;
    const uint32_t *at;   // [n] offsets of the statements
    const RunSlot *slots; // ascending by node
} Run;

// What a NODE_RUN stands for: objects that follow each other.
struct RunGroup {
    const Run *runs;
    // [n] of each: the index of its run; RUN_SINGLE: the next of the singles. NULL: all of one.
    const uint8_t *kinds;
    const NodeId *singles; // of no pattern
    uint32_t n, n_runs, n_singles;
};

// As syntax_parse, but statements may be NODE_RUN. The tables live in `lasting`.
Syntax *syntax_parse_runs(Arena *arena, Arena *lasting, Symbols *symbols, const SourceFile *file,
                          Diag *diag);

// What was found out about a block's statements so far; zeroed at its beginning.
typedef struct RunPatterns RunPatterns;
typedef struct {
    RunPatterns *patterns; // of the group at hand; NULL: none
    uint32_t n_objects;    // that follow each other
    bool is_off;           // hardly anything was alike
} RunGather;

// Takes the statements from here on that are like one of the group at hand. False: none is.
bool run_take(RunGather *gather, Parser *p);

// After a statement that was parsed from `lo` to where the parser stands, with nodes from node_lo
// on. Returns what takes its place in the block; 0: it is part of the group at hand.
NodeId run_add(RunGather *gather, Parser *p, NodeId statement, NodeId node_lo, uint32_t lo);

// At the end of the block, and where something stands that no group goes past.
void run_end(RunGather *gather, Parser *p);

// The number of the run that a node stands for; NULL: it is the same in all statements.
const RunSlot *run_slot(const Run *run, NodeId node);

// Parses one statement of a run by itself; its nodes follow the tree's.
NodeId run_parse_statement(Parser *p, uint32_t offset);

#endif
