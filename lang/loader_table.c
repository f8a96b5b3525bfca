// SPDX-License-Identifier: Apache-2.0
// Tables of numbers: text files of one or two columns.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lang/loader_parts.h"

// Blanks, or a comma or a semicolon among them, stand between numbers; # begins a comment.
static const char *skip_blanks(const char *at, const char *end) {
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) {
        at++;
    }
    return at;
}

enum { NO_NUMBERS = -1, EMPTY_CELL = -2 };

// The numbers of a line, at most 3; or what else stands there.
static int read_line(const char *at, const char *end, double numbers[3]) {
    int n = 0;
    for (at = skip_blanks(at, end); at < end && *at != '#' && n < 3; at = skip_blanks(at, end)) {
        if (*at == ',' || *at == ';') { // one at the end of a line is no cell
            at = skip_blanks(at + 1, end);
            if (n == 0 || (at < end && (*at == ',' || *at == ';'))) {
                return EMPTY_CELL;
            }
            continue;
        }
        size_t size = 0, most = (size_t)(end - at);
        while (size < most && strchr("+-.0123456789eE", at[size]) && at[size]) {
            size++;
        }
        char digits[64], *stop;
        if (size == 0 || size >= sizeof digits) {
            return NO_NUMBERS;
        }
        memcpy(digits, at, size);
        digits[size] = '\0';
        numbers[n++] = strtod(digits, &stop);
        if (*stop || !isfinite(numbers[n - 1])) {
            return NO_NUMBERS;
        }
        at += size;
    }
    return n;
}

typedef struct {
    Eval *ev;
    const Env *env;
    NodeId node;
    const char *name;
    Table *table;
    size_t xs_capacity, ys_capacity;
    int n_columns;
} Reading;

static bool bad_line(const Reading *r, unsigned line, const char *why, const char *hint) {
    eval_error(r->ev, r->env, r->node, hint, "'%s', line %u: %s", r->name, line, why);
    r->ev->has_failed_file = true;
    return false;
}

static bool add_row(Reading *r, unsigned line, const double numbers[3], int n) {
    Table *t = r->table;
    r->n_columns = r->n_columns ? r->n_columns : n;
    if (n > 2 || n != r->n_columns) {
        return bad_line(r, line,
                        n > 2 ? "a table has one or two columns"
                              : "it has not as many columns as the first",
                        NULL);
    }
    double x = n == 2 ? numbers[0] : t->n;
    if (t->n > 0 && !(x > t->xs[t->n - 1])) {
        return bad_line(r, line, "the first column does not ascend", NULL);
    }
    t->xs = arena_grow(r->ev->arena, t->xs, t->n, &r->xs_capacity, sizeof *t->xs);
    t->ys = arena_grow(r->ev->arena, t->ys, t->n, &r->ys_capacity, sizeof *t->ys);
    t->xs[t->n] = x;
    t->ys[t->n++] = numbers[n - 1];
    return true;
}

static bool read_table(Reading *r, const char *text, size_t size) {
    const char *end = text + size;
    if (size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) { // the byte order mark of spreadsheets
        text += 3;
    }
    for (unsigned line = 1; text < end; line++) {
        const char *stop = memchr(text, '\n', (size_t)(end - text));
        double numbers[3];
        stop = stop ? stop : end;
        int n = read_line(text, stop, numbers);
        if (n < 0) {
            return n == EMPTY_CELL ? bad_line(r, line, "a number is missing beside a comma", NULL)
                                   : bad_line(r, line, "numbers are expected",
                                              line == 1 ? "write # before a line of names" : NULL);
        }
        if (n > 0 && !add_row(r, line, numbers, n)) {
            return false;
        }
        text = stop + 1;
    }
    if (r->table->n == 0) {
        eval_error(r->ev, r->env, r->node, NULL, "there are no numbers in '%s'", r->name);
        r->ev->has_failed_file = true;
    }
    return r->table->n > 0;
}

const Table *loader_table(Eval *ev, const Env *env, NodeId node, const Value *name) {
    Table **first = loader_tables(ev), *table;
    for (table = *first; table; table = table->next) {
        if (table->name == name->symbol && table->module == env->module) {
            return table->n ? table : NULL;
        }
    }
    size_t size;
    table = ARENA_NEW(ev->arena, Table);
    *table = (Table){.next = *first, .module = env->module, .name = name->symbol};
    *first = table;
    Reading reading = {ev, env, node, symbol_text(ev->symbols, name->symbol), table, 0, 0, 0};
    const char *text = loader_text(ev, env, node, name, &size);
    if (!text || !read_table(&reading, text, size)) {
        table->n = 0;
        return NULL;
    }
    return table;
}
