// SPDX-License-Identifier: Apache-2.0
// The light tree: building, drawing, probabilities.
#include "render/light_tree.h"

#include "render/program.h"
#include "render/sampling.h"

enum { NONE = UINT32_MAX, BINS = 12 };

// What is out of sight as far as the bounds know is taken for so much of what is in sight: they
// may miss motion between the instants that they were made from.
static const double LEAST = 1e-3;

// 64 bytes. An inner node's first child follows it.
typedef struct {
    float lo[3], hi[3], axis[3];
    float cos_o, cos_e, power;
    uint32_t second; // child; a leaf: NONE
    uint32_t parent; // the root: NONE
    uint32_t light;  // of a leaf
    uint32_t two_sided;
} Node;

struct LightTree {
    Node *nodes;
    uint32_t n_nodes;
    uint32_t *leaf; // [n lights]; NONE: never drawn
    uint32_t n;
};

// ---- Cones

typedef struct {
    Vec3 axis;
    double cosine;
} Cone;

static double safe_acos(double x) {
    return program_fold(OP_ACOS, x < -1 ? -1 : x > 1 ? 1 : x, 0, 0);
}

static double safe_sqrt(double x) {
    return x > 0 ? sqrt(x) : 0;
}

static Cone cone_join(Cone a, Cone b) {
    if (a.cosine < b.cosine) {
        Cone wider = a;
        a = b;
        b = wider;
    }
    // b is the wider one.
    double half_a = safe_acos(a.cosine), half_b = safe_acos(b.cosine);
    double apart = safe_acos(vec3_dot(a.axis, b.axis));
    if (apart + half_a <= half_b) {
        return b;
    }
    double half = 0.5 * (half_a + apart + half_b), turn = half - half_b;
    Vec3 across = vec3_madd(a.axis, -vec3_dot(a.axis, b.axis), b.axis);
    double length = vec3_length(across);
    if (half >= SAMPLING_PI || !(length > 1e-12)) {
        return (Cone){b.axis, -1};
    }
    Vec3 axis = vec3_madd(vec3_scale(b.axis, program_fold(OP_COS, turn, 0, 0)),
                          program_fold(OP_SIN, turn, 0, 0) / length, across);
    return (Cone){vec3_normalize(axis), program_fold(OP_COS, half, 0, 0)};
}

static LightBounds join(const LightBounds *a, const LightBounds *b) {
    if (!(a->power > 0) || !(b->power > 0)) {
        return a->power > 0 ? *a : *b;
    }
    Cone cone = cone_join((Cone){a->axis, a->cos_o}, (Cone){b->axis, b->cos_o});
    return (LightBounds){
        .lo = vec3(fmin(a->lo.x, b->lo.x), fmin(a->lo.y, b->lo.y), fmin(a->lo.z, b->lo.z)),
        .hi = vec3(fmax(a->hi.x, b->hi.x), fmax(a->hi.y, b->hi.y), fmax(a->hi.z, b->hi.z)),
        .axis = cone.axis,
        .cos_o = cone.cosine,
        .cos_e = fmin(a->cos_e, b->cos_e),
        .two_sided = a->two_sided || b->two_sided,
        .power = a->power + b->power};
}

// ---- Building

typedef struct {
    const LightBounds *lights;
    uint32_t *order; // of those that are drawn
    LightTree *tree;
} Build;

static double component(Vec3 v, int axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static double middle(const LightBounds *b, int axis) {
    return 0.5 * (component(b->lo, axis) + component(b->hi, axis));
}

// The measure of orientation: the solid angle of directions in which a cone of normals emits,
// weighted by the cosine beyond it (Conty Estevez and Kulla, equation 1).
static double orientation(const LightBounds *b) {
    double o = safe_acos(b->cos_o), w = fmin(o + safe_acos(b->cos_e), SAMPLING_PI);
    double sine = safe_sqrt(1 - b->cos_o * b->cos_o);
    return 2 * SAMPLING_PI * (1 - b->cos_o) +
           SAMPLING_PI / 2 *
               (2 * w * sine - program_fold(OP_COS, o - 2 * w, 0, 0) - 2 * o * sine + b->cos_o);
}

static double cost(const LightBounds *b, double stretch) {
    if (!(b->power > 0)) {
        return 0;
    }
    Vec3 d = vec3_sub(b->hi, b->lo);
    double area = 2 * (d.x * d.y + d.y * d.z + d.z * d.x);
    // Points and lines have a measure too, or all ways of cutting them would be alike.
    area += 1e-6 * vec3_dot(d, d);
    return b->power * orientation(b) * stretch * area;
}

typedef struct {
    int axis, bin;
    double cost;
} Cut;

static int bin_of(const LightBounds *b, int axis, double lo, double width) {
    int bin = (int)(BINS * ((middle(b, axis) - lo) / width));
    return bin < 0 ? 0 : bin < BINS ? bin : BINS - 1;
}

// The cheapest cut along one axis.
static void try_axis(const Build *build, uint32_t first, uint32_t n, int axis, double lo,
                     double width, double stretch, Cut *best) {
    LightBounds bins[BINS] = {{.power = 0}}, left[BINS];
    for (uint32_t i = first; i < first + n; i++) {
        const LightBounds *b = &build->lights[build->order[i]];
        LightBounds *bin = &bins[bin_of(b, axis, lo, width)];
        *bin = join(bin, b);
    }
    left[0] = bins[0];
    for (int k = 1; k < BINS; k++) {
        left[k] = join(&left[k - 1], &bins[k]);
    }
    LightBounds right = bins[BINS - 1];
    for (int k = BINS - 2; k >= 0; k--) {
        double both = cost(&left[k], stretch) + cost(&right, stretch);
        if (left[k].power > 0 && right.power > 0 && both < best->cost) {
            *best = (Cut){axis, k, both};
        }
        right = join(&right, &bins[k]);
    }
}

// Puts what goes to the first child in front; returns how many they are.
static uint32_t split(Build *build, uint32_t first, uint32_t n) {
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    double longest = 0;
    for (uint32_t i = first; i < first + n; i++) {
        for (int k = 0; k < 3; k++) {
            double x = middle(&build->lights[build->order[i]], k);
            lo[k] = fmin(lo[k], x);
            hi[k] = fmax(hi[k], x);
        }
    }
    for (int k = 0; k < 3; k++) {
        longest = fmax(longest, hi[k] - lo[k]);
    }
    Cut best = {-1, 0, INFINITY};
    for (int k = 0; k < 3; k++) {
        if (hi[k] > lo[k] && isfinite(hi[k] - lo[k])) {
            double stretch = longest / (hi[k] - lo[k]); // thin boxes are no good
            try_axis(build, first, n, k, lo[k], hi[k] - lo[k], stretch, &best);
        }
    }
    if (best.axis < 0) {
        return n / 2;
    }
    uint32_t front = first;
    for (uint32_t i = first; i < first + n; i++) {
        uint32_t light = build->order[i];
        int k = best.axis;
        if (bin_of(&build->lights[light], k, lo[k], hi[k] - lo[k]) <= best.bin) {
            build->order[i] = build->order[front];
            build->order[front++] = light;
        }
    }
    return front - first;
}

static void fill_node(Node *node, const LightBounds *b) {
    const double lo[3] = {b->lo.x, b->lo.y, b->lo.z}, hi[3] = {b->hi.x, b->hi.y, b->hi.z};
    const double axis[3] = {b->axis.x, b->axis.y, b->axis.z};
    for (int k = 0; k < 3; k++) {
        node->lo[k] = nextafterf((float)lo[k], -INFINITY);
        node->hi[k] = nextafterf((float)hi[k], INFINITY);
        node->axis[k] = (float)axis[k];
    }
    node->cos_o = (float)b->cos_o;
    node->cos_e = (float)b->cos_e;
    node->power = (float)b->power;
    node->two_sided = b->two_sided;
}

static LightBounds build_node(Build *build, uint32_t first, uint32_t n, uint32_t parent) {
    LightTree *tree = build->tree;
    uint32_t at = tree->n_nodes++;
    Node *node = &tree->nodes[at];
    *node = (Node){.second = NONE, .parent = parent, .light = NONE};
    LightBounds bounds;
    if (n == 1) {
        node->light = build->order[first];
        tree->leaf[node->light] = at;
        bounds = build->lights[node->light];
    } else {
        uint32_t n_first = split(build, first, n);
        LightBounds a = build_node(build, first, n_first, at);
        node->second = tree->n_nodes;
        LightBounds b = build_node(build, first + n_first, n - n_first, at);
        bounds = join(&a, &b);
    }
    fill_node(node, &bounds);
    return bounds;
}

// Powers are scaled by their sum, so that floats hold the largest and keep the smallest above 0.
LightTree *light_tree_build(Arena *arena, const LightBounds *lights, uint32_t n) {
    LightTree *tree = ARENA_NEW(arena, LightTree);
    LightBounds *scaled = ARENA_ARRAY(arena, n, LightBounds);
    Build build = {scaled, ARENA_ARRAY(arena, n, uint32_t), tree};
    uint32_t n_drawn = 0;
    double sum = 0;
    tree->n = n;
    tree->leaf = ARENA_ARRAY(arena, n, uint32_t);
    for (uint32_t i = 0; i < n; i++) {
        sum += lights[i].power > 0 && isfinite(lights[i].power) ? lights[i].power : 0;
    }
    for (uint32_t i = 0; i < n; i++) {
        const LightBounds *b = &lights[i];
        tree->leaf[i] = NONE;
        scaled[i] = *b;
        if (b->power > 0 && isfinite(b->power) && vec3_is_finite(b->lo) && vec3_is_finite(b->hi)) {
            scaled[i].power = fmax(b->power / sum, 1e-20);
            build.order[n_drawn++] = i;
        }
    }
    if (n_drawn == 0) {
        return NULL;
    }
    tree->nodes = ARENA_ARRAY(arena, 2 * (size_t)n_drawn - 1, Node);
    build_node(&build, 0, n_drawn, NONE);
    return tree;
}

// ---- Drawing

// cos(max(0, a - b)), for angles given by their cosines.
static double cos_less(double cos_a, double cos_b) {
    if (cos_a > cos_b) {
        return 1;
    }
    double sines = safe_sqrt(1 - cos_a * cos_a) * safe_sqrt(1 - cos_b * cos_b);
    return cos_a * cos_b + sines;
}

static double importance(const Node *node, Vec3 from, Vec3 normal) {
    Vec3 lo = vec3(node->lo[0], node->lo[1], node->lo[2]);
    Vec3 hi = vec3(node->hi[0], node->hi[1], node->hi[2]);
    Vec3 towards = vec3_sub(vec3_scale(vec3_add(lo, hi), 0.5), from);
    Vec3 extent = vec3_sub(hi, lo);
    double d2 = vec3_dot(towards, towards), r2 = 0.25 * vec3_dot(extent, extent);
    if (!(d2 > r2)) { // within the ball around the box anything may be anywhere
        return node->power / (r2 > 0 ? r2 : 1e-30);
    }
    Vec3 dir = vec3_scale(towards, 1 / sqrt(d2));
    double cos_b = sqrt(1 - r2 / d2); // half the angle under which the ball appears
    // How far from the nearest normal the point is seen at least.
    double cos_w = -(node->axis[0] * dir.x + node->axis[1] * dir.y + node->axis[2] * dir.z);
    cos_w = node->two_sided ? fabs(cos_w) : cos_w;
    double cos_out = cos_less(cos_less(cos_w, node->cos_o), cos_b);
    double sent = cos_out > node->cos_e ? fmax(cos_out, LEAST) : LEAST;
    double got = 1;
    if (vec3_dot(normal, normal) > 0) {
        got = fmax(cos_less(vec3_dot(normal, dir), cos_b), LEAST);
    }
    return node->power * sent * got / d2;
}

// Of the first child of an inner node.
static double first_share(const LightTree *tree, uint32_t at, Vec3 from, Vec3 normal) {
    double a = importance(&tree->nodes[at + 1], from, normal);
    double b = importance(&tree->nodes[tree->nodes[at].second], from, normal);
    double share = a / (a + b);
    // Overflow and underflow must not make lights impossible.
    const double least = 1e-6;
    return share >= least ? share <= 1 - least ? share : 1 - least : share > 0 ? least : 0.5;
}

uint32_t light_tree_sample(const LightTree *tree, Vec3 from, Vec3 normal, double u,
                           double *probability) {
    uint32_t at = 0;
    *probability = 1;
    while (tree->nodes[at].second != NONE) {
        double share = first_share(tree, at, from, normal);
        if (u < share) {
            u /= share;
            *probability *= share;
            at++;
        } else {
            u = (u - share) / (1 - share);
            *probability *= 1 - share;
            at = tree->nodes[at].second;
        }
    }
    return tree->nodes[at].light;
}

double light_tree_probability(const LightTree *tree, Vec3 from, Vec3 normal, uint32_t light) {
    uint32_t at = tree->leaf[light];
    if (at == NONE) {
        return 0;
    }
    // From the leaf up, and multiplied in another order than light_tree_sample's: the last bits
    // differ.
    double probability = 1;
    while (tree->nodes[at].parent != NONE) {
        uint32_t parent = tree->nodes[at].parent;
        double share = first_share(tree, parent, from, normal);
        probability *= at == parent + 1 ? share : 1 - share;
        at = parent;
    }
    return probability;
}

// ---- Rays

static bool meets_box(const Node *node, Vec3 origin, Vec3 dir, double tmax) {
    const double o[3] = {origin.x, origin.y, origin.z}, d[3] = {dir.x, dir.y, dir.z};
    double t0 = 0, t1 = tmax;
    for (int k = 0; k < 3; k++) {
        double a = (node->lo[k] - o[k]) / d[k], b = (node->hi[k] - o[k]) / d[k];
        if (a <= b) {
            t0 = fmax(t0, a);
            t1 = fmin(t1, b);
        } else if (b < a) {
            t0 = fmax(t0, b);
            t1 = fmin(t1, a);
        }
    }
    return t0 <= t1;
}

static void visit_node(const LightTree *tree, uint32_t at, Vec3 origin, Vec3 dir, double tmax,
                       LightVisitor *visit, void *context) {
    const Node *node = &tree->nodes[at];
    while (meets_box(node, origin, dir, tmax)) {
        if (node->second == NONE) {
            visit(context, node->light);
            return;
        }
        visit_node(tree, (uint32_t)(node - tree->nodes) + 1, origin, dir, tmax, visit, context);
        node = &tree->nodes[node->second];
    }
}

void light_tree_visit(const LightTree *tree, Vec3 origin, Vec3 dir, double tmax,
                      LightVisitor *visit, void *context) {
    visit_node(tree, 0, origin, dir, tmax, visit, context);
}
