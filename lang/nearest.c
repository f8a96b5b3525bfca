// SPDX-License-Identifier: Apache-2.0
// Did you mean: the nearest name by edit distance.
#include "lang/diag.h"

#include <string.h>

// Longer names are not compared: nobody's are, and the table stays on the stack.
enum { LONGEST = 63 };

static char lower(char c) {
    return c >= 'A' && c <= 'Z' ? (char)(c + 'a' - 'A') : c;
}

static unsigned min_of(unsigned a, unsigned b) {
    return a < b ? a : b;
}

// Insertions, deletions, substitutions and transpositions of neighbours that lead from a to b,
// none over the same characters twice (optimal string alignment), in halves: a change of case
// counts one half.
static unsigned distance(const char *a, size_t n_a, const char *b, size_t n_b) {
    unsigned rows[3][LONGEST + 1];
    for (unsigned j = 0; j <= n_b; j++) {
        rows[0][j] = 2 * j;
    }
    for (unsigned i = 1; i <= n_a; i++) {
        unsigned *row = rows[i % 3], *above = rows[(i + 2) % 3], *above2 = rows[(i + 1) % 3];
        row[0] = 2 * i;
        for (unsigned j = 1; j <= n_b; j++) {
            char x = lower(a[i - 1]), y = lower(b[j - 1]);
            unsigned change = x != y ? 2 : a[i - 1] != b[j - 1];
            row[j] = min_of(min_of(above[j], row[j - 1]) + 2, above[j - 1] + change);
            if (i > 1 && j > 1 && x == lower(b[j - 2]) && lower(a[i - 2]) == y) {
                row[j] = min_of(row[j], above2[j - 2] + 2);
            }
        }
    }
    return rows[n_a % 3][n_b];
}

const char *diag_nearest(const char *name, const char *const *names, size_t n) {
    size_t size = strlen(name);
    if (size > LONGEST) {
        return NULL;
    }
    const char *nearest = NULL;
    unsigned least = 0;
    for (size_t i = 0; i < n; i++) {
        size_t other = strlen(names[i]);
        if (other > LONGEST) {
            continue;
        }
        unsigned d = distance(name, size, names[i], other);
        // A third of the letters may be wrong, and one of a name of two only by its case or order.
        size_t longest = size > other ? size : other;
        unsigned bound = longest < 3 ? 1 : 2 * (unsigned)((longest + 1) / 3);
        if (d <= bound && (!nearest || d < least)) {
            nearest = names[i];
            least = d;
        }
    }
    return nearest;
}
