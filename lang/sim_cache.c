// SPDX-License-Identifier: Apache-2.0
// Files of simulations: found by their key, checked, made.
#include "lang/sim_cache.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/outfile.h"

enum { VERSION = 3, MESSAGE = 256 }; // VERSION: of the file, and of how it is computed

// What a file begins with. n_values numbers follow: born, dies, birth and end of the members, keys
// of arcs, key, start and rate of pieces, coefficients.
typedef struct {
    char magic[8];
    uint64_t version;
    Hash128 key, checksum; // of all else
    uint64_t n_values;
    SimTracks tracks; // its pointers are NULL
} Header;

static const char magic[8] = "st4-sim";

const char *sim_cache_folder(Arena *arena, const char *given) {
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    if (given) {
        return given;
    }
    if (cache && *cache == '/') {
        return arena_printf(arena, "%s/st4", cache);
    }
    return home && *home ? arena_printf(arena, "%s/.cache/st4", home) : NULL;
}

// ---- Numbers in the order of the file

enum { ARRAYS = 9 };

typedef struct {
    const double **at;
    size_t n;
} Array;

static void arrays_of(SimTracks *s, Array arrays[ARRAYS]) {
    const size_t members = s->n_members, pieces = s->n_pieces;
    const Array all[ARRAYS] = {{&s->born, members},
                               {&s->dies, members},
                               {&s->birth, members},
                               {&s->end, members},
                               {&s->arc_key, s->n_arcs},
                               {&s->piece_key, pieces},
                               {&s->piece_start, pieces},
                               {&s->piece_rate, pieces},
                               {&s->coefficient, pieces * s->n_columns * s->n_coefficients}};
    memcpy(arrays, all, sizeof all);
}

static size_t count(SimTracks *tracks) {
    Array arrays[ARRAYS];
    size_t n = 0;
    arrays_of(tracks, arrays);
    for (int i = 0; i < ARRAYS; i++) {
        n += arrays[i].n;
    }
    return n;
}

static Hash128 checksum_of(const Header *header, const double *values) {
    Header bytes;
    Hash128 checksum = {0};
    memcpy(&bytes, header, sizeof bytes); // holes included
    memset(&bytes.checksum, 0, sizeof bytes.checksum);
    hash_add(&checksum, &bytes, sizeof bytes);
    hash_add(&checksum, values, header->n_values * sizeof *values);
    return checksum;
}

// ---- Reading

static bool is_plausible(const Header *header, const Hash128 *key, off_t size) {
    SimTracks tracks = header->tracks;
    return memcmp(header->magic, magic, sizeof magic) == 0 && header->version == VERSION &&
           memcmp(&header->key, key, sizeof *key) == 0 && tracks.n_members > 0 &&
           tracks.n_pieces > 0 && tracks.n_columns <= 4096 && tracks.n_coefficients <= 16 &&
           count(&tracks) == header->n_values &&
           (uint64_t)size == sizeof *header + header->n_values * sizeof(double);
}

// False: it is not there, or not to be trusted.
static bool load(Arena *arena, const char *path, const Hash128 *key, SimTracks *tracks) {
    FILE *file = fopen(path, "rb");
    Header header;
    struct stat about;
    if (!file) {
        return false;
    }
    bool is_fine = fstat(fileno(file), &about) == 0 &&
                   fread(&header, sizeof header, 1, file) == 1 &&
                   is_plausible(&header, key, about.st_size);
    if (is_fine) {
        double *values = ARENA_ARRAY(arena, header.n_values, double);
        Array arrays[ARRAYS];
        is_fine = fread(values, sizeof *values, header.n_values, file) == header.n_values;
        Hash128 checksum = is_fine ? checksum_of(&header, values) : (Hash128){0};
        is_fine = is_fine && memcmp(&checksum, &header.checksum, sizeof checksum) == 0;
        *tracks = header.tracks;
        arrays_of(tracks, arrays);
        for (int i = 0; i < ARRAYS; i++) {
            *arrays[i].at = values;
            values += arrays[i].n;
        }
    }
    fclose(file);
    return is_fine;
}

// ---- Writing

static bool make_folder(const char *path) {
    char *copy = strdup(path);
    for (char *at = copy ? copy + 1 : NULL; at && *at; at++) {
        if (*at == '/') {
            *at = '\0';
            mkdir(copy, 0777);
            *at = '/';
        }
    }
    bool is_there = copy && (mkdir(copy, 0777) == 0 || errno == EEXIST);
    free(copy);
    return is_there;
}

static bool put(int fd, const void *bytes, size_t n) {
    const char *at = bytes;
    while (n > 0) {
        ssize_t done = write(fd, at, n);
        if (done <= 0 && errno != EINTR) {
            return false;
        }
        at += done > 0 ? done : 0;
        n -= done > 0 ? (size_t)done : 0;
    }
    return true;
}

static bool store(const char *folder, const char *path, const Hash128 *key, SimTracks *tracks,
                  char message[MESSAGE]) {
    Arena scratch = {0};
    OutFile file;
    Array arrays[ARRAYS];
    Header header;
    memset(&header, 0, sizeof header); // holes included
    size_t n = count(tracks), done = 0;
    double *values = ARENA_ARRAY(&scratch, n, double);
    arrays_of(tracks, arrays);
    for (int i = 0; i < ARRAYS; i++) {
        memcpy(values + done, *arrays[i].at, arrays[i].n * sizeof *values);
        done += arrays[i].n;
    }
    memcpy(header.magic, magic, sizeof magic);
    header.version = VERSION;
    header.key = *key;
    header.n_values = n;
    memcpy(&header.tracks, tracks, sizeof *tracks);
    Array own[ARRAYS];
    arrays_of(&header.tracks, own);
    for (int i = 0; i < ARRAYS; i++) {
        *own[i].at = NULL;
    }
    header.checksum = checksum_of(&header, values);
    snprintf(message, MESSAGE, "cannot create the folder: %s", strerror(errno));
    bool is_open = make_folder(folder) && outfile_open(&file, path, message, MESSAGE);
    bool is_fine =
        is_open && put(file.fd, &header, sizeof header) && put(file.fd, values, n * sizeof *values);
    if (is_open && !is_fine) {
        snprintf(message, MESSAGE, "cannot write: %s", strerror(errno));
        outfile_abandon(&file);
    }
    is_fine = is_fine && outfile_commit(&file, message, MESSAGE);
    arena_free(&scratch);
    return is_fine;
}

// ---- The simulator

typedef struct {
    FILE *to;
    const char *name;
    int percent;
} Told;

static void tell(void *context, double part) {
    Told *told = context;
    int percent = (int)(100 * part);
    if (told->to && percent != told->percent) {
        told->percent = percent;
        fprintf(told->to, "\rsimulating %s: %3d %%", told->name, percent);
        fflush(told->to);
    }
}

static bool run(SimCache *cache, Arena *arena, const SimJob *job, SimTracks *tracks,
                SimFailure *failure) {
    Told told = {cache->progress, job->name, -1};
    bool is_fine = job->rigid ? sim_rigid_run(arena, job->rigid, tell, &told, tracks, failure)
                              : sim_state_run(arena, job->state, tell, &told, tracks, failure);
    if (told.percent >= 0) {
        fputs("\r\033[K", told.to);
    }
    return is_fine;
}

static bool find(void *context, Arena *arena, const SimJob *job, SimTracks *tracks,
                 SimFailure *failure) {
    SimCache *cache = context;
    const char *library = job->rigid ? sim_rigid_library() : sim_state_library();
    const uint64_t version = VERSION;
    Hash128 key = job->key;
    char text[33], message[MESSAGE];
    hash_add(&key, library, strlen(library));
    hash_add(&key, &version, sizeof version);
    hash_text(&key, text);
    const char *path = cache->folder ? arena_printf(arena, "%s/%s.sim", cache->folder, text) : NULL;
    bool is_there = path && load(arena, path, &key, tracks);
    if (!is_there && !run(cache, arena, job, tracks, failure)) {
        return false;
    }
    if (!is_there && path && !store(cache->folder, path, &key, tracks, message)) {
        fprintf(cache->reports, "st4: warning: %s: %s\n", path, message);
        path = NULL;
    }
    if (cache->list) {
        fprintf(cache->list, "%-16s %8u member%s %9u pieces  %s  %s\n", job->name,
                tracks->n_members, tracks->n_members == 1 ? " " : "s", tracks->n_pieces,
                is_there ? "kept before" : "simulated  ", path ? path : "not kept");
    }
    return true;
}

Simulator sim_cache_simulator(SimCache *cache, bool runs_all) {
    return (Simulator){find, cache, runs_all};
}
