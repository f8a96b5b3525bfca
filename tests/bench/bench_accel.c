// SPDX-License-Identifier: Apache-2.0
// Structures against one another and against Embree 3, on the same rays in one process.
//
//   bench-accel [--scene N] [--rays N] [--repeats N] [--threads N] [--obj FILE] [--isa NAME]
//               [--check N] [--skip NAMES] [--json FILE]
//
// --isa avx2 is for both sides; without it each takes its best.
//
// Runs alternate between the engines; each figure is the median of the repeats, with half the
// spread from the least to the greatest in percent of it. The ratio to Embree is the worse of two
// orders of the rays: by pixel and by time. Structures are built by all threads; rays are traced by
// one thread, whose own time counts, so that other work on the machine counts little; then by all.
#include <embree3/rtcore.h>
#include <immintrin.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "accel/cpu.h"
#include "tests/bench/scenes.h"

enum { PRIMARY, BOUNCE, SHADOW, N_KINDS };
enum { BY_PIXEL, BY_TIME, N_ORDERS };
enum { BY_ONE, BY_ALL, N_CREWS }; // threads
enum { MAX_ENGINES = 8, MAX_REPEATS = 15 };

static const char *const kind_names[N_KINDS] = {"primary", "bounce", "shadow"};
static const char *const order_names[N_ORDERS] = {"by pixel", "by time"};

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
    double rate, spread; // millions of rays a second; part of the median
} Speed;

typedef struct {
    const char *name;
    Accel *accel; // NULL: Embree
    RTCScene scene;
    double build_seconds;
    Speed speed[N_CREWS][N_ORDERS][N_KINDS];
    size_t bytes;
    AccelStats stats;
    AccelCounters counters[N_KINDS];
    uint64_t n_checked, n_wrong;
} Engine;

typedef struct {
    size_t n_rays, n_check;
    int only, repeats, threads;
    const char *obj, *isa, *skip, *json;
} Options;

static double clock_at(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double now(void) {
    return clock_at(CLOCK_MONOTONIC);
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

static void measure(Engine *engines, int n, const RaySet *set, int crew, int kind, int order,
                    int repeats) {
    double t[MAX_ENGINES][MAX_REPEATS];
    clockid_t clock = crew == BY_ONE ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
    for (int r = 0; r < repeats; r++) {
        for (int e = 0; e < n; e++) {
            double start = clock_at(clock);
            if (engines[e].accel) {
                run_accel(engines[e].accel, set, kind);
            } else {
                run_embree(engines[e].scene, set, kind);
            }
            t[e][r] = clock_at(clock) - start;
        }
    }
    for (int e = 0; e < n; e++) {
        qsort(t[e], (size_t)repeats, sizeof(double), by_value);
        double median = t[e][repeats / 2];
        engines[e].speed[crew][order][kind] =
            (Speed){(double)set->n / median * 1e-6, (t[e][repeats - 1] - t[e][0]) / median};
    }
}

static void measure_all(Engine *engines, int n, const Geometry *g, RaySet *sets, const Options *o) {
    for (int order = 0; order < N_ORDERS; order++) {
        for (int kind = 0; kind < N_KINDS; kind++) {
            if (order == BY_TIME) {
                qsort(sets[kind].rays, sets[kind].n, sizeof(Ray), by_time);
            }
            prepare(g, &sets[kind], kind);
            for (int crew = 0; crew < (o->threads > 1 ? N_CREWS : 1); crew++) {
                omp_set_num_threads(crew == BY_ONE ? 1 : o->threads);
                measure(engines, n, &sets[kind], crew, kind, order, o->repeats);
            }
        }
    }
    omp_set_num_threads(o->threads);
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

// -- reports --------------------------------------------------------------------------------------

// To Embree, in the worse order.
static double ratio(const Engine *e, const Engine *embree, int crew, int kind) {
    double a = e->speed[crew][BY_PIXEL][kind].rate / embree->speed[crew][BY_PIXEL][kind].rate;
    double b = e->speed[crew][BY_TIME][kind].rate / embree->speed[crew][BY_TIME][kind].rate;
    return a < b ? a : b;
}

static double per_ray(uint64_t count, const AccelCounters *counters) {
    return counters->rays ? (double)count / (double)counters->rays : 0;
}

static void print_crew(const Engine *e, const Engine *embree, int crew) {
    for (int kind = 0; kind < N_KINDS; kind++) {
        const Speed *a = &e->speed[crew][BY_PIXEL][kind], *b = &e->speed[crew][BY_TIME][kind];
        double spread = a->spread > b->spread ? a->spread : b->spread;
        printf("  %s %6.2f %6.2f +-%.0f%% x%.2f", kind_names[kind], a->rate, b->rate, 50 * spread,
               ratio(e, embree, crew, kind));
    }
}

static void print_engine(const Engine *e, const Engine *embree, const Options *o) {
    const AccelCounters *p = &e->counters[PRIMARY], *b = &e->counters[BOUNCE];
    printf("  %-12s build %7.3f s x%.2f %8.2f MB x%.2f", e->name, e->build_seconds,
           e->build_seconds / embree->build_seconds, (double)e->bytes * 1e-6,
           (double)e->bytes / (double)embree->bytes);
    print_crew(e, embree, BY_ONE);
    if (e->accel) {
        printf("  nodes %.1f %.1f tests %.0f %.0f", per_ray(p->nodes, p), per_ray(b->nodes, b),
               per_ray(p->prim_tests, p), per_ray(b->prim_tests, b));
    }
    if (e->n_checked) {
        printf("  wrong %llu", (unsigned long long)e->n_wrong);
    }
    if (o->threads > 1) {
        printf("\n  %12s %d threads                     ", "", o->threads);
        print_crew(e, embree, BY_ALL);
    }
    printf("\n");
    fflush(stdout);
}

static void write_engine(FILE *json, const Engine *e, const Engine *embree, const Options *o) {
    fprintf(json,
            "{\"structure\": \"%s\", \"build_seconds\": %.6g, \"bytes\": %zu, \"checked\": %llu, "
            "\"wrong\": %llu, \"rays\": [",
            e->name, e->build_seconds, e->bytes, (unsigned long long)e->n_checked,
            (unsigned long long)e->n_wrong);
    const char *comma = "";
    for (int crew = 0; crew < (o->threads > 1 ? N_CREWS : 1); crew++) {
        for (int kind = 0; kind < N_KINDS; kind++) {
            const AccelCounters *c = &e->counters[kind];
            fprintf(json, "%s\n    {\"kind\": \"%s\", \"threads\": %d, \"ratio\": %.4g", comma,
                    kind_names[kind], crew == BY_ONE ? 1 : o->threads,
                    ratio(e, embree, crew, kind));
            for (int order = 0; order < N_ORDERS; order++) {
                const Speed *speed = &e->speed[crew][order][kind];
                fprintf(json, ", \"%s\": {\"mrays\": %.5g, \"spread\": %.3g}", order_names[order],
                        speed->rate, speed->spread);
            }
            fprintf(json, ", \"nodes\": %.4g, \"tests\": %.4g}", per_ray(c->nodes, c),
                    per_ray(c->prim_tests, c));
            comma = ",";
        }
    }
    fprintf(json, "]}");
}

static void report(FILE *json, const BenchScene *scene, const Engine *engines, int n,
                   const Options *o) {
    static bool is_later;
    for (int e = 0; e < n; e++) {
        print_engine(&engines[e], &engines[0], o);
    }
    if (json) {
        fprintf(json, "%s\n{\"scene\": \"%s\", \"triangles\": %u, \"keys\": %u, \"structures\": [",
                is_later ? "," : "", scene->name, scene->geometry.n_prims, scene->geometry.n_keys);
        for (int e = 0; e < n; e++) {
            fprintf(json, "%s\n  ", e ? "," : "");
            write_engine(json, &engines[e], &engines[0], o);
        }
        fprintf(json, "]}");
        is_later = true;
    }
}

// -- all ------------------------------------------------------------------------------------------

static void check(Engine *e, const Geometry *g, const RaySet *sets, const Accel *brute,
                  size_t n_check) {
    for (int kind = 0; kind < N_KINDS; kind++) {
        e->counters[kind] = count(e->accel, g, &sets[kind]);
    }
    if (brute && n_check) {
        e->n_checked = n_check;
        e->n_wrong = disagreements(e->accel, brute, g, &sets[PRIMARY], n_check / 2) +
                     disagreements(e->accel, brute, g, &sets[BOUNCE], n_check / 2);
    }
}

static void bench(RTCDevice device, const BenchScene *scene, const Options *o, FILE *json) {
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
    measure_all(engines, n, g, sets, o);
    for (int e = 1; e < n; e++) {
        check(&engines[e], g, sets, brute, o->n_check);
    }
    report(json, scene, engines, n, o);
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

static bool parse_option(Options *o, const char *name, const char *value) {
    const struct {
        const char *name;
        const char **text;
        int *number;
        size_t *size;
    } options[] = {
        {"--scene", NULL, &o->only, NULL},      {"--rays", NULL, NULL, &o->n_rays},
        {"--check", NULL, NULL, &o->n_check},   {"--repeats", NULL, &o->repeats, NULL},
        {"--threads", NULL, &o->threads, NULL}, {"--obj", &o->obj, NULL, NULL},
        {"--isa", &o->isa, NULL, NULL},         {"--skip", &o->skip, NULL, NULL},
        {"--json", &o->json, NULL, NULL},
    };
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        if (strcmp(options[i].name, name) == 0) {
            if (options[i].text) {
                *options[i].text = value;
            } else if (options[i].number) {
                *options[i].number = atoi(value);
            } else {
                *options[i].size = strtoull(value, NULL, 10);
            }
            return true;
        }
    }
    return false;
}

int main(int argc, char **argv) {
    Options o = {640 * 480, 10000, -1, 5, omp_get_num_procs(), NULL, "", "", NULL};
    for (int i = 1; i < argc; i += 2) {
        if (i + 1 == argc || !parse_option(&o, argv[i], argv[i + 1])) {
            fprintf(stderr, "bench-accel: %s: no such option, or no value for it\n", argv[i]);
            return 2;
        }
    }
    o.repeats = o.repeats < 1 ? 1 : o.repeats < MAX_REPEATS ? o.repeats : MAX_REPEATS;
    FILE *json = o.json ? fopen(o.json, "w") : NULL;
    if (o.json && !json) {
        perror(o.json);
        return 3;
    }
    omp_set_num_threads(o.threads);
    if (*o.isa && !cpu_set(o.isa)) {
        fprintf(stderr, "bench-accel: --isa %s: this processor has no such kernels\n", o.isa);
        return 2;
    }
    char config[64];
    snprintf(config, sizeof config, "threads=%d%s%s", o.threads, *o.isa ? ",isa=" : "", o.isa);
    RTCDevice device = rtcNewDevice(config);
    rtcSetDeviceMemoryMonitorFunction(device, count_bytes, NULL);
    printf("# Embree %s, cpu %s, %d threads, %zu primary rays, medians of %d\n", RTC_VERSION_STRING,
           cpu_names[cpu_now()], o.threads, o.n_rays, o.repeats);
    printf("# Mray/s by pixel and by time, half the spread, x: the ratio to Embree, for rays in the"
           " worse order;\n# nodes and tests per ray, primary and bounce\n");
    if (json) {
        fprintf(json, "{\"embree\": \"%s\", \"cpu\": \"%s\", \"isa\": \"%s\", \"scenes\": [",
                RTC_VERSION_STRING, cpu_names[cpu_now()], o.isa);
    }
    for (int i = 0; i < BENCH_N_SCENES; i++) {
        BenchScene scene;
        if ((o.only < 0 || i == o.only) && bench_scene(i, o.obj, &scene)) {
            bench(device, &scene, &o, json);
            bench_scene_free(&scene);
        }
    }
    rtcReleaseDevice(device);
    if (json) {
        fprintf(json, "]}\n");
        fclose(json);
    }
    return 0;
}
