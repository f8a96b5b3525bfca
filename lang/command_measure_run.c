// SPDX-License-Identifier: Apache-2.0
// st4 measure: one rendering, by this program in a process of its own.
#include "lang/command_measure.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "accel/clock.h"

enum { MOST_ARGUMENTS = 256, STATS_SIZE = 1 << 16 };

static volatile sig_atomic_t was_asked_to_stop;
static volatile pid_t running;

typedef struct {
    char *of[MOST_ARGUMENTS];
    size_t n;
} Arguments;

const char *measure_path(const Measure *measure, const char *name) {
    return arena_printf(measure->arena, "%s/%s", measure->folder, name);
}

double measure_left(const Measure *measure) {
    return measure->budget - (clock_seconds() - measure->start);
}

const char *measure_arguments(Arena *arena, const MeasureSetting *s) {
    const char *text = arena_printf(arena, "-s %u", s->spp);
    if (s->subframes) {
        text = arena_printf(arena, "%s --method accumulate --subframes %u", text, s->subframes);
    }
    if (s->tolerance > 0) {
        text = arena_printf(arena, "%s --tolerance %g", text, s->tolerance);
    }
    if (s->accel) {
        text = arena_printf(arena, "%s --accel %s", text, s->accel);
    }
    if (s->kappa > 0) {
        text = arena_printf(arena, "%s --kappa %g", text, s->kappa);
    }
    if (s->leaf_size) {
        text = arena_printf(arena, "%s --leaf-size %u", text, s->leaf_size);
    }
    return s->cpu ? arena_printf(arena, "%s --cpu %s", text, s->cpu) : text;
}

static void put(Arguments *arguments, const char *text, Arena *arena) {
    if (arguments->n + 1 < MOST_ARGUMENTS) {
        arguments->of[arguments->n++] = arena_string(arena, text, strlen(text));
    }
}

// The words of a text without quotes.
static void put_words(Arguments *arguments, const char *text, Arena *arena) {
    while (*text) {
        size_t n = strcspn(text, " ");
        put(arguments, arena_string(arena, text, n), arena);
        text += n + (text[n] == ' ');
    }
}

// Options of the scene and the machine, which go to every run alike.
static bool is_common(OptionId option) {
    switch (option) {
    case OPTION_DEFINE:
    case OPTION_INCLUDE:
    case OPTION_SIZE:
    case OPTION_FPS:
    case OPTION_SHUTTER:
    case OPTION_THREADS:
    case OPTION_MEMORY:
    case OPTION_BAKE:
    case OPTION_MAX_DEPTH:
    case OPTION_VALIDATE:
        return true;
    default:
        return false;
    }
}

static void put_common(Arguments *arguments, const Options *options, Arena *arena) {
    for (size_t i = 0; i < options->n_uses; i++) {
        const OptionUse *use = &options->uses[i];
        if (is_common(use->option)) {
            put(arguments, option_spelling(arena, use->option), arena);
            if (use->text) {
                put(arguments, use->text, arena);
            }
        }
    }
}

// A word as a shell reads it.
static const char *quoted(Arena *arena, const char *word) {
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                "-_=./,:+@%";
    if (*word && word[strspn(word, plain)] == '\0') {
        return word;
    }
    const char *text = "'";
    for (; *word; word++) {
        text = *word == '\'' ? arena_printf(arena, "%s'\\''", text)
                             : arena_printf(arena, "%s%c", text, *word);
    }
    return arena_printf(arena, "%s'", text);
}

const char *measure_command(const Measure *measure, const char *arguments) {
    Arena *arena = measure->arena;
    Arguments common = {0};
    put_common(&common, measure->options, arena);
    const char *text = arena_printf(arena, "st4 render %s", quoted(arena, measure->scene));
    for (size_t i = 0; i < common.n; i++) {
        text = arena_printf(arena, "%s %s", text, quoted(arena, common.of[i]));
    }
    return arena_printf(arena, "%s %s", text, arguments);
}

static void stop(int signal) {
    was_asked_to_stop = 1;
    if (running > 0) {
        kill(running, signal);
    }
}

static const char *own_path(Arena *arena) {
    char path[4096];
    ssize_t n = readlink("/proc/self/exe", path, sizeof path);
    return n > 0 && (size_t)n < sizeof path ? arena_string(arena, path, (size_t)n) : NULL;
}

// True: it took longer than it may, and was ended.
static bool wait_for(const Measure *measure, pid_t child, int *status) {
    const struct timespec pause = {0, 5000000};
    double end = measure_left(measure) - measure->run_limit;
    bool is_late = false;
    for (;;) {
        pid_t ended = waitpid(child, status, WNOHANG);
        if (ended == child || (ended < 0 && errno != EINTR)) {
            return is_late;
        }
        if (!is_late && measure->run_limit > 0 && measure_left(measure) < end) {
            is_late = true;
            kill(child, SIGTERM);
        }
        nanosleep(&pause, NULL);
    }
}

// An exit status of the program; STATUS_LATE; 3 where it could not be run or ended by itself.
static int run_program(const Measure *measure, char *const *arguments) {
    extern char **environ;
    struct sigaction action = {.sa_handler = stop};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGINT);
    sigaddset(&defaults, SIGTERM);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, measure_path(measure, "log"),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0666);
    pid_t child;
    int status = posix_spawn(&child, arguments[0], &files, &attributes, arguments, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (status) {
        fprintf(stderr, "st4: error: %s: cannot be run: %s\n", arguments[0], strerror(status));
        return STATUS_FILES;
    }
    running = child;
    bool is_late = wait_for(measure, child, &status);
    running = 0;
    if (was_asked_to_stop) {
        return STATUS_INTERRUPTED;
    }
    if (is_late) {
        return STATUS_LATE;
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : STATUS_FILES;
}

// The number `name` of the object `object` of a statistics file; 0 where there is none.
static double number_in(const char *text, const char *object, const char *name) {
    char key[64];
    snprintf(key, sizeof key, "\"%s\": {", object);
    const char *at = strstr(text, key), *end = at ? strchr(at, '}') : NULL;
    snprintf(key, sizeof key, "\"%s\": ", name);
    at = at ? strstr(at, key) : NULL;
    return at && at < end ? strtod(at + strlen(key), NULL) : 0;
}

static bool read_work(const char *path, MeasureWork *work) {
    static char text[STATS_SIZE];
    FILE *file = fopen(path, "r");
    if (!file) {
        return false;
    }
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    work->update = number_in(text, "seconds", "sample");
    work->build = number_in(text, "seconds", "segment") + number_in(text, "seconds", "build");
    work->trace = number_in(text, "seconds", "trace");
    work->vertex_bytes = number_in(text, "bytes", "vertices");
    work->tree_bytes = number_in(text, "bytes", "segments") + number_in(text, "bytes", "tree");
    work->rays = number_in(text, "rays", "camera") + number_in(text, "rays", "shadow") +
                 number_in(text, "rays", "bounce");
    return true;
}

static double children_seconds(void) {
    struct rusage usage;
    getrusage(RUSAGE_CHILDREN, &usage);
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

int measure_render(Measure *measure, const char *name, const MeasureSetting *setting, uint64_t seed,
                   MeasureWork *work) {
    Arena *arena = measure->arena;
    Arguments arguments = {0};
    const char *own = own_path(arena);
    const char *stats = measure_path(measure, "stats.json");
    if (!own) {
        fprintf(stderr, "st4: error: cannot find this program's file: /proc is not there\n");
        return STATUS_FILES;
    }
    put(&arguments, own, arena);
    put(&arguments, "render", arena);
    put_common(&arguments, measure->options, arena);
    put_words(&arguments, measure_arguments(arena, setting), arena);
    put_words(&arguments,
              arena_printf(arena, "-q --progress none -f %lld --seed %llu",
                           (long long)measure->frame, (unsigned long long)seed),
              arena);
    put(&arguments, "--stats", arena);
    put(&arguments, stats, arena);
    put(&arguments, "-o", arena);
    put(&arguments, arena_printf(arena, "%s.exr", measure_path(measure, name)), arena);
    put(&arguments, "--", arena);
    put(&arguments, measure->scene, arena);
    double before = children_seconds();
    int status = run_program(measure, arguments.of);
    if (status == STATUS_OK && !read_work(stats, work)) {
        fprintf(stderr, "st4: error: %s: cannot read: %s\n", stats, strerror(errno));
        return STATUS_FILES;
    }
    work->cpu = children_seconds() - before;
    return status;
}
