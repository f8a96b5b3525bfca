// SPDX-License-Identifier: Apache-2.0
// st4 fmt: scenes in the canonical layout, printed, put in place, or only compared with it.
#include "lang/command.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "lang/format.h"
#include "lang/loader.h"
#include "lang/session.h"
#include "render/outfile.h"

typedef struct {
    char *text; // malloc'ed
    size_t size;
} Buffer;

static bool write_all(int fd, const char *text, size_t size) {
    while (size) {
        ssize_t n = write(fd, text, size);
        if (n < 0 && errno != EINTR) {
            return false;
        }
        text += n > 0 ? n : 0;
        size -= n > 0 ? (size_t)n : 0;
    }
    return true;
}

static int replace(const Session *session, const char *path, const Buffer *formatted) {
    char message[256];
    OutFile file;
    if (!outfile_open(&file, path, message, sizeof message)) {
        return session_refuse(session, STATUS_FILES, path, message);
    }
    if (!write_all(file.fd, formatted->text, formatted->size)) {
        snprintf(message, sizeof message, "cannot write: %s", strerror(errno));
        outfile_abandon(&file);
        return session_refuse(session, STATUS_FILES, path, message);
    }
    return outfile_commit(&file, message, sizeof message)
               ? STATUS_OK
               : session_refuse(session, STATUS_FILES, path, message);
}

static int put(const Session *session, const char *path, const Buffer *formatted, bool is_same) {
    bool is_checked = option_flag(session->options, OPTION_CHECK);
    if (is_checked && !is_same && !option_flag(session->options, OPTION_QUIET)) {
        puts(path);
    }
    if (is_checked) {
        return is_same ? STATUS_OK : STATUS_SCENE;
    }
    if (option_flag(session->options, OPTION_WRITE) && strcmp(path, "-") != 0) {
        return is_same ? STATUS_OK : replace(session, path, formatted);
    }
    fwrite(formatted->text, 1, formatted->size, stdout);
    return STATUS_OK;
}

static int format(Session *session, const char *path) {
    size_t size;
    const char *text = loader_read(session->arena, path, &size);
    const SourceFile *file =
        text ? source_add(&session->sources, path, text, size, (Span){0, 0}) : NULL;
    if (!file) {
        return session_refuse(session, STATUS_FILES, path,
                              text ? "it is too large" : strerror(errno));
    }
    Buffer formatted = {0};
    FILE *out = open_memstream(&formatted.text, &formatted.size);
    if (!out) {
        return session_refuse(session, STATUS_FILES, path, strerror(errno));
    }
    bool is_formatted =
        format_source(session->arena, symbols_new(session->arena), file, session->diag, out);
    bool is_whole = !ferror(out);
    is_whole = fclose(out) == 0 && is_whole;
    diag_next_statement(session->diag);
    int status = !is_formatted ? STATUS_SCENE
                 : !is_whole   ? session_refuse(session, STATUS_FILES, path, strerror(ENOMEM))
                               : 0;
    if (status == STATUS_OK) {
        bool is_same = formatted.size == size && memcmp(formatted.text, text, size) == 0;
        status = put(session, path, &formatted, is_same);
    }
    free(formatted.text);
    return status;
}

int command_fmt(Arena *arena, const Options *options) {
    Session session;
    int status = session_begin(&session, arena, options);
    if (status) {
        return status;
    }
    if (option_flag(options, OPTION_CHECK) && option_flag(options, OPTION_WRITE)) {
        fputs("st4: --check changes nothing, --write does: one of them is enough\n", stderr);
        return STATUS_USAGE;
    }
    for (size_t i = 0; i < options->n_operands; i++) {
        int one = format(&session, options->operands[i]);
        status = one > status ? one : status;
    }
    return session_close(&session, status);
}
