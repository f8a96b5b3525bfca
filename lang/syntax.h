// SPDX-License-Identifier: Apache-2.0
// The syntax tree: 16-byte nodes, 32-bit indices, places as offsets. Made by the parser, which has
// the grammar (lang/parse.c), read by the evaluator and by `fmt`, dropped after lowering.
#ifndef LANG_SYNTAX_H
#define LANG_SYNTAX_H

#include "lang/diag.h"
#include "lang/source.h"

typedef uint32_t NodeId;  // index into nodes; 0: none
typedef uint32_t Symbol;  // interned name; 0: none
typedef uint32_t ExtraId; // index into extra

// What a, b and aux hold. "extra:" is an index of a run of words in `extra`.
typedef enum {
    NODE_NONE,
    // Expressions
    NODE_NUMBER,        // aux = Unit; a, b = the bits of the double (low, high), unit not applied
    NODE_STRING,        // a = Symbol of the text, escapes resolved
    NODE_NAME,          // a = Symbol
    NODE_VECTOR,        // a = extra: elements, b = their number (1..)
    NODE_LIST,          // a = extra: elements, b = their number
    NODE_COMPREHENSION, // a = extra: Symbol, its offset, iterated, condition or 0, body
    NODE_KEYS,          // a = extra: n modes, modes..., n keys, (time, value, mode or 0)...
    NODE_MODE,          // a = Symbol, b = extra of arguments (as NODE_CALL) or 0
    NODE_CALL,          // a = callee, b = extra: n, (Symbol of its name or 0, its offset, value)...
    NODE_MEMBER,        // a = object, b = Symbol; the member's name is the last token of the span
    NODE_INDEX,         // a = object, b = index
    NODE_UNARY,         // aux = Operator, a = operand
    NODE_BINARY,        // aux = Operator, a, b = operands
    NODE_COND,          // a = condition, b = extra: then, else
    NODE_RANGE,         // a = low, b = extra: high, step or 0
    // Statements
    NODE_LET,       // a = Symbol, b = value; the name's offset is found by syntax_name_span
    NODE_PARAM,     // as LET
    NODE_FN,        // a = Symbol, b = extra: params, body
    NODE_DEF,       // a = Symbol, b = extra: params or 0, block
    NODE_FOR,       // a = Symbol, b = extra: iterated, block
    NODE_IF,        // a = condition, b = extra: block, else (block or if) or 0
    NODE_INCLUDE,   // a = string, b = Symbol after `as` or 0
    NODE_ASSERT,    // a = condition, b = message or 0
    NODE_PRINT,     // a = extra: values, b = their number
    NODE_TRANSFORM, // aux = Transform, a = extra: arguments, b = their number
    NODE_SIM,       // a = extra: Symbol of the kind, its offset, the name's, its offset, block
    NODE_JOINT,     // as SIM, then the label's index or 0; the label is 0 where there is none
    NODE_WHEN,      // a = condition, b = block
    NODE_CLIP,      // a = Symbol, b = value
    NODE_RATE,      // a = Symbol, b = value     (x' = e)
    NODE_PROPERTY,  // a = Symbol, b = value     (the node's lo is the name's offset)
    // a = extra: is instance, path (NODE_NAME, or NODE_MEMBER of names), extra of arguments or 0,
    // label's Symbol or 0, its offset, label's index or 0, block
    NODE_OBJECT,
    NODE_BLOCK,  // a = extra: statements, b = their number
    NODE_PARAMS, // a = extra: (Symbol, its offset, default or 0)..., b = their number
    NODE_KINDS,
    NODE_RUN = NODE_KINDS, // a = index into runs: no node of the grammar (lang/run.h)
} NodeKind;

typedef enum {
#define UNIT(id, text, dimension, factor) UNIT_##id,
#include "lang/units.def"
#undef UNIT
    UNIT_COUNT
} Unit;

typedef enum {
    OPERATOR_NEG,
    OPERATOR_NOT,
    OPERATOR_ADD,
    OPERATOR_SUB,
    OPERATOR_MUL,
    OPERATOR_DIV,
    OPERATOR_MOD,
    OPERATOR_POW,
    OPERATOR_LT,
    OPERATOR_LE,
    OPERATOR_GT,
    OPERATOR_GE,
    OPERATOR_EQ,
    OPERATOR_NE,
    OPERATOR_AND,
    OPERATOR_OR,
    OPERATOR_COUNT
} Operator;

typedef enum {
    TRANSFORM_TRANSLATE,
    TRANSFORM_SCALE,
    TRANSFORM_ROTATE,
    TRANSFORM_MATRIX,
    TRANSFORM_COUNT
} Transform;

typedef struct {
    uint8_t kind; // NodeKind
    uint8_t aux;
    uint16_t parens; // pairs of brackets around the expression, not in its span
    uint32_t lo;     // offset of the first character
    uint32_t a, b;
} Node;

typedef struct Symbols Symbols; // interned strings, shared by all files of a scene

Symbols *symbols_new(Arena *arena);
Symbol symbol_of(Symbols *symbols, const char *text, size_t n); // interns; never 0
const char *symbol_text(const Symbols *symbols, Symbol symbol); // NUL-terminated
size_t symbol_size(const Symbols *symbols, Symbol symbol);

typedef struct RunGroup RunGroup; // lang/run.h

typedef struct {
    const SourceFile *file;
    Symbols *symbols;
    Node *nodes;
    uint32_t *extra;
    RunGroup *runs;
    size_t n_nodes, n_extra, n_runs, nodes_capacity, extra_capacity, runs_capacity;
    NodeId root;     // NODE_BLOCK of the file's statements
    double version;  // after `st4`, or 0
    bool has_errors; // what could be read is still there
} Syntax;

// Parses a whole file; always returns a tree. Errors go to diag, with recovery at the next
// statement. Bounded: nesting over 256 is one error. Nodes live in the arena.
Syntax *syntax_parse(Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag);

// Parses text as a single expression (-D NAME=EXPR, `eval`). 0: there was an error.
NodeId syntax_parse_expr(Arena *arena, Symbols *symbols, const SourceFile *file, Diag *diag,
                         Syntax **syntax);

// The whole extent of a node, found by lexing again; for reports.
Span syntax_span(const Syntax *syntax, NodeId node);
// The name in let, param, fn, def, for, clip, rate, property; the path of an object.
Span syntax_name_span(const Syntax *syntax, NodeId node);
// The word at an offset ("its offset" in the list above).
Span syntax_word_span(const Syntax *syntax, uint32_t offset);

static inline const Node *syntax_node(const Syntax *syntax, NodeId id) {
    return &syntax->nodes[id];
}

double syntax_number(const Node *node); // of NODE_NUMBER, unit not applied

// An S-expression of the tree, for tests.
void syntax_dump(const Syntax *syntax, FILE *out);

#endif
