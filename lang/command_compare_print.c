// SPDX-License-Identifier: Apache-2.0
// st4 compare: what it prints.
#include "lang/command_compare.h"

#include <math.h>

#include "lang/json.h"

double compare_metric(const CompareReport *report, const CompareRecord *record, Metric metric) {
    const Comparison *numbers = &record->numbers;
    switch (metric) {
    case METRIC_MSE:
        return numbers->mse;
    case METRIC_RMSE:
        return numbers->rmse;
    case METRIC_RELMSE:
        return numbers->relative_mse;
    case METRIC_PSNR:
        return numbers->psnr;
    case METRIC_MAX:
        return numbers->maximum;
    case METRIC_RELRMSE:
        return numbers->relative_rmse;
    case METRIC_SSIM:
        return record->seen.ssim;
    case METRIC_FLIP:
        return record->seen.flip;
    case METRIC_HDRFLIP:
        return record->seen.hdr_flip;
    case METRIC_FLICKER:
        break;
    }
    return report->flicker.deviation;
}

static void print_seen(const char *name, double value) {
    if (!isnan(value)) {
        printf("%s%.9g\n", name, value);
    }
}

static void print_record(const CompareRecord *record) {
    const Comparison *result = &record->numbers;
    printf("mse     %.9g\n", result->mse);
    printf("rmse    %.9g\n", result->rmse);
    printf("relmse  %.9g\n", result->relative_mse);
    printf("relrmse %.9g\n", result->relative_rmse);
    printf("psnr    %.6g dB\n", result->psnr);
    printf("max     %.9g", result->maximum);
    if (result->maximum_channel) {
        printf(", at pixel %u, %u in %s", result->maximum_x, result->maximum_y,
               result->maximum_channel);
    }
    printf("\n");
    print_seen("ssim    ", record->seen.ssim);
    print_seen("flip    ", record->seen.flip);
    print_seen("hdrflip ", record->seen.hdr_flip);
    printf("means   %.9g and %.9g\n", result->mean_a, result->mean_b);
    printf("values  %llu, of which %llu differ\n", (unsigned long long)result->n_values,
           (unsigned long long)result->n_different);
}

static void print_table(const CompareReport *report) {
    printf("%8s %12s %12s %10s %10s %12s\n", "frame", "rmse", "relrmse", "ssim", "flip", "change");
    for (size_t i = 0; i < report->n_records; i++) {
        const CompareRecord *record = &report->records[i];
        printf("%8lld %12.6g %12.6g %10.6f %10.6f %12.6g\n", (long long)record->frame,
               record->numbers.rmse, record->numbers.relative_rmse, record->seen.ssim,
               record->seen.flip, record->change);
    }
    const Flicker *flicker = &report->flicker;
    printf("frames  %u\n", flicker->n_frames);
    printf("flicker %.9g, the error's standard deviation over the frames\n", flicker->deviation);
    printf("change  %.9g, of the error from frame to frame\n", flicker->change);
}

void compare_print_text(const CompareReport *report) {
    if (report->is_film) {
        print_table(report);
        return;
    }
    for (size_t i = 0; i < report->n_records; i++) {
        if (report->n_records > 1) {
            const char *layer = report->records[i].layer;
            printf("%slayer   %s\n", i ? "\n" : "", *layer ? layer : "R, G, B");
        }
        print_record(&report->records[i]);
    }
}

static void put_number(const char *name, double value) {
    printf(", \"%s\": ", name);
    json_number(stdout, value);
}

static void put_text(const char *name, const char *text) {
    printf("\"%s\": ", name);
    json_string(stdout, text);
}

static void put_record(const CompareReport *report, const CompareRecord *record) {
    const Comparison *r = &record->numbers;
    printf("    {");
    if (report->is_film) {
        printf("\"frame\": %lld, ", (long long)record->frame);
    }
    put_text("layer", record->layer);
    put_number("mse", r->mse);
    put_number("rmse", r->rmse);
    put_number("relmse", r->relative_mse);
    put_number("relrmse", r->relative_rmse);
    put_number("psnr", r->psnr);
    put_number("max", r->maximum);
    put_number("mean_a", r->mean_a);
    put_number("mean_b", r->mean_b);
    printf(
        ", \"values\": %llu, \"different\": %llu, \"not_finite_a\": %llu, \"not_finite_b\": %llu",
        (unsigned long long)r->n_values, (unsigned long long)r->n_different,
        (unsigned long long)r->n_not_finite_a, (unsigned long long)r->n_not_finite_b);
    put_number("ssim", record->seen.ssim);
    put_number("flip", record->seen.flip);
    put_number("hdrflip", record->seen.hdr_flip);
    if (report->is_film) {
        put_number("change", record->change);
    }
    printf("}");
}

void compare_print_json(const CompareReport *report, const char *a, const char *b) {
    printf("{\n  \"version\": 1, ");
    put_text("a", a);
    printf(", ");
    put_text("b", b);
    if (report->is_film) {
        printf(",\n  \"n_frames\": %u", report->flicker.n_frames);
        put_number("flicker", report->flicker.deviation);
        put_number("change", report->flicker.change);
    }
    printf(",\n  \"results\": [\n");
    for (size_t i = 0; i < report->n_records; i++) {
        put_record(report, &report->records[i]);
        puts(i + 1 < report->n_records ? "," : "");
    }
    puts("  ]\n}");
}
