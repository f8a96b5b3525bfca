// SPDX-License-Identifier: Apache-2.0
// Curves for the eye.
#include "render/display.h"

#include <math.h>

double display_linear_from_srgb(double v) {
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

void display_init(Display *display, ViewKind view, double exposure) {
    display->view = view;
    display->gain = exp2(exposure);
    display->step[0] = 0;
    for (int i = 1; i < 256; i++) {
        double v = (i - 0.5) / 255;
        display->step[i] = view == VIEW_RAW ? v : display_linear_from_srgb(v);
    }
}

// The nearest byte on the curve.
static uint8_t byte_of(const double step[256], double v) {
    int low = 0, high = 256;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (v >= step[middle]) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return (uint8_t)low;
}

void display_neutral(const double color[3], double out[3]) {
    const double start = 0.8 - 0.04, desaturation = 0.15;
    double least = fmin(color[0], fmin(color[1], color[2]));
    double offset = least < 0.08 ? least - 6.25 * least * least : 0.04;
    for (int c = 0; c < 3; c++) {
        out[c] = color[c] - offset;
    }
    double peak = fmax(out[0], fmax(out[1], out[2]));
    if (!(peak >= start)) {
        return;
    }
    double room = 1 - start, new_peak = 1 - room * room / (peak + room - start);
    double white = 1 - 1 / (desaturation * (peak - new_peak) + 1);
    for (int c = 0; c < 3; c++) {
        out[c] = out[c] * (new_peak / peak) * (1 - white) + new_peak * white;
    }
}

void display_color(const Display *display, const double color[3], uint8_t bytes[3]) {
    double shown[3];
    for (int c = 0; c < 3; c++) {
        double v = color[c] * display->gain;
        shown[c] = v > 0 ? fmin(v, 1e30) : 0;
    }
    if (display->view == VIEW_NEUTRAL) {
        display_neutral(shown, shown);
    }
    for (int c = 0; c < 3; c++) {
        bytes[c] = byte_of(display->step, shown[c]);
    }
}
