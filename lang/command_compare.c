// SPDX-License-Identifier: Apache-2.0
// st4 compare: how much a picture differs from a reference.
#include "lang/command.h"

#include "render/compare.h"

// In the order of --metric's words.
typedef enum { METRIC_MSE, METRIC_RMSE, METRIC_RELMSE, METRIC_PSNR, METRIC_MAX } Metric;

static double metric_of(const Comparison *result, Metric metric) {
    switch (metric) {
    case METRIC_MSE:
        return result->mse;
    case METRIC_RMSE:
        return result->rmse;
    case METRIC_RELMSE:
        return result->relative_mse;
    case METRIC_PSNR:
        return result->psnr;
    case METRIC_MAX:
        break;
    }
    return result->maximum;
}

static void print_comparison(const Comparison *result) {
    printf("mse     %.9g\n", result->mse);
    printf("rmse    %.9g\n", result->rmse);
    printf("relmse  %.9g\n", result->relative_mse);
    printf("psnr    %.6g dB\n", result->psnr);
    printf("max     %.9g", result->maximum);
    if (result->maximum_channel) {
        printf(", at pixel %u, %u in %s", result->maximum_x, result->maximum_y,
               result->maximum_channel);
    }
    printf("\nmeans   %.9g and %.9g\n", result->mean_a, result->mean_b);
    printf("values  %llu, of which %llu differ\n", (unsigned long long)result->n_values,
           (unsigned long long)result->n_different);
}

// Values that are no number in one picture alone are a difference that no mean shows.
static bool warn_not_finite(const Comparison *result) {
    if (result->n_not_finite_a || result->n_not_finite_b) {
        fprintf(stderr, "st4: warning: %llu and %llu values are not finite and were left out\n",
                (unsigned long long)result->n_not_finite_a,
                (unsigned long long)result->n_not_finite_b);
    }
    return result->n_not_finite_a != result->n_not_finite_b;
}

static bool read_picture(Arena *arena, const char *path, Image *image) {
    char message[256];
    if (image_read(arena, path, image, message, sizeof message)) {
        return true;
    }
    fprintf(stderr, "st4: error: %s: %s\n", path, message);
    return false;
}

int command_compare(Arena *arena, const Options *options) {
    const char *a_path = options->operands[0], *b_path = options->operands[1];
    Image a, b;
    if (!read_picture(arena, a_path, &a) || !read_picture(arena, b_path, &b)) {
        return STATUS_FILES;
    }
    Comparison result;
    char message[256];
    if (!compare_images(&a, &b, options->values[OPTION_CHANNEL].text, &result, message,
                        sizeof message)) {
        fprintf(stderr, "st4: error: %s and %s: %s\n", a_path, b_path, message);
        return STATUS_FILES;
    }
    Metric metric = (Metric)options->values[OPTION_METRIC].integer;
    double measured = metric_of(&result, metric);
    if (option_flag(options, OPTION_QUIET)) {
        printf("%.9g\n", measured);
    } else {
        print_comparison(&result);
    }
    const OptionValue *bound = &options->values[OPTION_FAIL_ABOVE];
    bool is_broken = warn_not_finite(&result);
    bool is_far = metric == METRIC_PSNR ? measured < bound->number : measured > bound->number;
    return bound->is_set && (is_far || is_broken) ? STATUS_SCENE : STATUS_OK;
}
