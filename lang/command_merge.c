// SPDX-License-Identifier: Apache-2.0
// st4 merge: slices of samples become a picture.
#include "lang/command.h"

#include "render/merge.h"

int command_merge(Arena *arena, const Options *options) {
    size_t n_outs;
    const char *const *outs = options_list(arena, options, OPTION_OUT, &n_outs);
    if (!n_outs) {
        fputs("st4: error: merge needs -o, the picture or file of sums to write\n", stderr);
        return STATUS_USAGE;
    }
    MergedSamples samples;
    char message[8192];
    if (!merge_films(options->operands, options->n_operands, outs, n_outs, &samples, message,
                     sizeof message)) {
        fprintf(stderr, "st4: error: %s\n", message);
        return STATUS_FILES;
    }
    if (!option_flag(options, OPTION_QUIET)) {
        fprintf(stderr, "st4: wrote %s%s, samples %u to %u of %u\n", outs[0],
                n_outs > 1 ? " and others" : "", samples.first, samples.last, samples.spp);
    }
    return STATUS_OK;
}
