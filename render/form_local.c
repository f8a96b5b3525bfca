// SPDX-License-Identifier: Apache-2.0
// Forms of instances with clocks: which cells of their own time are sampled, and how finely.
#include "render/instance_set.h"
#include "render/local_time.h"

#include <stdlib.h>

// ---- A set of cells

typedef struct {
    int64_t *slots; // FREE: none
    size_t n, n_slots;
} CellSet;

#define FREE INT64_MIN

static size_t slot_of(const CellSet *set, int64_t cell) {
    size_t at = (size_t)((uint64_t)cell * 0x9e3779b97f4a7c15u >> 20) & (set->n_slots - 1);
    while (set->slots[at] != FREE && set->slots[at] != cell) {
        at = (at + 1) & (set->n_slots - 1);
    }
    return at;
}

static void grow(CellSet *set, Arena *arena) {
    CellSet larger = {.n = set->n, .n_slots = set->n_slots ? 2 * set->n_slots : 64};
    larger.slots = ARENA_ARRAY(arena, larger.n_slots, int64_t);
    for (size_t i = 0; i < larger.n_slots; i++) {
        larger.slots[i] = FREE;
    }
    for (size_t i = 0; i < set->n_slots; i++) {
        if (set->slots[i] != FREE) {
            larger.slots[slot_of(&larger, set->slots[i])] = set->slots[i];
        }
    }
    *set = larger;
}

static void add(CellSet *set, Arena *arena, int64_t cell) {
    if (2 * set->n >= set->n_slots) {
        grow(set, arena);
    }
    size_t at = slot_of(set, cell);
    set->n += set->slots[at] == FREE;
    set->slots[at] = cell;
}

static int by_number(const void *a, const void *b) {
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

// Ascending; the set is used up.
static int64_t *sorted(CellSet *set) {
    size_t n = 0;
    for (size_t i = 0; i < set->n_slots; i++) {
        if (set->slots[i] != FREE) {
            set->slots[n++] = set->slots[i];
        }
    }
    if (n > 0) {
        qsort(set->slots, n, sizeof *set->slots, by_number);
    }
    return set->slots;
}

// ---- Cells that instances reach

typedef struct {
    Form *form;
    CellSet cells;
    Arena scratch;
    double fps;
    int64_t last; // that was added
} Reach;

static void reach(void *context, double lo, double hi) {
    Reach *r = context;
    Instant from = instant_of_seconds(lo, r->fps), to = instant_of_seconds(hi, r->fps);
    if (to.frame - from.frame > LOCAL_MAX_CELLS) {
        r->form->is_too_fast = true;
        return;
    }
    for (int64_t cell = from.frame; cell <= to.frame; cell++) {
        if (cell != r->last || r->cells.n == 0) {
            add(&r->cells, &r->scratch, cell);
            r->last = cell;
        }
    }
    r->form->is_too_fast |= r->cells.n > LOCAL_MAX_CELLS;
}

static void reach_all(Reach *r, const FormUser *user, const ShutterSpan *shutter) {
    for (uint64_t c = 0; c < shutter->n_cells; c++) {
        Opening open = shutter_opening(shutter, c);
        double first = instant_seconds((Instant){open.frame, open.lo}, r->fps),
               last = instant_seconds((Instant){open.frame, open.hi}, r->fps);
        for (uint32_t i = 0; i < user->n && !r->form->is_too_fast; i++) {
            if (user->set) {
                instance_times(user->set, i, first, last, reach, r);
                continue;
            }
            local_times(user->shape, shape_loops(user->shape, user_instance(user, i)), r->fps,
                        open.frame, open.lo, open.hi, reach, r);
        }
    }
}

// ---- How large instances look

// Members of a set are looked at in the pose that they have in common at the film's seconds.
static bool user_map(const FormUser *user, uint32_t k, double seconds, Affine *map) {
    double in[IN_COUNT];
    if (user->set) {
        *map = instance_outer(user->set, k);
        return true;
    }
    shape_inputs(user->shape, shape_loops(user->shape, user_instance(user, k)), seconds, in);
    return affine_run(user->shape->transform, in, map);
}

// The nearest point of a ball around the form counts, but none nearer than a tenth of the way.
static double pixels_of(const Form *form, const FormUser *user, uint32_t k, const Affine *inner,
                        const Camera *camera, double seconds) {
    const Frame *frame = &form->sampler.frame;
    Affine map;
    if (!user_map(user, k, seconds, &map)) {
        return 0;
    }
    map = user->set ? affine_mul(&map, inner) : map;
    double size = affine_stretch(&map), reach = size / frame->scale;
    Vec3 at = affine_point(&map, vec3(frame->center[0], frame->center[1], frame->center[2]));
    Vec3 to = vec3_sub(camera->from, at);
    double distance = vec3_length(to);
    double nearer = fmin(reach, 0.9 * distance) / fmax(distance, 1e-300);
    return size * sample_pixels(camera, vec3_madd(at, nearer, to));
}

// Over all instances, and instants spread over the whole film: so that it is the same whatever
// frames are rendered. Of a million each is looked at LEAST times.
static double pixels_of_all(const Form *form) {
    enum { MOST = 16, LEAST = 2, LOOKS = 1 << 16 };
    const Scene *scene = form->sampler.scene;
    double most = 0, n_frames = (double)(scene->film.last_frame - scene->film.first_frame);
    for (size_t u = 0; u < form->n_users; u++) {
        const FormUser *user = &form->users[u];
        int n = LOOKS / (int)(user->n < LOOKS ? user->n : LOOKS);
        n = n < LEAST ? LEAST : n > MOST ? MOST : n;
        for (int k = 0; k < n; k++) {
            double along = (double)(scene->film.first_frame - 1) + n_frames * k / (n - 1);
            double seconds = along / scene->film.fps;
            Camera camera = camera_at(scene, seconds);
            Affine inner = affine_identity();
            bool has_inner = user->set && affine_run_at(user->shape->inner, seconds, &inner);
            for (uint32_t i = 0; camera.is_valid && (has_inner || !user->set) && i < user->n; i++) {
                most = fmax(most, pixels_of(form, user, i, &inner, &camera, seconds));
            }
        }
    }
    // As where a camera sees nothing: it holds the rest pose in a picture's height.
    return most > 0 && isfinite(most) ? most : form->sampler.frame.scale * scene->film.height;
}

// ---- Planning

void form_plan_local(Form *form, const ShutterSpan *shutter) {
    Reach r = {.form = form, .fps = form->sampler.scene->film.fps};
    CellSet known = {0};
    if (!(form->sampler.pixels > 0)) {
        form->sampler.pixels = pixels_of_all(form);
    }
    for (size_t i = 0; i < form->n_seen; i++) {
        add(&known, &r.scratch, form->seen[i].frame);
    }
    for (size_t u = 0; u < form->n_users; u++) {
        reach_all(&r, &form->users[u], shutter);
    }
    const int64_t *cells = sorted(&r.cells);
    for (size_t i = 0; i < r.cells.n && !form->is_too_fast; i++) {
        Opening whole = {cells[i], 0, 1};
        if (known.n && known.slots[slot_of(&known, cells[i])] == cells[i]) {
            continue;
        }
        form_sample(form, whole);
    }
    arena_free(&r.scratch);
}
