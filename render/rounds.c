// SPDX-License-Identifier: Apache-2.0
// Rounds: which level comes next.
#include "render/rounds.h"

#include "accel/clock.h"

// The shares of the time at which a frame ends early, and of what is left that a round may take.
static const double DONE = 0.005, NEARLY_DONE = 0.05, SHARE = 0.5, LAST_SHARE = 0.9;

static const Level PILOT = ADAPTIVE_PILOT * LEVEL_SAMPLE, LEAST = ADAPTIVE_LEAST * LEVEL_SAMPLE;

static double pixels_of(const Film *film) {
    return (double)film->width * film->height;
}

void rounds_begin(Rounds *rounds, const RenderOptions *options, Film *film, Level level,
                  double deadline) {
    double bound = fmax(options->mean_spp * LEVEL_SAMPLE, LEAST);
    *rounds = (Rounds){.options = options,
                       .film = film,
                       .level = level,
                       .bound = (Level)bound,
                       .believed = adaptive_believed(film->width, film->height),
                       .deadline = deadline};
}

// With 64 bits: levels below 2^30.
static Level grow(Level level, double by) {
    double grown = ceil(level * by);
    return grown < 0x1p31 ? (Level)grown : (Level)1 << 31;
}

// Errors fall with the samples as their power -1/2 or faster, where samples are spread evenly up to
// -3/4 at edges: so far it is to the level that will do, at least. Steps are short, as the noise is
// known to some per cent only.
static Level next_for_noise(const Rounds *rounds) {
    double target = rounds->options->noise;
    double ratio = target > 0 ? rounds->noise.at_most / target : INFINITY;
    return grow(rounds->level, fmin(fmax(pow(fmin(ratio, 1e6), 4.0 / 3), 1.06), 2));
}

// What there is time for: half of what is left, so that a machine that slows down is noticed before
// it is too late; nearly all of it at the end.
static Level level_in_time(const Rounds *rounds) {
    double limit = rounds->options->seconds, left = rounds->deadline - clock_seconds();
    if (!(left > DONE * limit)) {
        return 0;
    }
    double share = left > NEARLY_DONE * limit ? SHARE : LAST_SHARE;
    double more = share * left * rounds->speed / pixels_of(rounds->film) * LEVEL_SAMPLE;
    // One that went on from a checkpoint has no round yet that tells.
    return rounds->level + (rounds->speed > 0 ? (Level)fmin(more, 0x1p30) : LEVEL_SAMPLE);
}

static Level first_level(const Rounds *rounds) {
    return rounds->options->seconds > 0 ? LEAST : PILOT;
}

static Level next_level(const Rounds *rounds) {
    Level level = rounds->level, goal = level < PILOT ? PILOT : rounds->believed;
    return level < goal ? (level < goal / 2 ? 2 * level : goal) : next_for_noise(rounds);
}

static bool stop(Rounds *rounds, RenderStop by) {
    rounds->stop = by;
    return false;
}

static void look_back(Rounds *rounds) {
    double seconds = clock_seconds() - rounds->began;
    uint64_t n = film_totals(rounds->film).total - rounds->n_before;
    rounds->noise = adaptive_noise(rounds->film);
    rounds->speed = n > 0 && seconds > 0 ? (double)n / seconds : rounds->speed;
    if (rounds->level == PILOT) {
        adaptive_weigh(rounds->film);
    }
}

// Chooses the level. False: there is none.
static bool go_on(Rounds *rounds) {
    const RenderOptions *options = rounds->options;
    if (rounds->level >= rounds->believed && rounds->noise.at_most <= options->noise) {
        return stop(rounds, STOP_NOISE);
    }
    if (rounds->level >= rounds->bound) {
        return stop(rounds, STOP_SAMPLES);
    }
    Level next = next_level(rounds);
    if (options->seconds > 0) {
        Level most = level_in_time(rounds);
        if (most <= rounds->level) {
            return stop(rounds, STOP_TIME);
        }
        next = most < next ? most : next;
    }
    // Weights are of the pilot, which therefore is a level of its own.
    if (rounds->level < PILOT && next > PILOT) {
        next = PILOT;
    }
    rounds->level = next < rounds->bound ? next : rounds->bound;
    return true;
}

bool rounds_next(Rounds *rounds, TilePass *pass) {
    bool was_begun = rounds->began > 0;
    if (was_begun) {
        look_back(rounds);
    }
    if (rounds->level == 0) {
        Level first = first_level(rounds);
        rounds->level = first < rounds->bound ? first : rounds->bound;
    } else if (was_begun && !go_on(rounds)) {
        return false;
    }
    allocation_find(&rounds->allocation, rounds->film, rounds->level);
    pass->allocation = &rounds->allocation;
    rounds->n_before = film_totals(rounds->film).total;
    rounds->began = clock_seconds();
    return true;
}

uint64_t rounds_expect(const Rounds *rounds) {
    double level = fmax(rounds->level, fmin(PILOT, rounds->bound));
    if (rounds->noise.at_most > rounds->options->noise && rounds->options->noise > 0) {
        double ratio = rounds->noise.at_most / rounds->options->noise;
        level = fmin(rounds->level * ratio * ratio, rounds->bound);
    } else if (!(rounds->options->seconds > 0)) {
        level = rounds->bound;
    }
    double n = level / LEVEL_SAMPLE * pixels_of(rounds->film);
    if (rounds->options->seconds > 0 && rounds->speed > 0) {
        double left = fmax(0, rounds->deadline - clock_seconds());
        n = fmin(n, (double)rounds->n_before + rounds->speed * left);
    }
    return (uint64_t)fmax(n, 1);
}
