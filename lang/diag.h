// SPDX-License-Identifier: Apache-2.0
// Diagnostics: one report per mistake, the place, what was found and what was expected.
//
//   scene.st4:14:14: error: sphere has no property 'raduis'
//      14 |     sphere { raduis = 2cm }
//         |              ^~~~~~ did you mean 'radius'?
//
// Messages: lower case, no final period. At most 20 errors are shown (then one line says how many
// more there are); one per statement. The same (place, message) is reported once.
#ifndef LANG_DIAG_H
#define LANG_DIAG_H

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

#include "lang/source.h"

typedef enum { DIAG_ERROR, DIAG_WARNING, DIAG_NOTE, DIAG_PRINT } Severity;

// The one table of warnings: stable names for -W; lang/warnings.def, WARNING(ID, "name", "help").
typedef enum {
#define WARNING(id, name, help) WARN_##id,
#include "lang/warnings.def"
#undef WARNING
    WARN_COUNT
} Warning;

typedef struct {
    const char *name, *help;
} WarningInfo;
extern const WarningInfo warning_infos[WARN_COUNT];

enum { DIAG_MAX_ERRORS = 20 };

typedef struct Diag Diag;

// Writes to `out` as it goes; json: one object per line ({"version":1,"severity":...,"file":...,
// "line":...,"column":...,"end_line":...,"end_column":...,"name":...,"message":...,"hint":...}).
// color: ANSI colours.
Diag *diag_new(Arena *arena, const Sources *sources, FILE *out, bool json, bool color);

// Sets a warning by the text after -W: "name", "no-name", "all", "error", "error=name". False: no
// such warning.
bool diag_set_warning(Diag *diag, const char *text);

// hint may be NULL: what to do, shown after the carets.
void diag_error(Diag *diag, Span where, const char *hint, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
void diag_warn(Diag *diag, Warning warning, Span where, const char *hint, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
// A second place that belongs to the last report ("first defined here"). Silent after a report that
// was not shown.
void diag_note(Diag *diag, Span where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// A line that the script prints. json: an object of severity "print".
void diag_print(Diag *diag, Span where, const char *line);

// The last report's statement is over: the next error is shown even if it comes from the same one.
// Between two calls only the first error is shown.
void diag_next_statement(Diag *diag);

// Reports are kept back until the release, and shown by ascending `order` then: what is walked in
// another order than it was written in. Pairs may be nested; the outermost one's order counts.
void diag_hold(Diag *diag);
void diag_order(Diag *diag, uint32_t order);
void diag_release(Diag *diag);

unsigned diag_n_errors(const Diag *diag); // all of them, shown or not
unsigned diag_n_warnings(const Diag *diag);
// Says how many errors were not shown, if any.
void diag_finish(Diag *diag);

// The nearest of n names to `name` by edit distance (transpositions count one), or NULL where none
// is near enough to be meant.
const char *diag_nearest(const char *name, const char *const *names, size_t n);

#endif
