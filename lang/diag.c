// SPDX-License-Identifier: Apache-2.0
// Diagnostics: what is shown, how often, and how it looks.
#include "lang/diag.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "lang/excerpt.h"
#include "lang/json.h"

const WarningInfo warning_infos[WARN_COUNT] = {
#define WARNING(id, name, help) {name, help},
#include "lang/warnings.def"
#undef WARNING
};

typedef struct {
    Severity severity;
    Span where;
    const char *name; // of the warning, or NULL
    bool is_raised;   // a warning that counts as an error
    const char *hint, *message;
} Report;

typedef struct {
    Report report;
    uint32_t order, index;
} Held;

// Of errors: as many as could come to be shown, whatever is walked out of its order.
enum { MOST_HELD = DIAG_MAX_ERRORS + 256 };

typedef enum { LEVEL_OFF, LEVEL_ON, LEVEL_ERROR } Level;

struct Diag {
    Arena *arena;
    const Sources *sources;
    FILE *out;
    bool is_json, is_color;
    uint8_t levels[WARN_COUNT]; // Level
    unsigned n_errors, n_shown, n_warnings;
    bool has_statement_error; // since diag_next_statement
    bool is_shown;            // the last report; notes follow it
    const SourceFile *file;   // of the last report shown: its include chain is not repeated
    uint64_t *seen;           // hashes of reports; a power of two of slots, 0: free
    size_t n_seen, n_slots;
    Held *held;
    size_t n_held, held_capacity;
    unsigned holds, n_held_errors;
    uint32_t order;
};

Diag *diag_new(Arena *arena, const Sources *sources, FILE *out, bool json, bool color) {
    Diag *diag = ARENA_NEW(arena, Diag);
    *diag = (Diag){.arena = arena,
                   .sources = sources,
                   .out = out,
                   .is_json = json,
                   .is_color = color,
                   .n_slots = 64};
    memset(diag->levels, LEVEL_ON, sizeof diag->levels);
    diag->seen = ARENA_ARRAY(arena, diag->n_slots, uint64_t);
    return diag;
}

bool diag_set_warning(Diag *diag, const char *text) {
    Level level = LEVEL_ON;
    if (strncmp(text, "no-", 3) == 0) {
        level = LEVEL_OFF;
        text += 3;
    } else if (strcmp(text, "error") == 0) {
        // Those that are off stay off.
        for (size_t i = 0; i < WARN_COUNT; i++) {
            diag->levels[i] = diag->levels[i] == LEVEL_OFF ? LEVEL_OFF : LEVEL_ERROR;
        }
        return true;
    } else if (strncmp(text, "error=", 6) == 0) {
        level = LEVEL_ERROR;
        text += 6;
    }
    bool is_all = strcmp(text, "all") == 0, is_found = is_all;
    for (size_t i = 0; i < WARN_COUNT; i++) {
        if (is_all || strcmp(warning_infos[i].name, text) == 0) {
            bool keeps_error = is_all && level == LEVEL_ON && diag->levels[i] == LEVEL_ERROR;
            diag->levels[i] = keeps_error ? LEVEL_ERROR : level;
            is_found = true;
        }
    }
    return is_found;
}

static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t n) {
    const unsigned char *b = bytes;
    for (size_t i = 0; i < n; i++) {
        hash = (hash ^ b[i]) * UINT64_C(1099511628211); // FNV-1a
    }
    return hash;
}

static bool insert_hash(uint64_t *slots, size_t n_slots, uint64_t hash) {
    size_t i = hash >> 32 & (n_slots - 1);
    while (slots[i] && slots[i] != hash) {
        i = (i + 1) & (n_slots - 1);
    }
    bool is_new = !slots[i];
    slots[i] = hash;
    return is_new;
}

// False: the same was reported before.
static bool is_new(Diag *diag, const Report *report) {
    uint64_t hash = hash_bytes(UINT64_C(14695981039346656037), &report->where, sizeof(Span));
    hash = hash_bytes(hash, report->message, strlen(report->message)) | 1;
    if (!insert_hash(diag->seen, diag->n_slots, hash)) {
        return false;
    }
    if (2 * ++diag->n_seen > diag->n_slots) {
        size_t n_slots = 2 * diag->n_slots;
        uint64_t *larger = ARENA_ARRAY(diag->arena, n_slots, uint64_t);
        for (size_t i = 0; i < diag->n_slots; i++) {
            if (diag->seen[i]) {
                insert_hash(larger, n_slots, diag->seen[i]);
            }
        }
        diag->seen = larger;
        diag->n_slots = n_slots;
    }
    return true;
}

static const char *severity_text(Severity severity) {
    static const char *const texts[] = {"error", "warning", "note", "print"};
    return texts[severity];
}

static void put_json_place(FILE *out, SourcePlace place) {
    fputs("\"file\":", out);
    if (place.file) {
        json_string(out, place.file->path);
    } else {
        fputs("null", out);
    }
    fprintf(out, ",\"line\":%" PRIu32 ",\"column\":%" PRIu32, place.line, place.column);
}

static void put_json(Diag *diag, const Report *report) {
    FILE *out = diag->out;
    SourcePlace from = source_place(diag->sources, report->where.lo);
    SourcePlace to = source_place(diag->sources, report->where.hi);
    fprintf(out, "{\"version\":1,\"severity\":\"%s\",", severity_text(report->severity));
    put_json_place(out, from);
    fprintf(out, ",\"end_line\":%" PRIu32 ",\"end_column\":%" PRIu32 ",\"name\":", to.line,
            to.column);
    if (report->name) {
        json_string(out, report->name);
    } else {
        fputs("null", out);
    }
    fputs(",\"message\":", out);
    json_string(out, report->message);
    fputs(",\"hint\":", out);
    if (report->hint) {
        json_string(out, report->hint);
    } else {
        fputs("null", out);
    }
    if (from.file && from.file->included_from.hi) {
        const char *separator = "";
        fputs(",\"included_from\":[", out);
        for (Span at = from.file->included_from; at.hi;) {
            SourcePlace place = source_place(diag->sources, at.lo);
            fprintf(out, "%s{", separator);
            put_json_place(out, place);
            fputc('}', out);
            separator = ",";
            at = place.file ? place.file->included_from : (Span){0};
        }
        fputc(']', out);
    }
    fputs("}\n", out);
}

// The places that led to this file, the main file's first.
static void put_include_chain(Diag *diag, Span included_from) {
    SourcePlace place = source_place(diag->sources, included_from.lo);
    if (!included_from.hi || !place.file) {
        return;
    }
    put_include_chain(diag, place.file->included_from);
    excerpt_text(diag->out, place.file->path);
    fprintf(diag->out, ":%" PRIu32 ":%" PRIu32 ": in the file included here:\n", place.line,
            place.column);
}

static void put_text(Diag *diag, const Report *report) {
    static const char *const colors[] = {"\033[1;31m", "\033[1;35m", "\033[1;36m"};
    const char *bold = diag->is_color ? "\033[1m" : "", *off = diag->is_color ? "\033[0m" : "";
    const char *color = diag->is_color ? colors[report->severity] : "";
    FILE *out = diag->out;
    SourcePlace place = source_place(diag->sources, report->where.lo);
    if (place.file != diag->file && place.file && report->severity != DIAG_NOTE) {
        put_include_chain(diag, place.file->included_from);
    }
    fputs(bold, out);
    if (place.file) {
        excerpt_text(out, place.file->path);
        fprintf(out, ":%" PRIu32 ":%" PRIu32 ": ", place.line, place.column);
    } else {
        fputs("st4: ", out);
    }
    fprintf(out, "%s%s:%s%s ", color, severity_text(report->severity), off, bold);
    excerpt_text(out, report->message);
    fputs(off, out);
    if (report->name) {
        fprintf(out, " [-W%s%s]", report->is_raised ? "error=" : "", report->name);
    }
    fputc('\n', out);
    excerpt_print(out, place, report->where, report->hint, color, off);
}

static const char *lasting(Diag *diag, const char *text) {
    return text ? arena_string(diag->arena, text, strlen(text)) : NULL;
}

static void hold(Diag *diag, const Report *report) {
    diag->held =
        arena_grow(diag->arena, diag->held, diag->n_held, &diag->held_capacity, sizeof *diag->held);
    Held *held = &diag->held[diag->n_held];
    *held = (Held){*report, diag->order, (uint32_t)diag->n_held};
    held->report.hint = lasting(diag, report->hint);
    held->report.message = lasting(diag, report->message);
    diag->n_held++;
}

static void show(Diag *diag, const Report *report) {
    diag->is_shown = true;
    if (diag->holds) {
        hold(diag, report);
        return;
    }
    if (diag->is_json) {
        put_json(diag, report);
    } else {
        put_text(diag, report);
    }
    const SourceFile *file = source_of(diag->sources, report->where.lo);
    if (file && report->severity != DIAG_NOTE) {
        diag->file = file;
    }
}

static void show_error(Diag *diag, const Report *report) {
    diag->is_shown = false;
    diag->n_errors++;
    if (diag->holds) {
        if (diag->n_held_errors++ < MOST_HELD) {
            show(diag, report);
        }
    } else if (diag->n_shown < DIAG_MAX_ERRORS) {
        diag->n_shown++;
        show(diag, report);
    }
}

void diag_error(Diag *diag, Span where, const char *hint, const char *format, ...) {
    char message[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    Report report = {.severity = DIAG_ERROR, .where = where, .hint = hint, .message = message};
    // What follows from an error is none of its own: not shown, and not counted.
    if (diag->has_statement_error || !is_new(diag, &report)) {
        diag->is_shown = false;
        return;
    }
    diag->has_statement_error = true;
    show_error(diag, &report);
}

void diag_warn(Diag *diag, Warning warning, Span where, const char *hint, const char *format, ...) {
    char message[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    bool is_raised = diag->levels[warning] == LEVEL_ERROR;
    Report report = {.severity = is_raised ? DIAG_ERROR : DIAG_WARNING,
                     .where = where,
                     .name = warning_infos[warning].name,
                     .is_raised = is_raised,
                     .hint = hint,
                     .message = message};
    diag->is_shown = false;
    if (diag->levels[warning] == LEVEL_OFF || !is_new(diag, &report)) {
        return;
    }
    if (is_raised) {
        show_error(diag, &report);
    } else {
        diag->n_warnings++;
        show(diag, &report);
    }
}

void diag_note(Diag *diag, Span where, const char *format, ...) {
    if (!diag->is_shown) {
        return;
    }
    char message[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    show(diag, &(Report){.severity = DIAG_NOTE, .where = where, .message = message});
}

void diag_print(Diag *diag, Span where, const char *line) {
    if (diag->is_json) {
        put_json(diag, &(Report){.severity = DIAG_PRINT, .where = where, .message = line});
    } else {
        excerpt_text(diag->out, line);
        fputc('\n', diag->out);
    }
}

void diag_next_statement(Diag *diag) {
    diag->has_statement_error = false;
}

void diag_hold(Diag *diag) {
    diag->holds++;
}

void diag_order(Diag *diag, uint32_t order) {
    diag->order = diag->holds > 1 ? diag->order : order;
}

static int compare_held(const void *a, const void *b) {
    const Held *x = a, *y = b;
    if (x->order != y->order) {
        return x->order < y->order ? -1 : 1;
    }
    return (x->index > y->index) - (x->index < y->index);
}

void diag_release(Diag *diag) {
    if (--diag->holds || !diag->n_held) {
        return;
    }
    qsort(diag->held, diag->n_held, sizeof *diag->held, compare_held);
    for (size_t i = 0; i < diag->n_held; i++) {
        const Report *report = &diag->held[i].report;
        bool is_error = report->severity == DIAG_ERROR, is_note = report->severity == DIAG_NOTE;
        if (!is_note) {
            diag->is_shown = !is_error || diag->n_shown < DIAG_MAX_ERRORS;
            diag->n_shown += is_error && diag->is_shown;
        }
        if (diag->is_shown) {
            show(diag, report);
        }
    }
    diag->n_held = 0;
    diag->n_held_errors = 0;
}

unsigned diag_n_errors(const Diag *diag) {
    return diag->n_errors;
}

unsigned diag_n_warnings(const Diag *diag) {
    return diag->n_warnings;
}

void diag_finish(Diag *diag) {
    unsigned hidden = diag->n_errors - diag->n_shown;
    if (!hidden) {
        return;
    }
    if (diag->is_json) {
        fprintf(diag->out,
                "{\"version\":1,\"severity\":\"note\",\"file\":null,\"line\":0,\"column\":0,"
                "\"end_line\":0,\"end_column\":0,\"name\":null,\"message\":\"%u more errors\","
                "\"hint\":null}\n",
                hidden);
    } else {
        fprintf(diag->out, "st4: %u more error%s, not shown\n", hidden, hidden == 1 ? "" : "s");
    }
}
