// SPDX-License-Identifier: Apache-2.0
// The plain implementation of `keys` tables.
#include "tests/keys_plain.h"

#include <math.h>

#include "tests/suite.h"

uint64_t plain_seed;

uint32_t plain_int(uint32_t n) {
    plain_seed = plain_seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(plain_seed >> 33) % n;
}

double plain_real(double lo, double hi) {
    return lo + (hi - lo) * (plain_int(1u << 30) + 0.5) / (1u << 30);
}

static double ease_by_speed(double a, double b, double s) {
    // The area under a trapezoid of height 1, by the midpoint rule on its straight pieces.
    double ends[4] = {0, a, 1 - b, 1}, part = 0, whole = 0;
    for (int piece = 0; piece < 3; piece++) {
        double lo = ends[piece], hi = ends[piece + 1], cut = fmin(fmax(s, lo), hi);
        for (int is_whole = 0; is_whole < 2; is_whole++) {
            double to = is_whole ? hi : cut, middle = (lo + to) / 2;
            double up = a > 0 ? fmin(1, middle / a) : 1,
                   down = b > 0 ? fmin(1, (1 - middle) / b) : 1;
            *(is_whole ? &whole : &part) += (to - lo) * fmin(up, down);
        }
    }
    return part / whole;
}

static long double bezier_axis(double p1, double p2, long double q) {
    long double r = 1 - q;
    return 3 * r * r * q * p1 + 3 * r * q * q * p2 + q * q * q;
}

static double bezier_by_bisection(const double p[4], long double s) {
    long double lo = 0, hi = 1;
    for (int i = 0; i < 80; i++) {
        long double middle = (lo + hi) / 2;
        *(bezier_axis(p[0], p[2], middle) <= s ? &lo : &hi) = middle;
    }
    return (double)bezier_axis(p[1], p[3], lo);
}

// x'' = -w w x - 2 d w x', from rest at 1.
static double spring_by_steps(double frequency, double damping, double seconds) {
    enum { STEPS = 4000 };
    double w = 2 * 3.14159265358979323846 * frequency, h = seconds / STEPS, x = 1, v = 0;
    for (int i = 0; i < STEPS; i++) {
        double kx[4], kv[4], px = x, pv = v;
        for (int k = 0; k < 4; k++) {
            kx[k] = pv;
            kv[k] = -w * w * px - 2 * damping * w * pv;
            double step = k < 2 ? h / 2 : h;
            px = x + step * kx[k];
            pv = v + step * kv[k];
        }
        x += h / 6 * (kx[0] + 2 * kx[1] + 2 * kx[2] + kx[3]);
        v += h / 6 * (kv[0] + 2 * kv[1] + 2 * kv[2] + kv[3]);
    }
    return x;
}

static double plain_progress(const KeysMode *mode, double s, double seconds) {
    const double *a = mode->arguments;
    switch (mode->curve) {
    case KEYS_STEP:
        return 0;
    case KEYS_EASE:
        return 3 * s * s - 2 * s * s * s;
    case KEYS_EASE_IN_OUT:
        return ease_by_speed(a[0], a[1], s);
    case KEYS_BEZIER:
        return bezier_by_bisection(a, s);
    case KEYS_SPRING:
        return 1 - spring_by_steps(a[0], a[1], s * seconds) +
               spring_by_steps(a[0], a[1], seconds) * (3 * s * s - 2 * s * s * s);
    default:
        return s;
    }
}

static bool is_closed(const Plain *p) {
    bool loops = p->before == KEYS_END_LOOP || p->after == KEYS_END_LOOP;
    return p->before == KEYS_END_OFFSET || p->after == KEYS_END_OFFSET ||
           (loops && p->values[0] == p->values[p->n - 1]);
}

static double lerp_at(double t, double t0, double t1, double a, double b) {
    return (a * (t1 - t) + b * (t - t0)) / (t1 - t0);
}

// Barry and Goldman's pyramid over the four keys around the span; missing ones are reflected.
static double plain_smooth(const Plain *p, uint32_t k, double t) {
    uint32_t last = p->n - 1;
    double T[4] = {0, p->times[k], p->times[k + 1], 0},
           v[4] = {0, p->values[k], p->values[k + 1], 0};
    T[0] = T[1] - (T[2] - T[1]);
    v[0] = v[1] - (v[2] - v[1]);
    T[3] = T[2] + (T[2] - T[1]);
    v[3] = v[2] + (v[2] - v[1]);
    if (k > 0 && p->modes[k - 1].curve != KEYS_STEP) {
        T[0] = p->times[k - 1];
        v[0] = p->values[k - 1];
    } else if (k == 0 && is_closed(p) && p->modes[last - 1].curve != KEYS_STEP) {
        T[0] = T[1] - (p->times[last] - p->times[last - 1]);
        v[0] = v[1] - (p->values[last] - p->values[last - 1]);
    }
    if (k + 1 < last && p->modes[k + 1].curve != KEYS_STEP) {
        T[3] = p->times[k + 2];
        v[3] = p->values[k + 2];
    } else if (k + 1 == last && is_closed(p) && p->modes[0].curve != KEYS_STEP) {
        T[3] = T[2] + (p->times[1] - p->times[0]);
        v[3] = v[2] + (p->values[1] - p->values[0]);
    }
    double a[3], b[2];
    for (int i = 0; i < 3; i++) {
        a[i] = lerp_at(t, T[i], T[i + 1], v[i], v[i + 1]);
    }
    for (int i = 0; i < 2; i++) {
        b[i] = lerp_at(t, T[i], T[i + 2], a[i], a[i + 1]);
    }
    return lerp_at(t, T[1], T[2], b[0], b[1]);
}

static double plain_inside(const Plain *p, double t) {
    uint32_t k = 0;
    while (k + 2 < p->n && p->times[k + 1] <= t) {
        k++;
    }
    if (p->modes[k].curve == KEYS_SMOOTH) {
        return plain_smooth(p, k, t);
    }
    double seconds = p->times[k + 1] - p->times[k], s = (t - p->times[k]) / seconds;
    double f = plain_progress(&p->modes[k], s, seconds);
    return p->values[k] + f * (p->values[k + 1] - p->values[k]);
}

// One-sided, inside the table.
static double plain_speed(const Plain *p, bool is_last) {
    double at = p->times[is_last ? p->n - 1 : 0], h = is_last ? -1e-5 : 1e-5;
    double here = is_last && p->modes[p->n - 2].curve == KEYS_STEP
                      ? p->values[p->n - 2]
                      : p->values[is_last ? p->n - 1 : 0];
    return (-3 * here + 4 * plain_inside(p, at + h) - plain_inside(p, at + 2 * h)) / (2 * h);
}

double plain_value(const Plain *p, double t) {
    double first = p->times[0], last = p->times[p->n - 1], length = last - first, cycles;
    if (t >= first && t < last) {
        return plain_inside(p, t);
    }
    bool is_late = t >= last;
    double value = p->values[is_late ? p->n - 1 : 0];
    cycles = floor((t - first) / length);
    switch (is_late ? p->after : p->before) {
    case KEYS_END_HOLD:
        return value;
    case KEYS_END_LINEAR:
        return value + (t - (is_late ? last : first)) * plain_speed(p, is_late);
    case KEYS_END_LOOP:
        return plain_inside(p, t - cycles * length);
    case KEYS_END_OFFSET:
        return plain_inside(p, t - cycles * length) + cycles * (p->values[p->n - 1] - p->values[0]);
    default: {
        double forth = t - cycles * length;
        return plain_inside(p, fmod(fabs(cycles), 2) == 0 ? forth : first + last - forth);
    }
    }
}

static KeysMode random_mode(void) {
    KeysMode m = {.curve = (KeysCurve)plain_int(KEYS_CURVES)};
    double *a = m.arguments;
    switch (m.curve) {
    case KEYS_EASE_IN_OUT:
        a[0] = plain_int(3) ? plain_real(0, 0.6) : 0;
        a[1] = plain_int(3) ? plain_real(0, 0.4) : 0;
        break;
    case KEYS_BEZIER:
        a[0] = plain_real(0.05, 1);
        a[1] = plain_real(-1, 2);
        a[2] = plain_real(0, 0.95);
        a[3] = plain_real(-1, 2);
        break;
    case KEYS_SPRING:
        a[0] = plain_real(0.3, 3);
        a[1] = plain_int(4) ? plain_real(0, 2) : 1;
        break;
    default:
        break;
    }
    return m;
}

Plain plain_random(int round) {
    Plain p = {.n = 2 + plain_int(MAX_KEYS - 2)};
    double t = plain_real(-3, 3);
    KeysMode one = random_mode();
    for (uint32_t k = 0; k < p.n; k++) {
        p.times[k] = t;
        t += plain_real(0.1, 2);
        p.values[k] = plain_real(-2, 2);
        p.modes[k] = round % 3 ? random_mode() : one;
    }
    p.before = (KeysEnd)plain_int(KEYS_ENDS);
    p.after = (KeysEnd)plain_int(KEYS_ENDS);
    if (round % 4 == 0) {
        p.values[p.n - 1] = p.values[0];
    }
    return p;
}

void plain_print(const Plain *p) {
    for (uint32_t k = 0; k < p->n; k++) {
        const double *a = p->modes[k].arguments;
        print_message("%.17g: %.17g %s %.17g %.17g %.17g %.17g\n", p->times[k], p->values[k],
                      keys_curves[p->modes[k].curve].name, a[0], a[1], a[2], a[3]);
    }
    print_message("before %s, after %s\n", keys_ends[p->before].name, keys_ends[p->after].name);
}
