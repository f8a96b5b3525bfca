// SPDX-License-Identifier: Apache-2.0
// Clips of mesh files: their names as a script gives them, and what to write instead.
#include "lang/lower_form.h"

#include <string.h>

#include "lang/loader.h"

// What the property holds: a string or a list of them (lang/eval_property.c); none after a mistake.
static const Value *names_of(const Given *clip, uint32_t *n) {
    bool is_list = value_is(&clip->value, VALUE_LIST);
    *n = is_list ? clip->value.list->n : value_is(&clip->value, VALUE_STRING);
    return is_list ? clip->value.list->items : &clip->value;
}

Symbol lower_clip_symbol(Eval *ev, const Given *clip) {
    uint32_t n;
    const Value *names = names_of(clip, &n);
    const char *all = "";
    for (uint32_t i = 0; i < n; i++) {
        const char *name = symbol_text(ev->symbols, names[i].symbol);
        all = arena_printf(ev->arena, "%s%zu %s", all, strlen(name), name);
    }
    return symbol_of(ev->symbols, all, strlen(all));
}

// "it has 'Walk' (1.2s) and 2 more"
static const char *list(Eval *ev, const MeshClips *clips) {
    enum { SHOWN = 8 };
    const char *text = "it has ";
    for (uint32_t i = 0; i < clips->n && i < SHOWN; i++) {
        text = arena_printf(ev->arena, "%s%s'%s' (%.4gs)", text, i ? ", " : "", clips->clip[i].name,
                            clips->clip[i].seconds);
    }
    return clips->n > SHOWN ? arena_printf(ev->arena, "%s and %u more", text, clips->n - SHOWN)
                            : text;
}

static void report_missing(Eval *ev, const Given *clip, const char *path, const char *name,
                           const MeshClips *clips) {
    const char **names = ARENA_ARRAY(ev->arena, clips->n, const char *);
    for (uint32_t i = 0; i < clips->n; i++) {
        names[i] = clips->clip[i].name;
    }
    const char *near = diag_nearest(name, names, clips->n);
    if (clips->n == 0) {
        eval_error(ev, &clip->env, clip->node, NULL, "'%s' has no clips", path);
        return;
    }
    eval_error(ev, &clip->env, clip->node,
               near ? arena_printf(ev->arena, "did you mean '%s'?", near) : list(ev, clips),
               "'%s' has no clip '%s'", path, name);
}

bool lower_clip_read(Eval *ev, const Given *file, const Given *clip, Arena *scratch,
                     PointCache *places) {
    const char *path = loader_file(ev, &file->env, file->node, &file->value);
    uint32_t n;
    const Value *names = names_of(clip, &n);
    const char **texts = ARENA_ARRAY(ev->arena, n, const char *);
    char message[512];
    MeshClips clips;
    if (!path || n == 0) {
        return false;
    }
    for (uint32_t i = 0; i < n; i++) {
        texts[i] = symbol_text(ev->symbols, names[i].symbol);
    }
    switch (mesh_clips_read(scratch, path, texts, n, places, &clips, message, sizeof message)) {
    case MESH_OK:
        return true;
    case MESH_NO_CLIP:
        report_missing(ev, clip, path, texts[clips.missing], &clips);
        return false;
    default:
        eval_error(ev, &clip->env, clip->node, NULL, "cannot play '%s': %s", path, message);
        ev->has_failed_file = true;
        return false;
    }
}
