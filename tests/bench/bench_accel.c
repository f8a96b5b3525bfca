// SPDX-License-Identifier: Apache-2.0
// Structures against one another and against Embree 3, on the same rays in one process.
//
//   bench-accel [--scene N] [--rays N] [--repeats N] [--threads N] [--obj FILE] [--isa NAME]
//               [--check N] [--skip NAMES]
//
// Runs alternate between the engines; each figure is the median of the repeats. The ratio to Embree
// is the worse of two orders of the rays: by pixel and by time.
#include <embree3/rtcore.h>
#include <immintrin.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tests/bench/scenes.h"

enum { PRIMARY, BOUNCE, SHADOW, N_KINDS };
enum { BY_PIXEL, BY_TIME, N_ORDERS };
enum { MAX_ENGINES = 8, MAX_REPEATS = 15 };

static const char *const kind_names[N_KINDS] = {"primary", "bounce", "shadow"};

typedef struct {
    float o[3], d[3], time;
} Ray;

// Both sides' own forms of a ray are made before the clock starts.
typedef struct {
    Ray *rays;
    AccelRay *prepared;
    size_t n;
} RaySet;

typedef struct {
    const char *name;
    Accel *accel; // NULL: Embree
    RTCScene scene;
    double build_seconds, rate[N_ORDERS][N_KINDS], spread[N_ORDERS][N_KINDS];
    size_t bytes;
    AccelStats stats;
} Engine;

typedef struct {
    size_t n_rays, n_check;
    int only, repeats, threads;
    const char *obj, *isa, *skip;
} Options;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static uint64_t random_state = 1;

static double uniform(void) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) * 0x1p-53;
}

// -- rays -----------------------------------------------------------------------------------------

static AccelRay to_accel(const Geometry *g, const Ray *r, int kind) {
    uint32_t spans = g->n_keys > 1 ? g->n_keys - 1 : 1;
    double u = (double)r->time * spans;
    uint32_t key = (uint32_t)u < spans ? (uint32_t)u : spans - 1;
    AccelRay ray = {
        .tmin = 0, .tmax = kind == SHADOW ? 1 : INFINITY, .f = (float)(u - key), .key = key};
    memcpy(ray.origin, r->o, sizeof ray.origin);
    memcpy(ray.dir, r->d, sizeof ray.dir);
    return ray;
}

static int by_time(const void *a, const void *b) {
    float x = ((const Ray *)a)->time, y = ((const Ray *)b)->time;
    return (x > y) - (x < y);
}

static void primary_rays(const BenchScene *s, size_t n, RaySet *set) {
    size_t width = (size_t)sqrt((double)n * 4 / 3), height = n / width;
    set->n = width * height;
    set->rays = malloc(set->n * sizeof *set->rays);
    const float *e = s->eye;
    double l = sqrt((double)e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    double f[3] = {-e[0] / l, -e[1] / l, -e[2] / l}, rl = hypot(f[2], f[0]);
    double right[3] = {-f[2] / rl, 0, f[0] / rl};
    double up[3] = {right[1] * f[2] - right[2] * f[1], right[2] * f[0] - right[0] * f[2],
                    right[0] * f[1] - right[1] * f[0]};
    for (size_t i = 0; i < set->n; i++) {
        double x = ((double)(i % width) + uniform()) / (double)width * 2 - 1;
        double y = 1 - ((double)(i / width) + uniform()) / (double)height * 2;
        Ray *r = &set->rays[i];
        for (int a = 0; a < 3; a++) {
            r->o[a] = e[a];
            r->d[a] = (float)(f[a] + s->window * (4.0 / 3 * x * right[a] + y * up[a]));
        }
        r->time = (float)uniform();
    }
}

static void corners_at(const Geometry *g, const AccelRay *ray, int32_t prim, double p[3][3]) {
    uint32_t next = ray->key + (g->n_keys > 1);
    for (size_t c = 0; c < 3; c++) {
        size_t v = g->index[3 * (size_t)prim + c];
        const float *a = g->position + 3 * (ray->key * (size_t)g->n_vertices + v);
        const float *b = g->position + 3 * (next * (size_t)g->n_vertices + v);
        for (int k = 0; k < 3; k++) {
            p[c][k] = (double)a[k] + (double)ray->f * ((double)b[k] - a[k]);
        }
    }
}

// The normal towards the ray's origin; false for a triangle without area.
static bool normal_at(const Geometry *g, const AccelRay *ray, int32_t prim, double n[3]) {
    double p[3][3], along = 0, l = 0;
    corners_at(g, ray, prim, p);
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        n[k] =
            (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
        l += n[k] * n[k];
        along += n[k] * ray->dir[k];
    }
    for (int k = 0; k < 3; k++) {
        n[k] /= along > 0 ? -sqrt(l) : sqrt(l);
    }
    return l > 0;
}

// From each hit of a primary ray one cosine-distributed bounce and one ray to a lamp.
static void secondary_rays(const Accel *accel, const Geometry *g, RaySet *sets) {
    static const float lamp[3] = {1.5f, 2.5f, 2};
    const RaySet *from = &sets[PRIMARY];
    RaySet *bounce = &sets[BOUNCE], *shadow = &sets[SHADOW];
    bounce->rays = malloc(from->n * sizeof(Ray));
    shadow->rays = malloc(from->n * sizeof(Ray));
    bounce->n = shadow->n = 0;
    for (size_t i = 0; i < from->n; i++) {
        AccelRay ray = to_accel(g, &from->rays[i], PRIMARY);
        AccelHit hit;
        double n[3];
        if (!accel->type->closest(accel, &ray, &hit, NULL) || !normal_at(g, &ray, hit.prim, n)) {
            continue;
        }
        Ray *b = &bounce->rays[bounce->n++], *s = &shadow->rays[shadow->n++];
        double z = 2 * uniform() - 1, a = 6.283185307179586 * uniform(), r = sqrt(1 - z * z);
        double q[3] = {r * cos(a), r * sin(a), z};
        for (int k = 0; k < 3; k++) {
            double at = (double)ray.origin[k] + (double)hit.t * ray.dir[k] + 1e-4 * n[k];
            b->o[k] = s->o[k] = (float)at;
            b->d[k] = (float)(q[k] + n[k]);
            s->d[k] = lamp[k] - s->o[k];
        }
        b->time = s->time = from->rays[i].time;
    }
}

// -- engines --------------------------------------------------------------------------------------

static size_t embree_bytes;

static bool count_bytes(void *user, ssize_t bytes, bool post) {
    (void)user;
    (void)post;
    embree_bytes += (size_t)bytes;
    return true;
}

// Its vertices are copies, so that both sides own theirs; they are not counted.
static Engine embree_engine(RTCDevice device, const Geometry *g) {
    Engine engine = {.name = "embree", .scene = rtcNewScene(device)};
    embree_bytes = 0;
    rtcSetSceneBuildQuality(engine.scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryTimeStepCount(mesh, g->n_keys);
    size_t key = 3 * (size_t)g->n_vertices;
    for (uint32_t k = 0; k < g->n_keys; k++) {
        void *to = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, k, RTC_FORMAT_FLOAT3, 12,
                                           g->n_vertices);
        memcpy(to, g->position + k * key, key * sizeof(float));
    }
    void *index =
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, g->n_prims);
    memcpy(index, g->index, 12 * (size_t)g->n_prims);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(engine.scene, mesh);
    rtcReleaseGeometry(mesh);
    size_t before = embree_bytes;
    double start = now();
    rtcCommitScene(engine.scene);
    engine.build_seconds = now() - start;
    engine.bytes = embree_bytes - before;
    return engine;
}

static Engine accel_engine(const AccelType *type, const Geometry *g, int threads) {
    Engine engine = {.name = type->name};
    AccelOptions options = accel_options_default();
    options.n_threads = (uint32_t)threads;
    double start = now();
    engine.accel = type->build(g, &options, &engine.stats);
    engine.build_seconds = now() - start;
    engine.bytes = engine.stats.tree_bytes + engine.stats.segment_bytes;
    return engine;
}

static void run_embree(RTCScene scene, const RaySet *set, int kind) {
#pragma omp parallel
    {
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
        struct RTCIntersectContext context;
        rtcInitIntersectContext(&context);
#pragma omp for schedule(static, 4096)
        for (size_t i = 0; i < set->n; i++) {
            const Ray *r = &set->rays[i];
            struct RTCRayHit q = {.ray = {r->o[0], r->o[1], r->o[2], 0, r->d[0], r->d[1], r->d[2],
                                          r->time, kind == SHADOW ? 1 : INFINITY, 0xffffffff, 0, 0},
                                  .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
            if (kind == SHADOW) {
                rtcOccluded1(scene, &context, &q.ray);
            } else {
                rtcIntersect1(scene, &context, &q);
            }
        }
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_OFF);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_OFF);
    }
}

static void run_accel(const Accel *accel, const RaySet *set, int kind) {
#pragma omp parallel for schedule(static, 4096)
    for (size_t i = 0; i < set->n; i++) {
        AccelHit hit;
        if (kind == SHADOW) {
            accel->type->occluded(accel, &set->prepared[i], NULL);
        } else {
            accel->type->closest(accel, &set->prepared[i], &hit, NULL);
        }
    }
}

static void prepare(const Geometry *g, RaySet *set, int kind) {
    set->prepared = realloc(set->prepared, set->n * sizeof *set->prepared);
    for (size_t i = 0; i < set->n; i++) {
        set->prepared[i] = to_accel(g, &set->rays[i], kind);
    }
}

// -- measuring ------------------------------------------------------------------------------------

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void measure(Engine *engines, int n, const RaySet *set, int kind, int order, int repeats) {
    double t[MAX_ENGINES][MAX_REPEATS];
    for (int r = 0; r < repeats; r++) {
        for (int e = 0; e < n; e++) {
            double start = now();
            if (engines[e].accel) {
                run_accel(engines[e].accel, set, kind);
            } else {
                run_embree(engines[e].scene, set, kind);
            }
            t[e][r] = now() - start;
        }
    }
    for (int e = 0; e < n; e++) {
        qsort(t[e], (size_t)repeats, sizeof(double), by_value);
        double median = t[e][repeats / 2];
        engines[e].rate[order][kind] = (double)set->n / median * 1e-6;
        engines[e].spread[order][kind] = (t[e][repeats - 1] - t[e][0]) / median;
    }
}

static uint64_t disagreements(const Accel *accel, const Accel *brute, const Geometry *g,
                              const RaySet *set, size_t n) {
    uint64_t wrong = 0;
    n = n < set->n ? n : set->n;
#pragma omp parallel for reduction(+ : wrong) schedule(dynamic, 64)
    for (size_t i = 0; i < n; i++) {
        AccelRay ray = to_accel(g, &set->rays[i * (set->n / n)], PRIMARY);
        AccelHit a, b;
        bool x = accel->type->closest(accel, &ray, &a, NULL);
        bool y = brute->type->closest(brute, &ray, &b, NULL);
        wrong += x != y || (x && (a.prim != b.prim || a.t != b.t));
    }
    return wrong;
}

static AccelCounters count(const Accel *accel, const Geometry *g, const RaySet *set) {
    AccelCounters counters = {0};
    for (size_t i = 0; i < set->n; i += 7) {
        AccelRay ray = to_accel(g, &set->rays[i], PRIMARY);
        AccelHit hit;
        accel->type->closest(accel, &ray, &hit, &counters);
    }
    return counters;
}

static void report(const Engine *e, const Engine *embree, const Geometry *g, const RaySet *sets,
                   const Accel *brute, size_t n_check) {
    printf("  %-12s build %7.3f s %8.2f MB", e->name, e->build_seconds, (double)e->bytes * 1e-6);
    for (int kind = 0; kind < N_KINDS; kind++) {
        double a = e->rate[BY_PIXEL][kind] / embree->rate[BY_PIXEL][kind];
        double b = e->rate[BY_TIME][kind] / embree->rate[BY_TIME][kind];
        printf("  %s %6.2f %6.2f x%.2f", kind_names[kind], e->rate[BY_PIXEL][kind],
               e->rate[BY_TIME][kind], a < b ? a : b);
    }
    if (e->accel) {
        AccelCounters p = count(e->accel, g, &sets[PRIMARY]), b = count(e->accel, g, &sets[BOUNCE]);
        printf("  nodes %.1f %.1f tests %.0f %.0f", (double)p.nodes / (double)p.rays,
               (double)b.nodes / (double)b.rays, (double)p.prim_tests / (double)p.rays,
               (double)b.prim_tests / (double)b.rays);
    }
    if (e->accel && brute && n_check) {
        uint64_t wrong = disagreements(e->accel, brute, g, &sets[PRIMARY], n_check / 2) +
                         disagreements(e->accel, brute, g, &sets[BOUNCE], n_check / 2);
        printf("  wrong %llu", (unsigned long long)wrong);
    }
    printf("\n");
    fflush(stdout);
}

static void bench(RTCDevice device, const BenchScene *scene, const Options *o) {
    const Geometry *g = &scene->geometry;
    Engine engines[MAX_ENGINES];
    int n = 0;
    engines[n++] = embree_engine(device, g);
    Accel *brute = NULL;
    for (const AccelType *type = accel_types; type->name; type++) {
        if (strcmp(type->name, "brute") == 0) {
            AccelStats stats;
            AccelOptions options = accel_options_default();
            brute = type->build(g, &options, &stats);
        } else if (!strstr(o->skip, type->name)) {
            engines[n++] = accel_engine(type, g, o->threads);
        }
    }
    RaySet sets[N_KINDS] = {0};
    primary_rays(scene, o->n_rays, &sets[PRIMARY]);
    secondary_rays(engines[1].accel, g, sets);
    printf("\n%s: %u triangles, %u keys\n", scene->name, g->n_prims, g->n_keys);
    for (int order = 0; order < N_ORDERS; order++) {
        for (int kind = 0; kind < N_KINDS; kind++) {
            if (order == BY_TIME) {
                qsort(sets[kind].rays, sets[kind].n, sizeof(Ray), by_time);
            }
            prepare(g, &sets[kind], kind);
            measure(engines, n, &sets[kind], kind, order, o->repeats);
        }
    }
    for (int e = 0; e < n; e++) {
        report(&engines[e], &engines[0], g, sets, brute, o->n_check);
    }
    for (int kind = 0; kind < N_KINDS; kind++) {
        free(sets[kind].rays);
        free(sets[kind].prepared);
    }
    for (int e = 1; e < n; e++) {
        engines[e].accel->type->destroy(engines[e].accel);
    }
    if (brute) {
        brute->type->destroy(brute);
    }
    rtcReleaseScene(engines[0].scene);
}

static Options parse(int argc, char **argv) {
    Options o = {640 * 480, 10000, -1, 5, 1, NULL, "", ""};
    for (int i = 1; i + 1 < argc; i += 2) {
        const char *name = argv[i], *value = argv[i + 1];
        if (strcmp(name, "--scene") == 0) {
            o.only = atoi(value);
        } else if (strcmp(name, "--rays") == 0) {
            o.n_rays = strtoull(value, NULL, 10);
        } else if (strcmp(name, "--repeats") == 0) {
            o.repeats = atoi(value) < MAX_REPEATS ? atoi(value) : MAX_REPEATS;
        } else if (strcmp(name, "--threads") == 0) {
            o.threads = atoi(value);
        } else if (strcmp(name, "--obj") == 0) {
            o.obj = value;
        } else if (strcmp(name, "--check") == 0) {
            o.n_check = strtoull(value, NULL, 10);
        } else if (strcmp(name, "--isa") == 0) {
            o.isa = value;
        } else if (strcmp(name, "--skip") == 0) {
            o.skip = value;
        }
    }
    return o;
}

int main(int argc, char **argv) {
    Options o = parse(argc, argv);
    omp_set_num_threads(o.threads);
    char config[64];
    snprintf(config, sizeof config, "threads=%d%s%s", o.threads, *o.isa ? ",isa=" : "", o.isa);
    RTCDevice device = rtcNewDevice(config);
    rtcSetDeviceMemoryMonitorFunction(device, count_bytes, NULL);
    printf("# Embree %s, cpu %s, %d threads, %zu primary rays, medians of %d\n", RTC_VERSION_STRING,
           accel_cpu(), o.threads, o.n_rays, o.repeats);
    printf("# Mray/s by pixel and by time, x: the worse ratio to Embree; nodes and tests per ray,"
           " primary and bounce\n");
    for (int i = 0; i < BENCH_N_SCENES; i++) {
        BenchScene scene;
        if ((o.only < 0 || i == o.only) && bench_scene(i, o.obj, &scene)) {
            bench(device, &scene, &o);
            bench_scene_free(&scene);
        }
    }
    rtcReleaseDevice(device);
    return 0;
}
