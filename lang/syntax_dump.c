// SPDX-License-Identifier: Apache-2.0
// The tree as an S-expression, one line for each of the file's statements.
#include "lang/lex.h"

static void dump(const Syntax *syntax, NodeId id, FILE *out);

static const char *text_of(const Syntax *syntax, Symbol symbol) {
    return symbol_text(syntax->symbols, symbol);
}

static void dump_string(const char *text, size_t size, FILE *out) {
    fputc('"', out);
    for (size_t i = 0; i < size; i++) {
        char c = text[i];
        if (c == '"' || c == '\\') {
            fputc('\\', out);
        }
        if (c == '\n' || c == '\t') {
            fputs(c == '\n' ? "\\n" : "\\t", out);
        } else {
            fputc(c, out);
        }
    }
    fputc('"', out);
}

// " part" of n parts; 0 is shown as _.
static void dump_parts(const Syntax *syntax, const uint32_t *ids, size_t n, FILE *out) {
    for (size_t i = 0; i < n; i++) {
        fputc(' ', out);
        dump(syntax, ids[i], out);
    }
}

static void dump_args(const Syntax *syntax, ExtraId args, FILE *out) {
    const uint32_t *words = &syntax->extra[args];
    for (uint32_t i = 0; i < words[0]; i++) {
        const uint32_t *arg = words + 1 + 3 * i;
        fprintf(out, " %s%s", text_of(syntax, arg[0]), arg[0] ? "=" : "");
        dump(syntax, arg[2], out);
    }
}

static void dump_keys(const Syntax *syntax, const Node *node, FILE *out) {
    const uint32_t *words = &syntax->extra[node->a];
    fputs("(keys (", out);
    for (uint32_t i = 1; i <= words[0]; i++) {
        fputs(i > 1 ? " " : "", out);
        dump(syntax, words[i], out);
    }
    fputc(')', out);
    words += 1 + words[0];
    for (uint32_t i = 0; i < words[0]; i++) {
        fputs(" (", out);
        dump(syntax, words[1 + 3 * i], out);
        dump_parts(syntax, &words[2 + 3 * i], words[3 + 3 * i] ? 2 : 1, out);
        fputc(')', out);
    }
    fputc(')', out);
}

static void dump_params(const Syntax *syntax, const Node *node, FILE *out) {
    fputc('(', out);
    for (uint32_t i = 0; i < node->b; i++) {
        const uint32_t *param = &syntax->extra[node->a + 3 * i];
        fprintf(out, "%s%s", i ? " " : "", text_of(syntax, param[0]));
        if (param[2]) {
            fputc('=', out);
            dump(syntax, param[2], out);
        }
    }
    fputc(')', out);
}

static void dump_object(const Syntax *syntax, const Node *node, FILE *out) {
    const uint32_t *words = &syntax->extra[node->a];
    fputs(words[0] ? "(instance " : "(object ", out);
    dump(syntax, words[1], out);
    if (words[2]) {
        fputs(" (args", out);
        dump_args(syntax, words[2], out);
        fputc(')', out);
    }
    if (words[3]) {
        fprintf(out, " (label %s", text_of(syntax, words[3]));
        dump_parts(syntax, &words[5], words[5] != 0, out);
        fputc(')', out);
    }
    dump_parts(syntax, &words[6], 1, out);
    fputc(')', out);
}

static void dump_expression(const Syntax *syntax, const Node *node, FILE *out) {
    static const char *const operators[OPERATOR_COUNT] = {
        "-", "not", "+", "-", "*", "/", "%", "^", "<", "<=", ">", ">=", "==", "!=", "and", "or"};
    const uint32_t *extra = syntax->extra, ab[2] = {node->a, node->b};
    switch ((NodeKind)node->kind) {
    case NODE_NUMBER:
        fprintf(out, "%.17g%s", syntax_number(node), lex_unit_text((Unit)node->aux));
        return;
    case NODE_STRING:
        dump_string(text_of(syntax, node->a), symbol_size(syntax->symbols, node->a), out);
        return;
    case NODE_NAME:
        fputs(text_of(syntax, node->a), out);
        return;
    case NODE_KEYS:
        dump_keys(syntax, node, out);
        return;
    case NODE_VECTOR:
    case NODE_LIST:
        fputs(node->kind == NODE_LIST ? "(list" : "(vector", out);
        dump_parts(syntax, &extra[node->a], node->b, out);
        break;
    case NODE_COMPREHENSION:
        fprintf(out, "(each %s", text_of(syntax, extra[node->a]));
        dump_parts(syntax, &extra[node->a + 2], 3, out);
        break;
    case NODE_MODE:
        fprintf(out, "%s%s", node->b ? "(" : "", text_of(syntax, node->a));
        if (!node->b) {
            return;
        }
        dump_args(syntax, node->b, out);
        break;
    case NODE_CALL:
        fputs("(call", out);
        dump_parts(syntax, ab, 1, out);
        dump_args(syntax, node->b, out);
        break;
    case NODE_MEMBER:
        fputs("(.", out);
        dump_parts(syntax, ab, 1, out);
        fprintf(out, " %s", text_of(syntax, node->b));
        break;
    case NODE_INDEX:
        fputs("(index", out);
        dump_parts(syntax, ab, 2, out);
        break;
    case NODE_UNARY:
    case NODE_BINARY:
        fprintf(out, "(%s", operators[node->aux]);
        dump_parts(syntax, ab, node->kind == NODE_BINARY ? 2 : 1, out);
        break;
    case NODE_COND:
        fputs("(?", out);
        dump_parts(syntax, ab, 1, out);
        dump_parts(syntax, &extra[node->b], 2, out);
        break;
    case NODE_RANGE:
        fputs("(..", out);
        dump_parts(syntax, ab, 1, out);
        dump_parts(syntax, &extra[node->b], extra[node->b + 1] ? 2 : 1, out);
        break;
    default:
        return;
    }
    fputc(')', out);
}

// "(let x", for those that are no expressions and have a word at the head.
static void dump_head(const Syntax *syntax, const Node *node, FILE *out) {
    static const char *const heads[NODE_KINDS] = {
        [NODE_LET] = "let",         [NODE_PARAM] = "param",   [NODE_FN] = "fn",
        [NODE_DEF] = "def",         [NODE_FOR] = "for",       [NODE_IF] = "if",
        [NODE_INCLUDE] = "include", [NODE_ASSERT] = "assert", [NODE_PRINT] = "print",
        [NODE_SIM] = "sim",         [NODE_JOINT] = "joint",   [NODE_WHEN] = "when",
        [NODE_CLIP] = "clip",       [NODE_RATE] = "rate",     [NODE_PROPERTY] = "=",
        [NODE_BLOCK] = "block",
    };
    static const char *const transforms[TRANSFORM_COUNT] = {"translate", "scale", "rotate",
                                                            "matrix"};
    fprintf(out, "(%s", node->kind == NODE_TRANSFORM ? transforms[node->aux] : heads[node->kind]);
    switch ((NodeKind)node->kind) {
    case NODE_LET:
    case NODE_PARAM:
    case NODE_FN:
    case NODE_DEF:
    case NODE_FOR:
    case NODE_CLIP:
    case NODE_RATE:
    case NODE_PROPERTY:
        fprintf(out, " %s", text_of(syntax, node->a));
        break;
    default:
        break;
    }
}

static void dump_statement(const Syntax *syntax, const Node *node, FILE *out) {
    const uint32_t *extra = syntax->extra, ab[2] = {node->a, node->b};
    dump_head(syntax, node, out);
    switch ((NodeKind)node->kind) {
    case NODE_LET:
    case NODE_PARAM:
    case NODE_CLIP:
    case NODE_RATE:
    case NODE_PROPERTY:
        dump_parts(syntax, &ab[1], 1, out);
        break;
    case NODE_DEF:
        dump_parts(syntax, &extra[node->b] + !extra[node->b], extra[node->b] ? 2 : 1, out);
        break;
    case NODE_FN:
    case NODE_FOR:
        dump_parts(syntax, &extra[node->b], 2, out);
        break;
    case NODE_IF:
        dump_parts(syntax, ab, 1, out);
        dump_parts(syntax, &extra[node->b], extra[node->b + 1] ? 2 : 1, out);
        break;
    case NODE_INCLUDE:
        dump_parts(syntax, ab, 1, out);
        fprintf(out, "%s%s", node->b ? " " : "", text_of(syntax, node->b));
        break;
    case NODE_ASSERT:
        dump_parts(syntax, ab, node->b ? 2 : 1, out);
        break;
    case NODE_WHEN:
        dump_parts(syntax, ab, 2, out);
        break;
    case NODE_SIM:
    case NODE_JOINT:
        fprintf(out, " %s", text_of(syntax, extra[node->a]));
        if (extra[node->a + 2]) {
            fprintf(out, " %s", text_of(syntax, extra[node->a + 2]));
        }
        if ((NodeKind)node->kind == NODE_JOINT && extra[node->a + 5]) {
            dump_parts(syntax, &extra[node->a + 5], 1, out);
        }
        dump_parts(syntax, &extra[node->a + 4], 1, out);
        break;
    default: // print, transform, block
        dump_parts(syntax, &extra[node->a], node->b, out);
        break;
    }
    fputc(')', out);
}

static void dump(const Syntax *syntax, NodeId id, FILE *out) {
    const Node *node = &syntax->nodes[id];
    if (!id) {
        fputc('_', out);
    } else if (node->kind < NODE_LET) {
        dump_expression(syntax, node, out);
    } else if (node->kind == NODE_OBJECT) {
        dump_object(syntax, node, out);
    } else if (node->kind == NODE_PARAMS) {
        dump_params(syntax, node, out);
    } else {
        dump_statement(syntax, node, out);
    }
}

void syntax_dump(const Syntax *syntax, FILE *out) {
    const Node *root = &syntax->nodes[syntax->root];
    if (root->kind != NODE_BLOCK) {
        dump(syntax, syntax->root, out);
        fputc('\n', out);
        return;
    }
    for (uint32_t i = 0; i < root->b; i++) {
        dump(syntax, syntax->extra[root->a + i], out);
        fputc('\n', out);
    }
}
