// SPDX-License-Identifier: Apache-2.0
// Files of sums: writing, reading without belief, comparing what they were made from.
#include "render/film_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "render/outfile.h"
#include "render/render.h"

static const char magic[8] = {'S', 'T', '4', 'F', 'I', 'L', 'M', '\n'};

enum {
    MAGIC = sizeof magic,
    START = MAGIC + 8,       // magic, version, length
    HEADER_LIMIT = 1 << 20,  // bytes, of a header that is believed
    ATTRIBUTE_LIMIT = 10000, // of a file
    SIDE_LIMIT = 65536,      // pixels
    PIECE = 1 << 20,         // bytes read, or summed, at once
};

bool film_file_has_ending(const char *path) {
    size_t n = strlen(path), ending = strlen(RENDER_FILM_ENDING);
    return n > ending && !strcasecmp(path + n - ending, RENDER_FILM_ENDING);
}

static uint32_t checksum(uint32_t before, const void *bytes, size_t n) {
    return n ? (uint32_t)crc32_z(before, bytes, n) : before; // of nothing at NULL it begins anew
}

// ---- Writing

static void put_32(FILE *out, uint32_t value) {
    fwrite(&value, sizeof value, 1, out);
}

static void put_64(FILE *out, uint64_t value) {
    fwrite(&value, sizeof value, 1, out);
}

static void put_string(FILE *out, const char *text) {
    size_t n = text ? strlen(text) : 0;
    put_32(out, (uint32_t)n);
    fwrite(text ? text : "", 1, n, out);
}

static void put_attributes(FILE *out, const ImageAttribute *attributes, uint32_t n) {
    for (uint32_t i = 0; i < n; i++) {
        const ImageAttribute *a = &attributes[i];
        put_32(out, a->kind);
        put_string(out, a->name);
        put_string(out, a->string);
        fwrite(&a->number, sizeof a->number, 1, out);
        put_32(out, (uint32_t)a->numerator);
        put_32(out, a->denominator);
    }
}

// What is behind the planes.
typedef struct {
    uint32_t *ids;
    size_t n_ids;
    char *names; // to be freed; NULL: no memory
    size_t n_names;
} Things;

static Things format_things(const Film *film, const FilmOrigin *origin, Arena *arena) {
    Things things = {0};
    FILE *out = open_memstream(&things.names, &things.n_names);
    if (!out) {
        return things;
    }
    for (int k = 0; k < N_FILM_IDS; k++) {
        put_32(out, (uint32_t)origin->names[k].n);
        for (size_t i = 0; i < origin->names[k].n; i++) {
            put_32(out, origin->names[k].names[i].number);
            put_string(out, origin->names[k].names[i].name);
        }
    }
    if (fclose(out)) {
        free(things.names);
        things.names = NULL;
    }
    things.ids = film_save_ids(film, arena, &things.n_ids);
    return things;
}

static void put_header(FILE *out, const FilmOrigin *origin, const FilmPlane *planes,
                       uint32_t n_planes, const Things *things) {
    const uint32_t numbers[] = {
        FILM_LAYOUT,
        origin->width,
        origin->height,
        origin->x,
        origin->y,
        origin->full_width,
        origin->full_height,
        origin->layers,
        origin->first,
        origin->n,
        origin->spp,
        origin->level,
        origin->milliseconds,
        origin->n_attributes,
        origin->n_settings,
    };
    fwrite(numbers, sizeof numbers, 1, out);
    put_attributes(out, origin->attributes, origin->n_attributes);
    put_attributes(out, origin->settings, origin->n_settings);
    put_32(out, n_planes);
    for (uint32_t i = 0; i < n_planes; i++) {
        put_string(out, planes[i].name);
        put_32(out, (uint32_t)planes[i].size);
    }
    put_64(out, things->n_ids);
    put_64(out, things->n_names);
}

// Magic to checksum; to be freed. NULL: no memory.
static char *format_start(const FilmOrigin *origin, const FilmPlane *planes, uint32_t n_planes,
                          const Things *things, size_t *size) {
    char *text = NULL;
    FILE *out = open_memstream(&text, size);
    if (!out) {
        return NULL;
    }
    fwrite(magic, MAGIC, 1, out);
    put_32(out, FILM_FILE_VERSION);
    put_32(out, 0); // the length, known afterwards
    put_header(out, origin, planes, n_planes, things);
    put_32(out, 0); // the checksum
    if (fclose(out)) {
        free(text);
        return NULL;
    }
    uint32_t length = (uint32_t)(*size - START - 4);
    memcpy(text + MAGIC + 4, &length, 4);
    uint32_t sum = checksum(0, text, *size - 4);
    memcpy(text + *size - 4, &sum, 4);
    return text;
}

static bool write_part(OutFile *file, const void *bytes, size_t size, uint32_t *sum, char *message,
                       size_t n) {
    *sum = checksum(*sum, bytes, size);
    return outfile_write(file, bytes, size, message, n);
}

static bool write_all(const char *path, const Film *film, const FilmOrigin *origin,
                      const Things *things, char *message, size_t n) {
    FilmPlane planes[FILM_MAX_PLANES];
    uint32_t n_planes = film_planes(film, planes), sum = 0;
    size_t size, n_pixels = (size_t)film->width * film->height;
    char *start = things->names ? format_start(origin, planes, n_planes, things, &size) : NULL;
    if (!start) {
        snprintf(message, n, "cannot write: %s", strerror(ENOMEM));
        return false;
    }
    OutFile file;
    bool is_fine =
        outfile_open(&file, path, message, n) && outfile_write(&file, start, size, message, n);
    free(start);
    for (uint32_t i = 0; i < n_planes && is_fine; i++) {
        is_fine = write_part(&file, planes[i].data, n_pixels * planes[i].size, &sum, message, n);
    }
    return is_fine &&
           write_part(&file, things->ids, things->n_ids * sizeof *things->ids, &sum, message, n) &&
           write_part(&file, things->names, things->n_names, &sum, message, n) &&
           outfile_write(&file, &sum, sizeof sum, message, n) && outfile_commit(&file, message, n);
}

bool film_file_write(const char *path, const Film *film, const FilmOrigin *origin, char *message,
                     size_t n) {
    Arena arena = {0};
    Things things = format_things(film, origin, &arena);
    bool is_written = write_all(path, film, origin, &things, message, n);
    free(things.names);
    arena_free(&arena);
    return is_written;
}

// ---- Reading

// A header on its way. Whoever reads beyond its end gets zeros and is_short.
typedef struct {
    const unsigned char *at, *end;
    bool is_short;
} Cursor;

static void take(Cursor *cursor, void *to, size_t n) {
    memset(to, 0, n);
    if ((size_t)(cursor->end - cursor->at) < n) {
        cursor->is_short = true;
        cursor->at = cursor->end;
        return;
    }
    memcpy(to, cursor->at, n);
    cursor->at += n;
}

static uint32_t take_32(Cursor *cursor) {
    uint32_t value;
    take(cursor, &value, sizeof value);
    return value;
}

static uint64_t take_64(Cursor *cursor) {
    uint64_t value;
    take(cursor, &value, sizeof value);
    return value;
}

static const char *take_string(Cursor *cursor, Arena *arena) {
    size_t n = take_32(cursor);
    if ((size_t)(cursor->end - cursor->at) < n) {
        cursor->is_short = true;
        return "";
    }
    const char *text = arena_string(arena, (const char *)cursor->at, n);
    cursor->at += n;
    return text;
}

static ImageAttribute *take_attributes(Cursor *cursor, Arena *arena, uint32_t n) {
    ImageAttribute *attributes = ARENA_ARRAY(arena, n, ImageAttribute);
    for (uint32_t i = 0; i < n; i++) {
        ImageAttribute *a = &attributes[i];
        uint32_t kind = take_32(cursor);
        cursor->is_short |= kind > ATTRIBUTE_RATIONAL;
        a->kind = kind > ATTRIBUTE_RATIONAL ? ATTRIBUTE_STRING : (AttributeKind)kind;
        a->name = take_string(cursor, arena);
        a->string = take_string(cursor, arena);
        take(cursor, &a->number, sizeof a->number);
        a->numerator = (int32_t)take_32(cursor);
        a->denominator = take_32(cursor);
    }
    return attributes;
}

typedef struct {
    int fd;
    Arena *arena;
    uint64_t size;   // of the file
    uint64_t planes; // where they begin
    uint32_t pixel_bytes, n_planes;
    uint32_t plane_size[FILM_MAX_PLANES];
    uint64_t n_ids, n_names; // words, bytes
    char *message;
    size_t n;
} Reader;

static bool refuse(const Reader *reader, const char *sentence) {
    snprintf(reader->message, reader->n, "%s", sentence);
    return false;
}

static bool read_bytes(const Reader *reader, void *to, size_t n) {
    char *at = to;
    while (n > 0) {
        ssize_t got = read(reader->fd, at, n);
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            snprintf(reader->message, reader->n, "cannot read: %s", strerror(errno));
            return false;
        }
        if (got == 0) {
            return refuse(reader, "damaged: the file ends too early");
        }
        at += got;
        n -= (size_t)got;
    }
    return true;
}

static bool is_sane(const FilmOrigin *origin) {
    return origin->width && origin->height && origin->full_width <= SIDE_LIMIT &&
           origin->full_height <= SIDE_LIMIT && origin->width <= origin->full_width &&
           origin->height <= origin->full_height &&
           origin->x <= origin->full_width - origin->width &&
           origin->y <= origin->full_height - origin->height &&
           origin->layers < 2u << LAYER_COUNT && origin->n_attributes <= ATTRIBUTE_LIMIT &&
           origin->n_settings <= ATTRIBUTE_LIMIT && origin->n && origin->first <= origin->spp &&
           origin->n <= origin->spp - origin->first;
}

static bool take_header(Reader *reader, Cursor *cursor, FilmOrigin *origin) {
    uint32_t layout = take_32(cursor);
    if (layout != FILM_LAYOUT) {
        return refuse(reader, "its sums are laid out as another version of st4 does it; "
                              "that version reads it");
    }
    *origin = (FilmOrigin){take_32(cursor)};
    origin->height = take_32(cursor);
    origin->x = take_32(cursor);
    origin->y = take_32(cursor);
    origin->full_width = take_32(cursor);
    origin->full_height = take_32(cursor);
    origin->layers = take_32(cursor);
    origin->first = take_32(cursor);
    origin->n = take_32(cursor);
    origin->spp = take_32(cursor);
    origin->level = take_32(cursor);
    origin->milliseconds = take_32(cursor);
    origin->n_attributes = take_32(cursor);
    origin->n_settings = take_32(cursor);
    if (!is_sane(origin)) {
        return refuse(reader, "damaged: its header makes no sense");
    }
    origin->attributes = take_attributes(cursor, reader->arena, origin->n_attributes);
    origin->settings = take_attributes(cursor, reader->arena, origin->n_settings);
    reader->n_planes = take_32(cursor);
    for (uint32_t i = 0; i < reader->n_planes && i < FILM_MAX_PLANES; i++) {
        take_string(cursor, reader->arena);
        reader->plane_size[i] = take_32(cursor);
        reader->pixel_bytes += reader->plane_size[i];
    }
    reader->n_ids = take_64(cursor);
    reader->n_names = take_64(cursor);
    if (cursor->is_short || cursor->at != cursor->end || reader->n_planes > FILM_MAX_PLANES) {
        return refuse(reader, "damaged: its header makes no sense");
    }
    return true;
}

static bool check_size(const Reader *reader, const FilmOrigin *origin) {
    uint64_t pixels = (uint64_t)origin->width * origin->height * reader->pixel_bytes;
    if (reader->n_ids > reader->size / 4 || reader->n_names > reader->size) {
        return refuse(reader, "damaged: the file ends too early");
    }
    uint64_t expected = reader->planes + pixels + reader->n_ids * 4 + reader->n_names + 4;
    if (expected != reader->size) {
        snprintf(reader->message, reader->n, "damaged: it has %llu bytes, %llu are expected",
                 (unsigned long long)reader->size, (unsigned long long)expected);
        return false;
    }
    return true;
}

static bool read_start(Reader *reader, FilmOrigin *origin) {
    unsigned char start[START];
    if (reader->size < START || !read_bytes(reader, start, START) ||
        memcmp(start, magic, MAGIC) != 0) {
        return refuse(reader, "not a file of sums (" RENDER_FILM_ENDING ")");
    }
    uint32_t version, length, sum;
    memcpy(&version, start + MAGIC, 4);
    memcpy(&length, start + MAGIC + 4, 4);
    if (version != FILM_FILE_VERSION) {
        snprintf(reader->message, reader->n,
                 "a file of sums of version %u, where this st4 reads version %d", version,
                 FILM_FILE_VERSION);
        return false;
    }
    if (length > HEADER_LIMIT || reader->size < (uint64_t)START + length + 4) {
        return refuse(reader, "damaged: the file ends too early");
    }
    unsigned char *header = arena_alloc(reader->arena, length);
    if (!read_bytes(reader, header, length) || !read_bytes(reader, &sum, sizeof sum)) {
        return false;
    }
    if (checksum(checksum(0, start, START), header, length) != sum) {
        return refuse(reader, "damaged: the checksum of its header is wrong");
    }
    reader->planes = (uint64_t)START + length + 4;
    Cursor cursor = {header, header + length, false};
    return take_header(reader, &cursor, origin) && check_size(reader, origin);
}

static bool read_part(const Reader *reader, void *to, size_t size, uint32_t *sum) {
    for (size_t at = 0; at < size; at += PIECE) {
        size_t n = size - at < PIECE ? size - at : PIECE;
        if (!read_bytes(reader, (char *)to + at, n)) {
            return false;
        }
        *sum = checksum(*sum, (char *)to + at, n);
    }
    return true;
}

static bool take_names(const Reader *reader, const unsigned char *bytes, FilmNames *names) {
    Cursor cursor = {bytes, bytes + reader->n_names, false};
    for (int k = 0; k < N_FILM_IDS; k++) {
        uint32_t n = take_32(&cursor);
        cursor.is_short |= n > (size_t)(cursor.end - cursor.at) / 8;
        n = cursor.is_short ? 0 : n;
        names[k] = (FilmNames){ARENA_ARRAY(reader->arena, n, FilmName), n, n};
        for (uint32_t i = 0; i < n; i++) {
            names[k].names[i].number = take_32(&cursor);
            names[k].names[i].name = take_string(&cursor, reader->arena);
            cursor.is_short |= i && names[k].names[i - 1].number >= names[k].names[i].number;
        }
    }
    return !cursor.is_short && cursor.at == cursor.end;
}

// Whether there is a name for everything in the film.
static bool are_named(const Film *film, const FilmNames *names) {
    for (int k = 0; k < N_FILM_IDS; k++) {
        for (size_t i = 0; film->ids[k] && i < (size_t)film->width * film->height; i++) {
            for (const FilmIds *ids = &film->ids[k][i]; ids; ids = ids->more) {
                for (int j = 0; j < FILM_IDS && ids->n[j]; j++) {
                    if (!film_names_get(&names[k], ids->id[j])) {
                        return false;
                    }
                }
            }
        }
    }
    return true;
}

static bool read_sums(const Reader *reader, FilmOrigin *origin, Film *film) {
    FilmPlane planes[FILM_MAX_PLANES];
    uint32_t sum = 0, found;
    film_init(film, reader->arena, origin->layers, origin->width, origin->height);
    film->x = origin->x;
    film->y = origin->y;
    uint32_t n_planes = film_planes(film, planes);
    bool is_same = n_planes == reader->n_planes;
    for (uint32_t i = 0; i < n_planes && is_same; i++) {
        is_same = planes[i].size == reader->plane_size[i];
    }
    if (!is_same) {
        return refuse(reader, "damaged: its sums are not those of this version");
    }
    for (uint32_t i = 0; i < n_planes; i++) {
        size_t size = (size_t)origin->width * origin->height * planes[i].size;
        if (!read_part(reader, planes[i].data, size, &sum)) {
            return false;
        }
    }
    uint32_t *ids = ARENA_ARRAY(reader->arena, reader->n_ids, uint32_t);
    unsigned char *names = ARENA_ARRAY(reader->arena, reader->n_names, unsigned char);
    if (!read_part(reader, ids, reader->n_ids * sizeof *ids, &sum) ||
        !read_part(reader, names, reader->n_names, &sum) ||
        !read_bytes(reader, &found, sizeof found)) {
        return false;
    }
    if (found != sum) {
        return refuse(reader, "damaged: the checksum of its sums is wrong");
    }
    return (take_names(reader, names, origin->names) &&
            film_restore_ids(film, ids, reader->n_ids) && are_named(film, origin->names)) ||
           refuse(reader, "damaged: its objects and materials make no sense");
}

// film: NULL where the origin is enough.
static bool read_file(Arena *arena, const char *path, Film *film, FilmOrigin *origin, char *message,
                      size_t n) {
    Reader reader = {.arena = arena, .message = message, .n = n};
    struct stat s;
    // O_NONBLOCK: a pipe that nobody writes to must not hold the program.
    reader.fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (reader.fd < 0 || fstat(reader.fd, &s) != 0) {
        snprintf(message, n, "cannot read: %s", strerror(errno));
        if (reader.fd >= 0) {
            close(reader.fd);
        }
        return false;
    }
    reader.size = (uint64_t)s.st_size;
    bool is_read = S_ISREG(s.st_mode) ? read_start(&reader, origin)
                                      : refuse(&reader, "cannot read: not a regular file");
    is_read = is_read && (!film || read_sums(&reader, origin, film));
    close(reader.fd);
    return is_read;
}

bool film_file_read_origin(Arena *arena, const char *path, FilmOrigin *origin, char *message,
                           size_t n) {
    return read_file(arena, path, NULL, origin, message, n);
}

bool film_file_read(Arena *arena, const char *path, Film *film, FilmOrigin *origin, char *message,
                    size_t n) {
    return read_file(arena, path, film, origin, message, n);
}

bool film_file_is(const char *path) {
    char start[MAGIC];
    struct stat s; // of a pipe the bytes would be gone
    FILE *file = stat(path, &s) == 0 && S_ISREG(s.st_mode) ? fopen(path, "rb") : NULL;
    bool is_one = file && fread(start, 1, MAGIC, file) == MAGIC && memcmp(start, magic, MAGIC) == 0;
    if (file) {
        fclose(file);
    }
    return is_one;
}
