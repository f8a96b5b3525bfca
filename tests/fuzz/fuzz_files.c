// SPDX-License-Identifier: Apache-2.0
// A file system that holds the input and the standard library, and nothing else: what the program
// asks of the C library is answered here (fuzz_redirect.h), what it asks of render/infile.h and its
// like too. Whoever would write a file, or run another program, ends the fuzzer.
#define FUZZ_NO_REDIRECT
#include "tests/fuzz/fuzz_files.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "render/infile.h"
#include "render/mesh_child.h"
#include "render/mesh_clips.h"
#include "render/sky_image.h"
#include "render/outfile.h"
#include "tests/fuzz/fuzz_redirect.h"

#define FOLDER  "/f"
#define LIBRARY "/lib"

enum { MAX_LIBRARY = 32, MAX_LIVE = 256, MAX_DEPTH = 64 };

static FuzzFile files[FUZZ_MAX_FILES], library[MAX_LIBRARY];
static size_t n_files, n_library;

// ---- What was allocated or opened

typedef enum { LIVE_MEMORY, LIVE_FILE, LIVE_FOLDER } LiveKind;

typedef struct {
    void *what;
    LiveKind kind;
} Live;

static Live live[MAX_LIVE];
static size_t n_live;

static void *keep(void *what, LiveKind kind) {
    if (what && n_live == MAX_LIVE) {
        abort(); // nothing in the language takes so many at once
    }
    if (what) {
        live[n_live++] = (Live){what, kind};
    }
    return what;
}

static void forget(const void *what) {
    for (size_t i = n_live; what && i-- > 0;) {
        if (live[i].what == what) {
            live[i] = live[--n_live];
            return;
        }
    }
    if (what) {
        abort(); // freed, or closed, twice
    }
}

void *fuzz_malloc(size_t size) {
    return keep(malloc(size), LIVE_MEMORY);
}

void *fuzz_calloc(size_t n, size_t size) {
    return keep(calloc(n, size), LIVE_MEMORY);
}

void *fuzz_realloc(void *memory, size_t size) {
    forget(memory);
    return keep(realloc(memory, size), LIVE_MEMORY);
}

void fuzz_free(void *memory) {
    forget(memory);
    free(memory);
}

size_t fuzz_files_end(void) {
    size_t n = n_live;
    for (size_t i = 0; i < n; i++) {
        if (live[i].kind == LIVE_FILE) {
            fclose(live[i].what);
        } else {
            free(live[i].what);
        }
    }
    n_live = 0;
    return n;
}

// ---- The files there are

// The end of a line's name: "//@ NAME" is at least 5 characters long.
static const char *marker_name(const char *at, const char *end, size_t *n) {
    if (end - at < 5 || memcmp(at, "//@ ", 4) != 0) {
        return NULL;
    }
    const char *stop = memchr(at, '\n', (size_t)(end - at));
    at += 4;
    *n = (size_t)((stop ? stop : end) - at);
    return *n < FUZZ_MAX_NAME && !memchr(at, '\0', *n) ? at : NULL;
}

size_t fuzz_files_begin(const char *data, size_t size, const FuzzFile **all) {
    const char *at = data, *end = data + size;
    n_files = 1;
    files[0] = (FuzzFile){.name = FUZZ_SCRIPT, .text = data, .size = size};
    while (at < end) {
        size_t n = 0;
        const char *name = n_files < FUZZ_MAX_FILES ? marker_name(at, end, &n) : NULL;
        const char *line = memchr(at, '\n', (size_t)(end - at));
        line = line ? line + 1 : end;
        if (name) {
            files[n_files - 1].size = (size_t)(at - files[n_files - 1].text);
            FuzzFile *file = &files[n_files++];
            *file = (FuzzFile){.text = line, .size = (size_t)(end - line)};
            memcpy(file->name, name, n);
        }
        at = line;
    }
    *all = files;
    return n_files;
}

bool fuzz_files_library(const char *folder) {
    DIR *dir = opendir(folder);
    struct dirent *entry;
    while (dir && (entry = readdir(dir)) && n_library < MAX_LIBRARY) {
        FuzzFile *file = &library[n_library];
        const char *dot = strrchr(entry->d_name, '.');
        char path[PATH_MAX];
        if (!dot || strcmp(dot, ".st4") != 0 ||
            snprintf(file->name, sizeof file->name, "%s", entry->d_name) >= FUZZ_MAX_NAME) {
            continue;
        }
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        FILE *in = fopen(path, "rb");
        static char text[1 << 16];
        file->size = in ? fread(text, 1, sizeof text, in) : 0;
        char *copy = malloc(file->size + 1);
        if (copy && file->size) {
            memcpy(copy, text, file->size);
            file->text = copy;
            n_library++;
        }
        if (in) {
            fclose(in);
        }
    }
    if (dir) {
        closedir(dir);
    }
    return n_library > 0;
}

// The path without ".", ".." and doubled slashes; names count from FOLDER. False: it is too long.
static bool clean_path(const char *path, char to[PATH_MAX]) {
    size_t parts[MAX_DEPTH], n_parts = 0, n = 0;
    const char *sources[2] = {*path == '/' ? "" : FOLDER, path};
    for (int k = 0; k < 2; k++) {
        for (const char *at = sources[k]; *at;) {
            size_t size = strcspn(at, "/");
            if (size == 2 && memcmp(at, "..", 2) == 0) {
                n = n_parts ? parts[--n_parts] : 0;
            } else if (size > 0 && !(size == 1 && *at == '.')) {
                if (n + size + 2 > PATH_MAX || n_parts == MAX_DEPTH) {
                    return false;
                }
                parts[n_parts++] = n;
                to[n++] = '/';
                memcpy(to + n, at, size);
                n += size;
            }
            at += size + (at[size] == '/');
        }
    }
    to[n] = '\0';
    return true;
}

static const FuzzFile *find(const char *path) {
    char clean[PATH_MAX];
    if (!clean_path(path, clean)) {
        return NULL;
    }
    bool is_library = strncmp(clean, LIBRARY "/", sizeof LIBRARY) == 0;
    if (!is_library && strncmp(clean, FOLDER "/", sizeof FOLDER) != 0) {
        return NULL;
    }
    const char *name = clean + (is_library ? sizeof LIBRARY : sizeof FOLDER);
    const FuzzFile *all = is_library ? library : files;
    for (size_t i = 0; i < (is_library ? n_library : n_files); i++) {
        if (strcmp(all[i].name, name) == 0) {
            return &all[i];
        }
    }
    return NULL;
}

// ---- In place of the C library

char *fuzz_realpath(const char *path, char *to) {
    char clean[PATH_MAX];
    const char *end = path + strlen(path);
    bool is_library = end - path > 6 && strcmp(end - 6, "stdlib") == 0;
    if (is_library) {
        path = LIBRARY; // what lang/library.c looks for
    }
    if (!clean_path(path, clean) ||
        (strcmp(clean, FOLDER) != 0 && strcmp(clean, LIBRARY) != 0 && !find(clean))) {
        errno = ENOENT;
        return NULL;
    }
    if (to) {
        abort(); // the program lets realpath() allocate
    }
    return keep(strdup(clean), LIVE_MEMORY);
}

int fuzz_stat(const char *path, struct stat *about) {
    const FuzzFile *file = find(path);
    *about = (struct stat){.st_mode = S_IFREG, .st_size = file ? (off_t)file->size : 0};
    errno = file ? 0 : ENOENT;
    return file ? 0 : -1;
}

FILE *fuzz_fopen(const char *path, const char *mode) {
    const FuzzFile *file = find(path);
    if (*mode != 'r' || strchr(mode, '+')) {
        abort(); // a scene writes nothing
    }
    if (!file) {
        errno = ENOENT;
        return NULL;
    }
    static const char empty[1] = "";
    FILE *f = file->size ? fmemopen((void *)(uintptr_t)file->text, file->size, "rb")
                         : fmemopen((void *)(uintptr_t)empty, 1, "rb");
    if (f && !file->size) {
        fgetc(f);
    }
    return keep(f, LIVE_FILE);
}

int fuzz_fclose(FILE *file) {
    forget(file);
    return fclose(file);
}

typedef struct {
    size_t next;
    struct dirent entry;
} Folder;

DIR *fuzz_opendir(const char *path) {
    char clean[PATH_MAX];
    if (!clean_path(path, clean) || strcmp(clean, FOLDER) != 0) {
        errno = ENOENT;
        return NULL;
    }
    return keep(calloc(1, sizeof(Folder)), LIVE_FOLDER);
}

struct dirent *fuzz_readdir(DIR *dir) {
    Folder *folder = (Folder *)(void *)dir;
    if (folder->next == n_files) {
        return NULL;
    }
    snprintf(folder->entry.d_name, sizeof folder->entry.d_name, "%s", files[folder->next++].name);
    return &folder->entry;
}

int fuzz_closedir(DIR *dir) {
    forget(dir);
    free(dir);
    return 0;
}

// ---- In place of render's readers and writers of files

int infile_open(const char *path, size_t *size, char *message, size_t n) {
    const FuzzFile *file = find(path);
    if (!file || !file->size) {
        snprintf(message, n, "%s", file ? "the file is empty" : "cannot read: it is not there");
        return -1;
    }
    int fd = (int)syscall(SYS_memfd_create, "fuzz", 0);
    if (fd < 0 || write(fd, file->text, file->size) != (ssize_t)file->size) {
        abort();
    }
    *size = file->size;
    return fd;
}

size_t infile_read(int fd, void *to, size_t offset, size_t size) {
    ssize_t got = pread(fd, to, size, (off_t)offset);
    errno = 0;
    return got < 0 ? 0 : (size_t)got;
}

bool sky_image_read(Arena *arena, const char *path, SkyImage *image, char *message, size_t n) {
    (void)arena;
    (void)path;
    (void)image;
    snprintf(message, n, "it is of no kind that is known here");
    return false;
}

void mesh_child_assimp(const void *path, int fd) {
    (void)path;
    (void)fd;
}

MeshStatus mesh_child_read(Arena *arena, ChildBody *body, const void *argument,
                           const ChildLimits *limits, Mesh *mesh, char *message, size_t n) {
    (void)arena;
    (void)body;
    (void)argument;
    (void)limits;
    (void)mesh;
    snprintf(message, n, "it is of no kind that is known here");
    return MESH_BAD_FORMAT;
}

MeshStatus mesh_clips_read(Arena *arena, const char *path, const char *const *names,
                           uint32_t n_names, PointCache *places, MeshClips *clips, char *message,
                           size_t n) {
    (void)arena;
    (void)path;
    (void)names;
    (void)n_names;
    *places = (PointCache){0};
    *clips = (MeshClips){0};
    snprintf(message, n, "it has no clips");
    return MESH_NO_CLIP;
}

bool outfile_open(OutFile *file, const char *path, char *message, size_t n) {
    (void)file;
    (void)path;
    (void)message;
    (void)n;
    abort();
}

bool outfile_commit(OutFile *file, char *message, size_t n) {
    return outfile_open(file, NULL, message, n);
}

void outfile_abandon(OutFile *file) {
    (void)file;
    abort();
}
