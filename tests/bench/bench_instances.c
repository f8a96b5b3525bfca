// SPDX-License-Identifier: Apache-2.0
// Instances with clocks of their own, 1 to 1,000,000 of them, beside duplicated data and beside
// Embree 3, which needs a prototype for each phase.
//
//   bench-instances [--obj FILE] [--most N] [--rays N] [--repeats N] [--tsv FILE]
//
// The scene of the thesis, 7.4: one mesh that hops and stretches once a cycle (without --obj a
// torus knot of as many triangles). Each row is a process of its own. Bytes are of the whole
// process at the first ray; "each" and "at peak", the most there was before, are what is more than
// for a hundred instances, which have reached every moment of the cycle, over their number. Rays
// come straight down over the crowd, all of which is in sight (rays beside each other meet other
// instances), or about a hundred of it; medians of the repeats, one thread, its own time.
#include <embree3/rtcore.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "accel/clock.h"
#include "render/world.h"
#include "tests/script_scene.h"

enum { MAX_REPEATS = 15 };

static const double pi = 3.14159265358979323846;

typedef struct {
    const char *obj, *tsv;
    long most;
    size_t n_rays;
    int repeats;
} Options;

static double thread_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double uniform(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

static size_t resident_bytes(void) {
    unsigned long pages = 0, all;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%lu %lu", &all, &pages) != 2) {
        pages = 0;
    }
    if (file) {
        fclose(file);
    }
    return pages * (size_t)sysconf(_SC_PAGESIZE);
}

static size_t peak_bytes(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (size_t)usage.ru_maxrss * 1024;
}

// ---- The mesh

typedef struct {
    float *p; // [n][3]
    uint32_t (*face)[3];
    uint32_t n, n_faces;
} Mesh3;

static Mesh3 obj_read(const char *path) {
    Mesh3 m = {0};
    char line[512];
    FILE *file = fopen(path, "r");
    if (!file) {
        fprintf(stderr, "bench-instances: no file %s\n", path);
        exit(2);
    }
    while (fgets(line, sizeof line, file)) {
        m.n += line[0] == 'v' && line[1] == ' ';
        m.n_faces += line[0] == 'f';
    }
    m.p = malloc(3 * sizeof *m.p * m.n);
    m.face = malloc(sizeof *m.face * m.n_faces);
    m.n = m.n_faces = 0;
    rewind(file);
    while (fgets(line, sizeof line, file)) {
        float *p = m.p + 3 * (size_t)m.n;
        uint32_t *f = m.face[m.n_faces];
        if (line[0] == 'v' && line[1] == ' ') {
            m.n += sscanf(line + 2, "%f %f %f", &p[0], &p[1], &p[2]) == 3;
        } else if (line[0] == 'f') {
            char *at = line + 1;
            for (int k = 0; k < 3; k++) {
                f[k] = (uint32_t)strtoul(at, &at, 10) - 1;
                at += strcspn(at, " \n");
            }
            m.n_faces++;
        }
    }
    fclose(file);
    return m;
}

// A torus knot that stands upright: 70,000 triangles.
static void write_knot(const char *path) {
    enum { ALONG = 1400, AROUND = 25 };
    FILE *file = fopen(path, "w");
    for (int i = 0; file && i < ALONG; i++) {
        double a = 2 * pi * i / ALONG, r = 2 + cos(3 * a);
        for (int k = 0; k < AROUND; k++) {
            double b = 2 * pi * k / AROUND, s = r + 0.5 * cos(b);
            fprintf(file, "v %.9g %.9g %.9g\n", s * cos(2 * a), s * sin(2 * a),
                    sin(3 * a) + 0.5 * sin(b));
        }
    }
    for (int i = 0; file && i < ALONG; i++) {
        for (int k = 0; k < AROUND; k++) {
            int j = (i + 1) % ALONG, l = (k + 1) % AROUND;
            int a = i * AROUND + k, b = i * AROUND + l, c = j * AROUND + l, d = j * AROUND + k;
            fprintf(file, "f %d %d %d\nf %d %d %d\n", a + 1, b + 1, c + 1, a + 1, c + 1, d + 1);
        }
    }
    if (file) {
        fclose(file);
    }
}

// ---- The scene

static char *script_of(const char *name, long n, bool is_flat) {
    char *text = malloc(4096);
    const char *clock = "(0.7 + 0.6*rand(1, i))", *offset = "rand(2, i)";
    int at =
        snprintf(text, 4096,
                 "film { size = <512, 512> fps = 24 frames = 1..1 }\n"
                 "shutter { phase = start }\n"
                 "let side = ceil(sqrt(%ld))\n"
                 "camera { from = <0, 3*side + 3, 0> to = <0, 0, 0> up = z fov = 20deg }\n"
                 "def Bunny%s { mesh { file = \"%s\" fit = 1m ground = true\n"
                 "  fn deform(p) = <p.x, p.y*(1 + 0.12*cos(1turn*%s)), p.z> }\n"
                 "  translate <0, 0.6*abs(sin(0.5turn*%s)), 0> }\n"
                 "for i in 0..%ld {\n",
                 n, is_flat ? "(c)" : "", name, is_flat ? "c" : "t", is_flat ? "c" : "t", n - 1);
    at += is_flat
              ? snprintf(text + at, 4096 - (size_t)at, "  Bunny((%s*t + %s) %% 1) {", clock, offset)
              : snprintf(text + at, 4096 - (size_t)at,
                         "  instance Bunny { speed = %s offset = %s*1s cycle = 1s", clock, offset);
    snprintf(text + at, 4096 - (size_t)at,
             " scale 0.4 rotate y, 360deg*rand(3, i)\n"
             "    translate <i %% side - side/2 + 0.3*rand(4, i), 0, "
             "floor(i / side) - side/2 + 0.3*rand(5, i)>\n"
             "    material = matte(hsv(rand(6, i), 0.25, 0.9)) }\n}\n");
    return text;
}

// ---- Rays

typedef struct {
    Vec3 o, d;
    double time; // of the shutter, 0..1
} Ray;

// Straight down within a square around the middle, in the order of a picture's lines.
static Ray *make_rays(size_t n, double side) {
    Ray *rays = malloc(n * sizeof *rays);
    size_t width = (size_t)sqrt((double)n);
    uint64_t seed = 1;
    for (size_t i = 0; i < n; i++) {
        double x = ((double)(i % width) + uniform(&seed)) / (double)width - 0.5;
        double z = ((double)(i / width) + uniform(&seed)) / (double)width - 0.5;
        double lean = 0.3 * (uniform(&seed) - 0.5);
        rays[i] = (Ray){vec3(x * side, 3, z * side), vec3(lean, -1, 0.2 * lean), uniform(&seed)};
    }
    return rays;
}

static int by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int n) {
    qsort(values, (size_t)n, sizeof *values, by_size);
    return values[n / 2];
}

// ---- Ours

typedef struct {
    double load, build; // seconds; build: to the first hit, structures included
    size_t resident, peak;
    double rate[2]; // rays a second of one thread: all in sight, a window
    double hits[2]; // share
    size_t array_bytes, tree_bytes;
} Row;

static double trace(const World *world, const Ray *rays, size_t n, double *hits) {
    WorldView *view = world_view_new(world);
    size_t n_hits = 0;
    double start = thread_seconds();
    for (size_t i = 0; i < n; i++) {
        WorldHit hit;
        world_view_time(view, (Instant){0, 0.5 * rays[i].time});
        n_hits += world_closest(view, rays[i].o, rays[i].d, 0, INFINITY, &hit);
    }
    double rate = (double)n / (thread_seconds() - start);
    world_view_destroy(view, NULL);
    *hits = (double)n_hits / (double)n;
    return rate;
}

static Row measure(const char *folder, const char *name, long n, bool is_flat,
                   const Options *options) {
    Row row = {0};
    char *text = script_of(name, n, is_flat);
    double start = clock_seconds();
    ScriptScene *script = script_scene_new(text, folder);
    const Scene *scene = script_scene(script);
    row.load = clock_seconds() - start;
    RenderOptions render = {.spp = 1,
                            .n_threads = (uint32_t)omp_get_max_threads(),
                            .accel = &accel_types[0],
                            .accel_options = accel_options_default()};
    RenderStats stats = {0};
    Reporter reporter = {0};
    int64_t frame = 1;
    uint32_t taken;
    World *world = world_build(scene, &render, &frame, 1, &reporter, &taken, &stats);
    if (!world) {
        exit(1);
    }
    double side = ceil(sqrt((double)n)), window = fmin(side, 10);
    // A few rays, until one hits: the structures are there, and the many rays are not yet.
    enum { FIRST_RAYS = 1024 };
    Ray *first = make_rays(FIRST_RAYS, side);
    double first_hit = 0;
    for (size_t i = 0; i < FIRST_RAYS && first_hit == 0; i++) {
        trace(world, first + i, 1, &first_hit);
    }
    free(first);
    row.build = clock_seconds() - start - row.load;
    row.resident = resident_bytes();
    row.peak = peak_bytes();
    Ray *all = make_rays(options->n_rays, side), *some = make_rays(options->n_rays, window);
    for (int k = 0; k < 2; k++) {
        double rates[MAX_REPEATS];
        for (int r = 0; r < options->repeats; r++) {
            rates[r] = trace(world, k ? some : all, options->n_rays, &row.hits[k]);
        }
        row.rate[k] = median(rates, options->repeats);
    }
    world_count(world, &stats);
    row.array_bytes = stats.vertex_bytes;
    row.tree_bytes = stats.tree_bytes + stats.segment_bytes;
    world_destroy(world);
    script_scene_free(script);
    free(all);
    free(some);
    free(text);
    return row;
}

// ---- Embree: a prototype for each phase

static ssize_t embree_bytes;

static bool count_bytes(void *context, ssize_t bytes, bool is_post) {
    (void)context;
    (void)is_post;
    __atomic_add_fetch(&embree_bytes, bytes, __ATOMIC_RELAXED);
    return true;
}

// As fit = 1m, ground = true have it.
static void fit(Mesh3 *m) {
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * (size_t)m->n; i++) {
        lo[i % 3] = fminf(lo[i % 3], m->p[i]);
        hi[i % 3] = fmaxf(hi[i % 3], m->p[i]);
    }
    float size = hi[1] - lo[1];
    for (size_t i = 0; i < 3 * (size_t)m->n; i++) {
        float middle = i % 3 == 1 ? lo[1] : 0.5f * (lo[i % 3] + hi[i % 3]);
        m->p[i] = (m->p[i] - middle) / size;
    }
}

static RTCScene prototype(RTCDevice device, const Mesh3 *m, double phase) {
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryTimeStepCount(geometry, 2);
    for (unsigned k = 0; k < 2; k++) {
        double t = phase + k * 0.5 / 24;
        float *to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, k, RTC_FORMAT_FLOAT3,
                                            12, m->n);
        float stretch = (float)(1 + 0.12 * cos(2 * pi * t)), hop = (float)(0.6 * fabs(sin(pi * t)));
        for (uint32_t i = 0; i < m->n; i++) {
            to[3 * i] = m->p[3 * i];
            to[3 * i + 1] = m->p[3 * i + 1] * stretch + hop;
            to[3 * i + 2] = m->p[3 * i + 2];
        }
    }
    memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                   m->n_faces),
           m->face, sizeof *m->face * m->n_faces);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    return scene;
}

static void embree_row(const Mesh3 *mesh, int n_phases, long n, const Options *options) {
    RTCDevice device = rtcNewDevice(NULL);
    rtcSetDeviceMemoryMonitorFunction(device, count_bytes, NULL);
    RTCScene *prototypes = malloc((size_t)n_phases * sizeof(RTCScene)), top = rtcNewScene(device);
    double start = clock_seconds(), side = ceil(sqrt((double)n)), rates[MAX_REPEATS];
    for (int k = 0; k < n_phases; k++) {
        prototypes[k] = prototype(device, mesh, (double)k / n_phases);
    }
    uint64_t seed = 2;
    for (long i = 0; i < n; i++) {
        RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        double angle = 2 * pi * uniform(&seed);
        float c = (float)(0.4 * cos(angle)), s = (float)(0.4 * sin(angle));
        float x = (float)(fmod((double)i, side) - side / 2 + 0.3 * uniform(&seed));
        float z = (float)(floor((double)i / side) - side / 2 + 0.3 * uniform(&seed));
        const float map[12] = {c, 0, -s, 0, 0.4f, 0, s, 0, c, x, 0, z}; // columns
        rtcSetGeometryInstancedScene(instance,
                                     prototypes[(int)(uniform(&seed) * n_phases) % n_phases]);
        rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, map);
        rtcCommitGeometry(instance);
        rtcAttachGeometry(top, instance);
        rtcReleaseGeometry(instance);
    }
    rtcCommitScene(top);
    double build = clock_seconds() - start;
    Ray *rays = make_rays(options->n_rays, side);
    size_t n_hits = 0;
    for (int r = 0; r < options->repeats; r++) {
        double from = thread_seconds();
        n_hits = 0;
        for (size_t i = 0; i < options->n_rays; i++) {
            const Ray *ray = &rays[i];
            struct RTCRayHit q = {.ray = {.org_x = (float)ray->o.x,
                                          .org_y = (float)ray->o.y,
                                          .org_z = (float)ray->o.z,
                                          .dir_x = (float)ray->d.x,
                                          .dir_y = (float)ray->d.y,
                                          .dir_z = (float)ray->d.z,
                                          .time = (float)ray->time,
                                          .tfar = INFINITY,
                                          .mask = UINT32_MAX},
                                  .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
            struct RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            rtcIntersect1(top, &context, &q);
            n_hits += q.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
        rates[r] = (double)options->n_rays / (thread_seconds() - from);
    }
    printf("embree, %3d phases %9ld %11.2f %9.1f MB %28.3f %8.2f\n", n_phases, n, build,
           (double)embree_bytes / 1e6, median(rates, options->repeats) / 1e6,
           (double)n_hits / (double)options->n_rays);
    fflush(stdout);
    free(rays);
    free(prototypes);
}

// ---- Rows, each in a process of its own

static bool run_apart(Row *row, const char *folder, const char *name, long n, bool is_flat,
                      const Options *options) {
    int ends[2], status;
    if (pipe(ends)) {
        return false;
    }
    pid_t child = fork();
    if (child == 0) {
        Row own = measure(folder, name, n, is_flat, options);
        _exit(write(ends[1], &own, sizeof own) == (ssize_t)sizeof own ? 0 : 1);
    }
    close(ends[1]);
    bool is_read = read(ends[0], row, sizeof *row) == (ssize_t)sizeof *row;
    close(ends[0]);
    return child > 0 && waitpid(child, &status, 0) == child && is_read;
}

static void print_row(const char *what, long n, const Row *row, const Row *hundred) {
    double more = n > 100 ? (double)(n - 100) : 1;
    printf("%-18s %9ld %5.2f %5.2f %9.1f MB %9.0f %9.0f B %7.3f %8.2f %7.3f %8.2f\n", what, n,
           row->load, row->build, (double)row->resident / 1e6,
           ((double)row->resident - (double)hundred->resident) / more,
           ((double)row->peak - (double)hundred->resident) / more, row->rate[0] / 1e6, row->hits[0],
           row->rate[1] / 1e6, row->hits[1]);
    fflush(stdout);
}

static void print_head(void) {
    printf("%-18s %9s %5s %5s %12s %9s %11s %7s %8s %7s %8s\n", "", "n", "load", "build", "memory",
           "each", "at peak", "Mrays/s", "hit", "of 100", "hit");
}

static void refuse(void) {
    fputs("usage: bench-instances [--obj FILE] [--most N] [--rays N] [--repeats N] [--tsv FILE]\n",
          stderr);
    exit(2);
}

static Options read_options(int argc, char **argv) {
    Options o = {.most = 1000000, .n_rays = 250000, .repeats = 5};
    for (int i = 1; i < argc; i += 2) {
        const char *name = argv[i], *value = argv[i + 1];
        if (!value) {
            refuse();
        } else if (strcmp(name, "--obj") == 0) {
            o.obj = value;
        } else if (strcmp(name, "--most") == 0) {
            o.most = atol(value);
        } else if (strcmp(name, "--rays") == 0) {
            o.n_rays = (size_t)atol(value);
        } else if (strcmp(name, "--repeats") == 0) {
            o.repeats = atoi(value) < MAX_REPEATS ? atoi(value) : MAX_REPEATS;
        } else if (strcmp(name, "--tsv") == 0) {
            o.tsv = value;
        } else {
            refuse();
        }
    }
    return o;
}

int main(int argc, char **argv) {
    Options options = read_options(argc, argv);
    char made[] = "/tmp/st4-instances.XXXXXX", folder[4096] = ".", path[4200];
    const char *slash = options.obj ? strrchr(options.obj, '/') : NULL, *name = "m.obj";
    if (options.obj) {
        name = slash ? slash + 1 : options.obj;
        if (slash) {
            snprintf(folder, sizeof folder, "%.*s", (int)(slash - options.obj), options.obj);
        }
    } else if (mkdtemp(made)) {
        snprintf(folder, sizeof folder, "%s", made);
    } else {
        return 1;
    }
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (!options.obj) {
        write_knot(path);
    }
    FILE *tsv = options.tsv ? fopen(options.tsv, "w") : NULL;
    if (tsv) {
        fputs("n\tload_s\tbuild_s\tbytes\tpeak_bytes\tduplicated_bytes\trays_per_s\n", tsv);
    }
    Row one = {0}, hundred = {0}, row;
    print_head();
    for (long n = 1; n <= options.most; n *= 10) {
        if (!run_apart(&row, folder, name, n, false, &options)) {
            return 1;
        }
        one = n == 1 ? row : one;
        hundred = n <= 100 ? row : hundred;
        print_row("st4", n, &row, &hundred);
        // What n copies of one instance's keys and tree would take.
        double copies = (double)n * (double)(one.array_bytes + one.tree_bytes);
        if (tsv) {
            fprintf(tsv, "%ld\t%g\t%g\t%zu\t%zu\t%g\t%g\n", n, row.load, row.build, row.resident,
                    row.peak, copies, row.rate[0]);
        }
    }
    for (long n = 10; n <= 100 && n <= options.most; n *= 10) {
        if (run_apart(&row, folder, name, n, true, &options)) {
            print_row("st4, duplicated", n, &row, &row);
        }
    }
    Mesh3 mesh = obj_read(path);
    fit(&mesh);
    long n_embree = options.most < 100000 ? options.most : 100000;
    for (int phases = 16; phases <= 256; phases *= 4) {
        fflush(stdout);
        pid_t child = fork();
        if (child == 0) {
            embree_row(&mesh, phases, n_embree, &options);
            _exit(0);
        }
        waitpid(child, NULL, 0);
    }
    if (tsv) {
        fclose(tsv);
    }
    if (!options.obj) {
        unlink(path);
        rmdir(folder);
    }
    return 0;
}
