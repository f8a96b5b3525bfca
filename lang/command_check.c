// SPDX-License-Identifier: Apache-2.0
// st4 check: what moves, how fast, and how exactly it was sampled; nothing is traced.
#include "lang/command.h"

#include "lang/session.h"

typedef struct {
    bool is_quiet, moves; // the shape at hand, a fade of it included
    uint32_t n_shapes, n_fades, n_moving;
} Table;

// A shape once, however many forms it fades through.
static void count(Table *table, bool is_fade, bool moves) {
    table->n_shapes += !is_fade;
    table->n_fades += is_fade;
    table->moves = is_fade && table->moves;
    table->n_moving += moves && !table->moves;
    table->moves |= moves;
}

static void print_motion(void *context, const ShapeMotion *motion) {
    Table *table = context;
    bool deforms = motion->n_keys > 1, moves = deforms || motion->moves_as_body;
    count(table, motion->shape->fade != NULL, moves);
    if (table->n_shapes + table->n_fades == 1 && !table->is_quiet) {
        printf("%-28s %-10s %12s %9s %10s %12s\n", "shape", "motion", "px a frame", "instants",
               "error px", "bytes");
    }
    if (table->is_quiet) {
        return;
    }
    const char *kind = deforms && motion->moves_as_body ? "both"
                       : deforms                        ? "deforms"
                       : moves                          ? "as a body"
                                                        : "still";
    char label[64];
    const char *fading = motion->shape->fade ? ", fading" : "";
    snprintf(label, sizeof label, motion->shape->n_instances > 1 ? "%s%s (%u times)" : "%s%s",
             motion->shape->label, fading, motion->shape->n_instances);
    printf("%-28s %-10s %12.3g %9u %10.2g %12zu\n", label, kind, motion->pixels_per_frame,
           motion->n_keys, motion->error_pixels, motion->bytes);
    if (motion->shape->clock && motion->n_prototypes > 1) {
        printf("  with %u prototypes, vertex arrays that differ\n", motion->n_prototypes);
    }
}

static int check(const Session *session) {
    RenderOptions render;
    if (!session_render_options(session, &render)) {
        return STATUS_USAGE;
    }
    Table table = {.is_quiet = option_flag(session->options, OPTION_QUIET)};
    CheckTotals totals;
    int status =
        render_check(session->scene, &render, &session->reporter, print_motion, &table, &totals);
    if (!table.is_quiet && status == STATUS_OK) {
        printf("%u of %u shapes move in %u frame%s", table.n_moving, table.n_shapes,
               session->n_frames, session->n_frames == 1 ? "" : "s");
        if (table.n_fades > 0) {
            printf(", with %u fade%s from clip to clip", table.n_fades,
                   table.n_fades == 1 ? "" : "s");
        }
        printf("; %u error%s, %u warning%s\n", diag_n_errors(session->diag),
               diag_n_errors(session->diag) == 1 ? "" : "s", diag_n_warnings(session->diag),
               diag_n_warnings(session->diag) == 1 ? "" : "s");
        printf("%.3g MB of vertex arrays, with trees roughly %.3g MB, in %u block%s of frames\n",
               (double)totals.array_bytes / 1e6, (double)totals.bytes / 1e6, totals.n_blocks,
               totals.n_blocks == 1 ? "" : "s");
    }
    return status;
}

int command_check(Arena *arena, const Options *options) {
    Session session;
    int status = session_open(&session, arena, options);
    return status ? status : session_close(&session, check(&session));
}
