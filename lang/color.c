// SPDX-License-Identifier: Apache-2.0
// Colours as graphs.
#include "lang/color.h"

#include <string.h>

#include "lang/functions.h"

static Ref op1(Dag *dag, Op op, Ref a) {
    return dag_op(dag, op, a, REF_NONE, REF_NONE);
}

static Ref op2(Dag *dag, Op op, Ref a, Ref b) {
    return dag_op(dag, op, a, b, REF_NONE);
}

static Ref number(Dag *dag, double x) {
    return dag_const(dag, x);
}

// --- sRGB ---

static int digit(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c = (char)(c | 32);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

bool color_parse(const char *text, double rgb[3]) {
    text += *text == '#';
    size_t n = strlen(text);
    if (n != 3 && n != 6) {
        return false;
    }
    for (size_t i = 0; i < 3; i++) {
        int high = digit(text[i * n / 3]), low = digit(text[i * n / 3 + n / 6]);
        if (high < 0 || low < 0) {
            return false;
        }
        rgb[i] = (high * 16 + low) / 255.0;
    }
    return true;
}

Ref color_linear(Dag *dag, Ref encoded) {
    Ref size = op1(dag, OP_ABS, encoded);
    Ref is_small = op2(dag, OP_LE, size, number(dag, 0.04045));
    Ref base = op2(dag, OP_DIV, op2(dag, OP_ADD, size, number(dag, 0.055)), number(dag, 1.055));
    Ref curve = op2(dag, OP_POW, base, number(dag, 2.4));
    curve = op2(dag, OP_MUL, curve, op1(dag, OP_SIGN, encoded));
    return dag_op(dag, OP_SELECT, is_small, op2(dag, OP_DIV, encoded, number(dag, 12.92)), curve);
}

Ref3 color_srgb(Dag *dag, Ref3 encoded) {
    return ref3(color_linear(dag, encoded.x), color_linear(dag, encoded.y),
                color_linear(dag, encoded.z));
}

// value (1 - saturation clamp(min(k, 4 - k), 0, 1)), k = (n + 6 hue) mod 6.
static Ref hsv_channel(Dag *dag, int n, Ref hue, Ref saturation, Ref value) {
    Ref k = op2(dag, OP_ADD, number(dag, n), op2(dag, OP_MUL, hue, number(dag, 6)));
    k = op2(dag, OP_MOD, k, number(dag, 6));
    Ref ramp = op2(dag, OP_MIN, k, op2(dag, OP_SUB, number(dag, 4), k));
    ramp = functions_clamp(dag, ramp, number(dag, 0), number(dag, 1));
    Ref darker = op2(dag, OP_MUL, op2(dag, OP_MUL, value, saturation), ramp);
    return color_linear(dag, op2(dag, OP_SUB, value, darker));
}

Ref3 color_hsv(Dag *dag, Ref hue, Ref saturation, Ref value) {
    return ref3(hsv_channel(dag, 5, hue, saturation, value),
                hsv_channel(dag, 3, hue, saturation, value),
                hsv_channel(dag, 1, hue, saturation, value));
}

// --- Black bodies ---

// c[0] + c[1] x + c[2] x^2 + c[3] x^3
static Ref cubic(Dag *dag, Ref x, const double c[4]) {
    Ref sum = number(dag, c[3]);
    for (int k = 2; k >= 0; k--) {
        sum = op2(dag, OP_ADD, op2(dag, OP_MUL, sum, x), number(dag, c[k]));
    }
    return sum;
}

// In 1000/T: below and above 4000 K.
static const double kim_x[2][4] = {{0.179910, 0.8776956, -0.2343589, -0.2661239},
                                   {0.240390, 0.2226347, 2.1070379, -3.0258469}};
// In x: below 2222 K, below 4000 K, above.
static const double kim_y[3][4] = {{-0.20219683, 2.18555832, -1.34811020, -1.1063814},
                                   {-0.16748867, 2.09137015, -1.37418593, -0.9549476},
                                   {-0.37001483, 3.75112997, -5.87338670, 3.0817580}};

// XYZ to linear RGB, Rec. 709 primaries, white D65.
static const double rgb_of_xyz[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                        {-0.9692660, 1.8760108, 0.0415560},
                                        {0.0556434, -0.2040259, 1.0572252}};

static Ref3 rgb_of_chromaticity(Dag *dag, Ref x, Ref y) {
    Ref z = op2(dag, OP_SUB, op2(dag, OP_SUB, number(dag, 1), x), y);
    Ref3 xyz = ref3(op2(dag, OP_DIV, x, y), number(dag, 1), op2(dag, OP_DIV, z, y));
    Ref out[3];
    for (int i = 0; i < 3; i++) {
        const double *r = rgb_of_xyz[i];
        Ref sum = spatial_dot(dag, spatial_const(dag, r[0], r[1], r[2]), xyz);
        out[i] = op2(dag, OP_MAX, sum, number(dag, 0));
    }
    return ref3(out[0], out[1], out[2]);
}

Ref3 color_kelvin(Dag *dag, Ref kelvin) {
    Ref t = functions_clamp(dag, kelvin, number(dag, 1667), number(dag, 25000));
    Ref inverse = op2(dag, OP_DIV, number(dag, 1000), t);
    Ref is_cool = op2(dag, OP_LT, t, number(dag, 4000));
    Ref is_coolest = op2(dag, OP_LT, t, number(dag, 2222));
    Ref x = dag_op(dag, OP_SELECT, is_cool, cubic(dag, inverse, kim_x[0]),
                   cubic(dag, inverse, kim_x[1]));
    Ref y = dag_op(dag, OP_SELECT, is_coolest, cubic(dag, x, kim_y[0]), cubic(dag, x, kim_y[1]));
    y = dag_op(dag, OP_SELECT, is_cool, y, cubic(dag, x, kim_y[2]));
    Ref3 rgb = rgb_of_chromaticity(dag, x, y);
    Ref most = op2(dag, OP_MAX, rgb.x, op2(dag, OP_MAX, rgb.y, rgb.z));
    return ref3(op2(dag, OP_DIV, rgb.x, most), op2(dag, OP_DIV, rgb.y, most),
                op2(dag, OP_DIV, rgb.z, most));
}
