// SPDX-License-Identifier: Apache-2.0
// Whole worlds against flattened ones.
#include "tests/stability/worlds.h"

#include "accel/cpu.h"
#include "tests/stability/solids.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void worlds_build(Run *run, Worlds *worlds, const Scene *scene, int64_t first, uint32_t n,
                  bool with_slow, const char *label) {
    *worlds = (Worlds){.fps = scene->film.fps};
    snprintf(worlds->label, sizeof worlds->label, "%s", label);
    for (const AccelType *type = accel_types; type->name; type++) {
        for (int cpu = 0; cpu < CPU_COUNT; cpu++) {
            if (!cpu_has((Cpu)cpu)) {
                continue;
            }
            int64_t frames[8];
            uint32_t taken = 0;
            for (uint32_t i = 0; i < n; i++) {
                frames[i] = first + i;
            }
            Reports reports;
            Reporter reporter = hand_reporter(&reports);
            RenderStats stats = {0};
            RenderOptions options = hand_options();
            options.accel = type;
            if (!with_slow && strncmp(type->name, "kd", 2) == 0) {
                run_note(run, "%s is left out of %s: its build takes long", type->name, label);
                continue;
            }
            cpu_set(cpu_names[cpu]);
            World *world = world_build(scene, &options, frames, n, &reporter, &taken, &stats);
            cpu_set(NULL);
            if (run_expect(run, world && taken == n, "%s: no world with %s: %s", label, type->name,
                           reports.last)) {
                worlds->at[worlds->n++] = (BuiltWorld){type->name, cpu_names[cpu], world};
            }
        }
    }
}

void worlds_free(Worlds *worlds) {
    for (int i = 0; i < worlds->n; i++) {
        world_destroy(worlds->at[i].world);
    }
}

WorldViews views_new(const Worlds *worlds) {
    WorldViews views = {{NULL}};
    for (int i = 0; i < worlds->n; i++) {
        views.at[i] = world_view_new(worlds->at[i].world);
    }
    return views;
}

void views_free(const Worlds *worlds, WorldViews *views) {
    for (int i = 0; i < worlds->n; i++) {
        world_view_destroy(views->at[i], NULL);
    }
}

// ---- The flattened oracle

typedef struct {
    long double x[3];
} Long3;

typedef struct {
    const Flat *flat;
    uint32_t n_triangles;
    Vec3 origin, dir;
} Flattened;

static double largest_of(Vec3 a) {
    return fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z)));
}

// The longest and the shortest column of a map whose columns are at right angles.
static void stretch_of(const Affine *map, double *longest, double *shortest) {
    *longest = 0;
    *shortest = INFINITY;
    for (int k = 0; k < 3; k++) {
        double l = vec3_length(vec3(map->m[0][k], map->m[1][k], map->m[2][k]));
        *longest = fmax(*longest, l);
        *shortest = fmin(*shortest, l);
    }
}

static Long3 put(const Affine *map, const double *p) {
    Long3 r;
    for (int i = 0; i < 3; i++) {
        r.x[i] = (long double)map->m[i][0] * p[0] + (long double)map->m[i][1] * p[1] +
                 (long double)map->m[i][2] * p[2] + map->m[i][3];
    }
    return r;
}

static double mesh_reach(const Mesh *mesh) {
    double reach = 0;
    for (uint32_t i = 0; i < 3 * mesh->n_vertices; i++) {
        reach = fmax(reach, fabs(mesh->position[i]));
    }
    return reach;
}

// The ray begins anew at the point nearest to the object. What the kernels round is relative to the
// object's size, what the doubles before them round to its distance.
static Meeting meet_flat(const void *context, uint32_t prim) {
    const Flattened *q = context;
    const Flat *flat = &q->flat[prim / q->n_triangles];
    const Mesh *mesh = flat->mesh;
    const double u = 0x1p-24, o[3] = {q->origin.x, q->origin.y, q->origin.z};
    const double d[3] = {q->dir.x, q->dir.y, q->dir.z};
    double longest, shortest, reach = mesh_reach(mesh), far = 0, lateral = 0;
    stretch_of(&flat->map, &longest, &shortest);
    long double od = 0, dd = 0, start[3];
    for (int k = 0; k < 3; k++) {
        long double away = (long double)o[k] - flat->map.m[k][3];
        od += away * d[k];
        dd += (long double)d[k] * d[k];
        far = fmax(far, fabs((double)away));
    }
    long double s = -od / dd;
    for (int k = 0; k < 3; k++) {
        start[k] = o[k] + s * d[k];
        lateral += pow((double)(start[k] - flat->map.m[k][3]), 2);
    }
    double error = 32 * u * reach * longest + 0x1p-50 * far * longest / shortest + flat->slack;
    if (sqrt(lateral) > 2 * reach * longest + 4 * error) {
        return (Meeting){SURELY_NOT, 0, 0, 0, 0, 0};
    }
    Meet m;
    for (int c = 0; c < 3; c++) {
        uint32_t v = mesh->index[3 * (size_t)(prim % q->n_triangles) + (size_t)c];
        Long3 p = put(&flat->map, &mesh->position[3 * (size_t)v]);
        for (int k = 0; k < 3; k++) {
            m.a[c][k] = (double)(p.x[k] - start[k]);
            m.ea[c][k] = error;
            m.d[k] = d[k];
            m.ed[k] = 2 * u * largest_of(q->dir) * longest / shortest;
        }
    }
    Meeting r = meet_triangle(&m);
    // From within some sizes of the object its kernels measure from the origin itself.
    double near = fmin(fabs((double)s), 32 * reach * longest / vec3_length(q->dir));
    double off = 0x1p-48 * (fabs((double)s) + fmax(fabs(r.lo), fabs(r.hi))) + 16 * u * near;
    r.lo += (double)s - off;
    r.hi += (double)s + off;
    return r;
}

bool worlds_check(Run *run, const Worlds *worlds, WorldViews *views, Instant at, Vec3 origin,
                  Vec3 dir, double tmax, const Flat *flat, uint32_t n_flat, uint32_t first_object,
                  uint64_t index, WorldHit *hit) {
    char ray[300], why[200];
    bool is_hit = false;
    snprintf(ray, sizeof ray, "%s, ray %llu, from {%a, %a, %a} along {%a, %a, %a} at {%lld, %a}",
             worlds->label, (unsigned long long)index, origin.x, origin.y, origin.z, dir.x, dir.y,
             dir.z, (long long)at.frame, at.frac);
    for (int i = 0; i < worlds->n; i++) {
        WorldHit own = {0};
        world_view_time(views->at[i], at);
        bool is_own = world_closest(views->at[i], origin, dir, 0, tmax, &own);
        bool is_occluded = world_occluded(views->at[i], origin, dir, 0, tmax);
        if (i == 0) {
            is_hit = is_own;
            *hit = own;
        }
        if (is_own != is_hit || is_occluded != is_hit || memcmp(hit, &own, sizeof own) != 0) {
            run_fail(run, "%s: %s on %s: %d %.17g %u %d, %s on %s: %d %.17g %u %d, occluded %d",
                     ray, worlds->at[0].structure, worlds->at[0].cpu, is_hit, hit->t, hit->object,
                     hit->prim, worlds->at[i].structure, worlds->at[i].cpu, is_own, own.t,
                     own.object, own.prim, is_occluded);
        }
    }
    count_queries(2 * (uint64_t)worlds->n);
    Flattened q = {flat, flat->mesh->n_triangles, origin, dir};
    uint32_t prim = (hit->object - first_object) * q.n_triangles + (uint32_t)hit->prim;
    if (!oracle_allows(meet_flat, &q, n_flat * q.n_triangles, 0, tmax, is_hit, hit->t, prim, why,
                       sizeof why)) {
        run_fail(run, "%s: %s: %d, t %.17g, object %u, primitive %d\n  the oracle: %s", ray,
                 worlds->at[0].structure, is_hit, hit->t, hit->object, hit->prim, why);
    }
    return is_hit;
}

Affine random_placement(uint64_t *random, double scale, bool is_mirrored, Vec3 to) {
    float a[3], b[3];
    random_direction(random, a);
    random_direction(random, b);
    Vec3 x = vec3_normalize(vec3(a[0], a[1], a[2]));
    Vec3 y = vec3_normalize(vec3_cross(x, vec3(b[0], b[1], b[2])));
    Vec3 z = vec3_scale(vec3_cross(x, y), is_mirrored ? -1 : 1);
    double s[3] = {scale, scale * (0.5 + test_uniform(random)),
                   scale * (0.5 + test_uniform(random))};
    return (Affine){{{s[0] * x.x, s[1] * y.x, s[2] * z.x, to.x},
                     {s[0] * x.y, s[1] * y.y, s[2] * z.y, to.y},
                     {s[0] * x.z, s[1] * y.z, s[2] * z.z, to.z}}};
}
