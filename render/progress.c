// SPDX-License-Identifier: Apache-2.0
// Progress on standard error.
#include "render/progress.h"

#include <math.h>

#include "accel/clock.h"

// Seconds between two lines.
static double interval(const Progress *progress) {
    return progress->kind == PROGRESS_BAR ? 0.1 : 1;
}

void progress_begin(Progress *progress, ProgressKind kind, uint32_t n_frames, uint64_t total) {
    double now = clock_seconds();
    *progress =
        (Progress){.kind = kind, .total = total, .start = now, .since = INFINITY, .next = now};
    if (kind == PROGRESS_JSON) {
        fprintf(stderr, "{\"version\":1,\"event\":\"begin\",\"frames\":%u,\"samples\":%llu}\n",
                n_frames, (unsigned long long)total);
    }
}

void progress_frame(Progress *progress, int64_t frame) {
    progress->frame = frame;
    progress->noise = 0;
    progress->since = clock_seconds();
}

static double traced_seconds(const Progress *progress, double now) {
    return progress->seconds + fmax(0, now - progress->since);
}

void progress_pause(Progress *progress) {
    progress->seconds = traced_seconds(progress, clock_seconds());
    progress->since = INFINITY;
}

void progress_judge(Progress *progress, uint64_t left, double noise) {
    progress->total = progress->traced + progress->skipped + left;
    progress->noise = noise;
}

static void print_bar(const Progress *progress, double done, double rate, double left) {
    enum { WIDTH = 24 };
    static const char marks[] = "========================";
    int n = (int)(done * WIDTH);
    fprintf(stderr, "\r\033[K%3d %% [%.*s%*s] frame %lld, %.2f Msamples/s", (int)(done * 100), n,
            marks, WIDTH - n, "", (long long)progress->frame, rate * 1e-6);
    if (progress->noise > 0) {
        fprintf(stderr, ", noise %.3g", progress->noise);
    }
    if (left < 100) {
        fprintf(stderr, ", %.0f s left", left);
    } else if (left < 100 * 60) {
        fprintf(stderr, ", %.0f min left", left / 60);
    } else {
        fprintf(stderr, ", %.1f h left", left / 3600);
    }
    fflush(stderr);
}

static double done_of(const Progress *progress, uint64_t traced) {
    uint64_t n_done = traced + progress->skipped;
    return n_done < progress->total ? (double)n_done / (double)progress->total : 1;
}

static void print(const Progress *progress, uint64_t traced, double now) {
    double seconds = traced_seconds(progress, now);
    double done = done_of(progress, traced);
    double rate = seconds > 0 ? (double)traced / seconds : 0;
    double left = rate > 0 ? (1 - done) * (double)progress->total / rate : 0;
    if (progress->kind == PROGRESS_BAR) {
        print_bar(progress, done, rate, left);
    } else {
        fprintf(stderr,
                "{\"version\":1,\"event\":\"progress\",\"frame\":%lld,\"done\":%.4f,"
                "\"samples_per_second\":%.0f,\"seconds_left\":%.1f",
                (long long)progress->frame, done, rate, left);
        if (progress->noise > 0) {
            fprintf(stderr, ",\"noise\":%.4g", progress->noise);
        }
        fputs("}\n", stderr);
    }
}

void progress_add(Progress *progress, uint64_t samples) {
    uint64_t traced = __atomic_add_fetch(&progress->traced, samples, __ATOMIC_RELAXED);
    if (progress->kind == PROGRESS_NONE) {
        return;
    }
    double now = clock_seconds();
#pragma omp critical(progress)
    if (now >= progress->next || traced + progress->skipped == progress->total) {
        progress->next = now + interval(progress);
        print(progress, traced, now);
    }
}

void progress_skip(Progress *progress, uint64_t samples) {
    progress->skipped += samples;
}

void progress_left(Progress *progress, uint64_t samples) {
    uint64_t done = samples < progress->total ? progress->total - samples : 0;
    progress->skipped = done > progress->traced ? done - progress->traced : 0;
}

void progress_written(Progress *progress, int64_t frame) {
    if (progress->kind == PROGRESS_JSON) {
        fprintf(stderr, "{\"version\":1,\"event\":\"frame\",\"frame\":%lld,\"done\":%.4f}\n",
                (long long)frame, done_of(progress, progress->traced));
    }
}

void progress_end(Progress *progress) {
    if (progress->kind == PROGRESS_BAR) {
        fputs("\r\033[K", stderr);
        fflush(stderr);
    } else if (progress->kind == PROGRESS_JSON) {
        fprintf(stderr, "{\"version\":1,\"event\":\"end\",\"done\":%.4f,\"seconds\":%.3f}\n",
                done_of(progress, progress->traced), clock_seconds() - progress->start);
    }
}
