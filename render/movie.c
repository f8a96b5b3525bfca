// SPDX-License-Identifier: Apache-2.0
// The child that encodes, and what it is fed.
#include "render/movie.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/image.h"
#include "render/interrupt.h"
#include "render/outfile.h"

extern char **environ;

enum { PATH_SIZE = 4096, STATUS_FINE = 0, STATUS_FILES = 3, STATUS_INTERRUPTED = 130 };

// By the ending of the name: what ffmpeg calls it. Its own choice goes by a name, which is
// temporary here.
static const char *const formats[][2] = {
    {"mp4", "mp4"}, {"mov", "mov"}, {"mkv", "matroska"}, {"webm", "webm"}, {"avi", "avi"}};
enum { N_FORMATS = sizeof formats / sizeof *formats };

static const char *find_format(const char *path, char *message, size_t n) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    for (int i = 0; dot && i < N_FORMATS; i++) {
        if (strcasecmp(dot + 1, formats[i][0]) == 0) {
            return formats[i][1];
        }
    }
    int at = snprintf(message, n, "the name's ending is none of .%s", formats[0][0]);
    for (int i = 1; i < N_FORMATS && at > 0 && (size_t)at < n; i++) {
        at += snprintf(message + at, n - (size_t)at, ", .%s", formats[i][0]);
    }
    return NULL;
}

static bool find_program(char program[PATH_SIZE], char *message, size_t n) {
    const char *folders = getenv("PATH");
    for (const char *at = folders ? folders : "/usr/bin:/bin"; *at; at += *at == ':') {
        size_t length = strcspn(at, ":");
        int written = snprintf(program, PATH_SIZE, "%.*s/ffmpeg", (int)length, at);
        if (length > 0 && written < PATH_SIZE && access(program, X_OK) == 0) {
            return true;
        }
        at += length;
    }
    snprintf(message, n,
             "movies are made by the program ffmpeg, which is not installed (not found in $PATH); "
             "without --movie the pictures are rendered all the same");
    return false;
}

bool movie_check(const char *path, char *message, size_t n) {
    char program[PATH_SIZE];
    OutFile file;
    if (!find_format(path, message, n) || !find_program(program, message, n) ||
        !outfile_open(&file, path, message, n)) {
        return false;
    }
    outfile_abandon(&file);
    return true;
}

// A movie on its way.
typedef struct {
    const Scene *scene;
    const char *format;
    OutFile file;
    FILE *complaints; // what ffmpeg prints
    pid_t child;      // 0: not started
    int pipe;
    uint32_t width, height; // of the pictures
    char *message;
    size_t n;
} Movie;

static bool fail_with(const Movie *movie, const char *what, int code) {
    snprintf(movie->message, movie->n, "%s: %s", what, strerror(code));
    return false;
}

// The child's standard input is the pipe, what it prints goes to a file without a name.
static int spawn_child(Movie *movie, const char *program, char *const *arguments, int input) {
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t to_default;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, fileno(movie->complaints), STDERR_FILENO);
    // Signals that are ignored here would stay so in the child.
    posix_spawnattr_init(&attributes);
    sigemptyset(&to_default);
    sigaddset(&to_default, SIGPIPE);
    posix_spawnattr_setsigdefault(&attributes, &to_default);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    int code = posix_spawn(&movie->child, program, &actions, &attributes, arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    movie->child = code ? 0 : movie->child;
    return code;
}

static bool start(Movie *movie) {
    char program[PATH_SIZE], size[32], rate[48], output[PATH_SIZE + 64];
    int ends[2], code;
    if (!find_program(program, movie->message, movie->n)) {
        return false;
    }
    if (pipe(ends) != 0) {
        return fail_with(movie, "cannot start ffmpeg", errno);
    }
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    snprintf(size, sizeof size, "%ux%u", movie->width + movie->width % 2,
             movie->height + movie->height % 2);
    int32_t numerator;
    uint32_t denominator;
    render_rate(movie->scene->film.fps, &numerator, &denominator);
    snprintf(rate, sizeof rate, "%d/%u", (int)numerator, (unsigned)denominator);
    snprintf(output, sizeof output, "file:%s", movie->file.temporary);
    // The bytes are sRGB; the movie is in Rec. 709, and says so, or players guess by its size.
    const char *const arguments[] = {"ffmpeg",
                                     "-y",
                                     "-hide_banner",
                                     "-loglevel",
                                     "error",
                                     "-f",
                                     "rawvideo",
                                     "-pixel_format",
                                     "rgb24",
                                     "-video_size",
                                     size,
                                     "-framerate",
                                     rate,
                                     "-i",
                                     "pipe:0",
                                     "-vf",
                                     "scale=out_color_matrix=bt709:out_range=tv",
                                     "-pix_fmt",
                                     "yuv420p",
                                     "-colorspace",
                                     "bt709",
                                     "-color_primaries",
                                     "bt709",
                                     "-color_trc",
                                     "iec61966-2-1",
                                     "-color_range",
                                     "tv",
                                     "-f",
                                     movie->format,
                                     output,
                                     NULL};
    char *vector[sizeof arguments / sizeof *arguments];
    for (size_t i = 0; i < sizeof arguments / sizeof *arguments; i++) {
        vector[i] = (char *)arguments[i];
    }
    code = spawn_child(movie, program, vector, ends[0]);
    close(ends[0]);
    movie->pipe = ends[1];
    return code ? fail_with(movie, "cannot start ffmpeg", code) : true;
}

static bool put(const Movie *movie, const uint8_t *bytes, size_t n) {
    while (n > 0) {
        ssize_t written = write(movie->pipe, bytes, n);
        if (written < 0 && errno != EINTR) {
            return false; // the child has ended: what it printed says why
        }
        bytes += written > 0 ? written : 0;
        n -= written > 0 ? (size_t)written : 0;
    }
    return true;
}

// The last column and line twice where there is an odd number of them.
static bool put_frame(const Movie *movie, const uint8_t *bytes) {
    size_t line = 3 * (size_t)movie->width;
    bool done = true;
    for (uint32_t y = 0; y < movie->height + movie->height % 2 && done; y++) {
        const uint8_t *at = bytes + (y < movie->height ? y : movie->height - 1) * line;
        done = put(movie, at, line) && (movie->width % 2 == 0 || put(movie, at + line - 3, 3));
    }
    return done;
}

static bool add_frame(Movie *movie, const RenderOptions *options, uint32_t i) {
    char path[PATH_SIZE], why[256];
    Arena arena = {0};
    Image image;
    FilmSettings film = movie->scene->film;
    film.transparent = false; // colour is premultiplied: without alpha it stands on black
    if (!render_frame_path(options->out, options->frames[i], options->n_frames > 1, path,
                           sizeof path)) {
        return fail_with(movie, "cannot read the pictures", ENAMETOOLONG);
    }
    bool done = image_read_exr(&arena, path, &image, why, sizeof why);
    if (!done) {
        snprintf(movie->message, movie->n, "%s: %s", path, why);
    } else if (movie->child && (image.width != movie->width || image.height != movie->height)) {
        snprintf(movie->message, movie->n, "%s has %ux%u pixels, the pictures before %ux%u", path,
                 image.width, image.height, movie->width, movie->height);
        done = false;
    }
    uint8_t *bytes = done ? arena_array(&arena, (size_t)image.width * image.height, 3) : NULL;
    done = done && image_bytes(&image, &film, bytes, movie->message, movie->n);
    if (done && !movie->child) {
        movie->width = image.width;
        movie->height = image.height;
        done = start(movie);
    }
    done = done && put_frame(movie, bytes);
    arena_free(&arena);
    return done;
}

// The last line that the child printed is nearest to the cause.
static void read_complaints(const Movie *movie, int status) {
    char line[200], last[200] = "";
    rewind(movie->complaints);
    while (fgets(line, sizeof line, movie->complaints)) {
        line[strcspn(line, "\r\n")] = '\0';
        if (line[0]) {
            memcpy(last, line, sizeof last);
        }
    }
    if (WIFSIGNALED(status)) {
        snprintf(movie->message, movie->n, "ffmpeg was ended by signal %d%s%s", WTERMSIG(status),
                 last[0] ? ": " : "", last);
    } else {
        snprintf(movie->message, movie->n, "ffmpeg failed (exit status %d)%s%s",
                 WEXITSTATUS(status), last[0] ? ": " : "", last);
    }
}

// Waits for the child; true: it was content.
static bool finish(Movie *movie) {
    int status = 0;
    close(movie->pipe);
    while (waitpid(movie->child, &status, 0) < 0) {
        if (errno != EINTR) {
            return fail_with(movie, "cannot wait for ffmpeg", errno);
        }
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
        return true;
    }
    read_complaints(movie, status);
    return false;
}

static bool add_frames(Movie *movie, const RenderOptions *options) {
    bool done = true;
    for (uint32_t i = 0; i < options->n_frames && done && !interrupt_is_asked(); i++) {
        done = add_frame(movie, options, i);
    }
    if (movie->child) {
        if (interrupt_is_asked()) {
            kill(movie->child, SIGTERM);
        }
        // Where writing failed, the child's reason is the better one.
        done = finish(movie) && done;
    }
    return done && !interrupt_is_asked();
}

static int make(Movie *movie, const char *path, const RenderOptions *options) {
    if (!outfile_open(&movie->file, path, movie->message, movie->n)) {
        return STATUS_FILES;
    }
    movie->complaints = tmpfile();
    bool done = movie->complaints ? add_frames(movie, options)
                                  : fail_with(movie, "cannot start ffmpeg", errno);
    if (movie->complaints) {
        fclose(movie->complaints);
    }
    if (!done) {
        outfile_abandon(&movie->file);
        return interrupt_is_asked() ? STATUS_INTERRUPTED : STATUS_FILES;
    }
    return outfile_commit(&movie->file, movie->message, movie->n) ? STATUS_FINE : STATUS_FILES;
}

int movie_make(const char *path, const Scene *scene, const RenderOptions *options, char *message,
               size_t n) {
    Movie movie = {.scene = scene, .message = message, .n = n};
    struct sigaction ignore, before;
    movie.format = find_format(path, message, n);
    if (!movie.format) {
        return STATUS_FILES;
    }
    // A child that ends early must be a failed write here, not the end of the program.
    memset(&ignore, 0, sizeof ignore);
    ignore.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &ignore, &before);
    interrupt_begin();
    snprintf(message, n, "cannot write the pictures to ffmpeg");
    int status = make(&movie, path, options);
    interrupt_end();
    sigaction(SIGPIPE, &before, NULL);
    return status;
}
