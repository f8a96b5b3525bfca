// SPDX-License-Identifier: Apache-2.0
// Pictures that scripts look up.
#include <errno.h>
#include <string.h>

#include "lang/loader_parts.h"
#include "lang/lower.h"
#include "render/texture.h"

// The scene was made from the file's bytes.
static bool hash_file(Eval *ev, const char *path) {
    Arena scratch = {0};
    size_t size;
    const char *bytes = loader_read(&scratch, path, &size);
    if (bytes) {
        loader_hash_add(ev, bytes, size);
    }
    arena_free(&scratch);
    return bytes != NULL;
}

static const ProgramImage *open_picture(Eval *ev, const Env *env, NodeId node, const char *path,
                                        bool is_raw) {
    char message[512] = "";
    const ProgramImage *image = NULL;
    if (!hash_file(ev, path)) {
        eval_error(ev, env, node, NULL, "cannot read '%s': %s", path, strerror(errno));
    } else {
        image = texture_open(lower_arena(ev), path, is_raw, message, sizeof message);
        if (!image) {
            eval_error(ev, env, node, "a picture is a PNG, JPEG, TIFF, EXR or the like",
                       "cannot read '%s': %s", path, message);
        }
    }
    ev->has_failed_file = ev->has_failed_file || !image;
    return image;
}

const ProgramImage *loader_picture(Eval *ev, const Env *env, NodeId node, const Value *name,
                                   bool is_raw) {
    Picture **first = loader_pictures(ev), *picture;
    for (picture = *first; picture; picture = picture->next) {
        if (picture->name == name->symbol && picture->module == env->module &&
            picture->is_raw == is_raw) {
            return picture->image;
        }
    }
    const char *path = loader_file(ev, env, node, name);
    picture = ARENA_NEW(ev->arena, Picture);
    *picture = (Picture){*first, env->module, name->symbol, is_raw,
                         path ? open_picture(ev, env, node, path, is_raw) : NULL};
    *first = picture;
    return picture->image;
}
