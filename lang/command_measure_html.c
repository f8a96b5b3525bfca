// SPDX-License-Identifier: Apache-2.0
// st4 measure: the report, one file with its plots in it, to be read without a network.
#include "lang/command_measure.h"

#include <math.h>
#include <string.h>

// In pixels.
enum { LEFT = 70, RIGHT = 30, TOP = 20, BOTTOM = 50, WIDTH = 860, HEIGHT = 470, ROW = 22 };
enum { NAMES = 330 }; // width of the settings' column beside bars

static const double SMALLEST = 1e-4; // errors below count as that on logarithmic axes

typedef enum { GROUP_SAMPLES, GROUP_ACCUMULATE, GROUP_TOLERANCE, GROUP_STRUCTURE, GROUPS } Group;

// Colors that the color-blind can tell apart (Okabe and Ito, 2008).
static const struct {
    const char *color, *name;
} groups[GROUPS] = {
    {"#0072B2", "samples per pixel alone"},
    {"#E69F00", "accumulated subframes"},
    {"#009E73", "tolerance of motion"},
    {"#CC79A7", "structure, kappa, leaf size, kernels"},
};

static const char STYLE[] =
    "<style>body{font:16px/1.5 system-ui,sans-serif;max-width:900px;margin:2em auto;padding:0 1em;"
    "color:#222}h1{font-size:1.6em}h2{margin-top:2em;font-size:1.25em}p{max-width:75ch}"
    "table{border-collapse:collapse;font-size:14px;width:100%}td,th{padding:3px 8px;text-align:"
    "right;border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}"
    "code{background:#f4f4f4;padding:1px 4px;border-radius:3px}svg{max-width:100%;height:auto}"
    "svg text{font:12px system-ui,sans-serif;fill:#333}.key{display:inline-block;width:11px;"
    "height:11px;border-radius:6px;margin:0 5px 0 14px}tr.front td{background:#f2f8ff}"
    "tr.default td{font-weight:bold}.best td:nth-child(2),.best "
    "th:nth-child(2){text-align:left}.wide{overflow-x:auto}</style>\n";

// ---- Text

static void put_escaped(FILE *out, const char *text) {
    for (; *text; text++) {
        switch (*text) {
        case '<':
            fputs("&lt;", out);
            break;
        case '>':
            fputs("&gt;", out);
            break;
        case '&':
            fputs("&amp;", out);
            break;
        default:
            fputc(*text, out);
        }
    }
}

static Group group_of(const MeasurePoint *p) {
    const MeasureSetting *s = &p->setting;
    if (s->subframes) {
        return GROUP_ACCUMULATE;
    }
    if (s->tolerance > 0) {
        return GROUP_TOLERANCE;
    }
    return s->accel || s->cpu || s->kappa > 0 || s->leaf_size ? GROUP_STRUCTURE : GROUP_SAMPLES;
}

static void put_key(FILE *out, const char *color, const char *name) {
    fprintf(out, "<span class=key style='background:%s'></span>%s", color, name);
}

static void put_tooltip(FILE *out, const MeasurePoint *p) {
    fputs("<title>", out);
    put_escaped(out, p->arguments);
    fprintf(out, "\n%.3g s, error %.3g %%, noise %.3g %%, bias %s%.3g %%</title>",
            measure_seconds(p), 100 * p->error, 100 * p->noise, p->bias > 0 ? "" : "below ",
            100 * (p->bias > 0 ? p->bias : p->bias_most));
}

// ---- Logarithmic axes

typedef struct {
    double lo, hi;       // exponents of ten
    double from, length; // on paper; a negative length goes up
} Axis;

static double on_axis(Axis axis, double value) {
    double share = (log10(fmax(value, SMALLEST)) - axis.lo) / (axis.hi - axis.lo);
    return axis.from + axis.length * share;
}

static Axis make_axis(double least, double most, double from, double length) {
    double lo = log10(fmax(least, SMALLEST)), hi = log10(fmax(most, SMALLEST));
    double margin = 0.05 * (hi - lo) + 0.05;
    return (Axis){lo - margin, hi + margin, from, length};
}

// 1, 2, 5 of each decade where they lie within.
static bool next_tick(Axis axis, int *i, double *value) {
    static const double of_decade[] = {1, 2, 5};
    for (; *i < 200; (*i)++) {
        double v = of_decade[*i % 3] * pow(10, *i / 3 - 10);
        if (log10(v) >= axis.lo && log10(v) <= axis.hi) {
            *value = v;
            (*i)++;
            return true;
        }
    }
    return false;
}

static void put_grid_x(FILE *out, Axis x, double top, double bottom, double unit) {
    double value;
    for (int i = 0; next_tick(x, &i, &value);) {
        double at = on_axis(x, value);
        fprintf(out,
                "<line x1='%.1f' x2='%.1f' y1='%.1f' y2='%.1f' stroke='#e4e4e4'/>"
                "<text x='%.1f' y='%.1f' text-anchor='middle'>%g</text>\n",
                at, at, top, bottom, at, bottom + 18, value * unit);
    }
}

static void put_grid_y(FILE *out, Axis y, double left, double right, double unit) {
    double value;
    for (int i = 0; next_tick(y, &i, &value);) {
        double at = on_axis(y, value);
        fprintf(out,
                "<line x1='%.1f' x2='%.1f' y1='%.1f' y2='%.1f' stroke='#e4e4e4'/>"
                "<text x='%.1f' y='%.1f' text-anchor='end'>%g</text>\n",
                left, right, at, at, left - 8, at + 4, value * unit);
    }
}

static void find_range(const Measure *measure, double (*of)(const MeasurePoint *), double *least,
                       double *most) {
    *least = INFINITY;
    *most = 0;
    for (size_t i = 0; i < measure->n_points; i++) {
        double v = of(&measure->points[i]);
        *least = fmin(*least, v);
        *most = fmax(*most, v);
    }
}

static double error_of(const MeasurePoint *p) {
    return p->error;
}

static double least_part_of(const MeasurePoint *p) {
    return fmin(p->noise > 0 ? p->noise : p->error, p->bias > 0 ? p->bias : p->bias_most);
}

// ---- Error against seconds

static void put_front(FILE *out, const Measure *measure, Axis x, Axis y) {
    fputs("<polyline fill='none' stroke='#999' stroke-width='2' points='", out);
    for (size_t i = 0; i < measure->n_points; i++) { // by seconds
        const MeasurePoint *p = &measure->points[i];
        if (p->is_on_front) {
            fprintf(out, "%.1f,%.1f ", on_axis(x, measure_seconds(p)), on_axis(y, p->error));
        }
    }
    fputs("'/>\n", out);
}

// Names of points, each where no other stands in its way; else the tooltip has to do.
typedef struct {
    struct {
        double x, y, width;
    } of[64];
    size_t n;
} Labels;

static bool is_free(const Labels *labels, double x, double y, double width) {
    for (size_t i = 0; i < labels->n; i++) {
        if (fabs(labels->of[i].y - y) < 14 && x < labels->of[i].x + labels->of[i].width &&
            labels->of[i].x < x + width) {
            return false;
        }
    }
    return labels->n < sizeof labels->of / sizeof labels->of[0];
}

// Above and to the right of the point, else below and to the left.
static void put_label(FILE *out, Labels *labels, double x, double y, const char *text,
                      const char *weight) {
    double width = 6.2 * (double)strlen(text);
    for (int i = 0; i < 2; i++) {
        double left = i ? x - 9 - width : x + 9, base = i ? y + 16 : y - 8;
        bool fits = left > LEFT && left + width < WIDTH && is_free(labels, left, base, width);
        if (fits) {
            labels->of[labels->n].x = left;
            labels->of[labels->n].y = base;
            labels->of[labels->n++].width = width;
            fprintf(out, "<text x='%.1f' y='%.1f' font-weight='%s'>", left, base, weight);
            put_escaped(out, text);
            fputs("</text>\n", out);
            return;
        }
    }
}

static void put_points(FILE *out, const Measure *measure, Axis x, Axis y) {
    Labels labels = {.n = 0};
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        double at = on_axis(x, measure_seconds(p)), up = on_axis(y, p->error);
        fprintf(out,
                "<line x1='%.1f' x2='%.1f' y1='%.1f' y2='%.1f' stroke='%s' opacity='.5'/>"
                "<circle cx='%.1f' cy='%.1f' r='5.5' fill='%s'>",
                on_axis(x, p->least), on_axis(x, p->most), up, up, groups[group_of(p)].color, at,
                up, groups[group_of(p)].color);
        put_tooltip(out, p);
        fputs("</circle>\n", out);
        if (p->is_default) {
            fprintf(out,
                    "<circle cx='%.1f' cy='%.1f' r='10' fill='none' stroke='#222' "
                    "stroke-width='1.5'/>",
                    at, up);
            put_label(out, &labels, at + 3, up - 2, "default", "bold");
        }
    }
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        if (p->is_on_front && !p->is_default) {
            put_label(out, &labels, on_axis(x, measure_seconds(p)), on_axis(y, p->error),
                      p->arguments, "normal");
        }
    }
}

static void put_scatter(FILE *out, const Measure *measure) {
    double least, most, floor_of = measure->reference.noise;
    double right = WIDTH - RIGHT, bottom = HEIGHT - BOTTOM;
    find_range(measure, measure_seconds, &least, &most);
    Axis x = make_axis(least, most, LEFT, right - LEFT);
    find_range(measure, error_of, &least, &most);
    least = floor_of > 0 ? fmin(least, floor_of) : least;
    Axis y = make_axis(least, most, bottom, TOP - bottom);
    fprintf(out,
            "<h2>Error against time</h2><p>Each dot is a setting; lower is closer to the "
            "reference, left is faster. The grey line joins the settings that nothing else "
            "beats in both. Hover over a dot for its numbers; the thin bar is the spread of "
            "its %d runs. Below the dashed line the reference itself is not sure.</p><p>",
            MEASURE_RUNS);
    for (int g = 0; g < GROUPS; g++) {
        put_key(out, groups[g].color, groups[g].name);
    }
    fprintf(out, "</p><svg viewBox='0 0 %d %d' width='%d'>\n", WIDTH, HEIGHT, WIDTH);
    put_grid_x(out, x, TOP, bottom, 1);
    put_grid_y(out, y, LEFT, right, 100);
    if (floor_of > 0) {
        fprintf(out,
                "<line x1='%d' x2='%.1f' y1='%.1f' y2='%.1f' stroke='#a33' "
                "stroke-dasharray='6 4'/><text x='%.1f' y='%.1f' text-anchor='end' fill='#a33'>"
                "noise of the reference</text>",
                LEFT, right, on_axis(y, floor_of), on_axis(y, floor_of), right,
                on_axis(y, floor_of) - 5);
    }
    put_front(out, measure, x, y);
    put_points(out, measure, x, y);
    fprintf(out,
            "<text x='%.0f' y='%d' text-anchor='middle'>seconds of the frame: update, build, "
            "trace</text><text transform='translate(18 %d) rotate(-90)' text-anchor='middle'>"
            "error, %% of the mean brightness</text></svg>\n",
            (LEFT + right) / 2, HEIGHT - 10, HEIGHT / 2 - 15);
}

// ---- What the error is made of

static void put_row_name(FILE *out, const MeasurePoint *p, double y) {
    fprintf(out, "<text x='%d' y='%.1f' text-anchor='end'%s>", NAMES - 10, y + 4,
            p->is_default ? " font-weight='bold'" : "");
    put_escaped(out, p->arguments);
    fputs("</text>\n", out);
}

static void put_parts(FILE *out, const Measure *measure) {
    double least, most, lowest, unused, right = WIDTH - RIGHT;
    double bottom = TOP + ROW * (double)measure->n_points;
    find_range(measure, error_of, &least, &most);
    find_range(measure, least_part_of, &lowest, &unused);
    Axis x = make_axis(fmin(least, lowest), most, NAMES, right - NAMES);
    fputs(
        "<h2>What the error is made of</h2><p>Noise declines with more samples. Bias does not: it "
        "is strobing where subframes are added up, else the error of representing motion "
        "by straight lines between instants, which the tolerance bounds. A "
        "hollow diamond is a bound: no bias was found, it is no larger than that.</p><p>",
        out);
    put_key(out, "#0072B2", "noise");
    put_key(out, "#D55E00", "bias");
    put_key(out, "#bbb", "error, all together");
    fprintf(out, "</p><svg viewBox='0 0 %d %.0f' width='%d'>\n", WIDTH, bottom + BOTTOM, WIDTH);
    put_grid_x(out, x, TOP, bottom, 100);
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        double y = TOP + ROW * ((double)i + 0.5);
        double bias = on_axis(x, p->bias > 0 ? p->bias : p->bias_most);
        put_row_name(out, p, y);
        fprintf(out,
                "<g><line x1='%d' x2='%.1f' y1='%.1f' y2='%.1f' stroke='#bbb' stroke-width='7'/>"
                "<path d='M%.1f %.1fl6 6l6 -6l-6 -6z' fill='%s' stroke='#D55E00'/>"
                "<circle cx='%.1f' cy='%.1f' r='5' fill='#0072B2'/>",
                NAMES, on_axis(x, p->error), y, y, bias - 6, y, p->bias > 0 ? "#D55E00" : "#fff",
                on_axis(x, p->noise), y);
        put_tooltip(out, p);
        fputs("</g>\n", out);
    }
    fprintf(out,
            "<text x='%.0f' y='%.0f' text-anchor='middle'>%% of the mean brightness</text>"
            "</svg>\n",
            (NAMES + right) / 2, bottom + 40);
}

// ---- Where the time goes

static void put_bar(FILE *out, double x, double y, double width, const char *color) {
    fprintf(out, "<rect x='%.1f' y='%.1f' width='%.1f' height='13' fill='%s'/>", x, y - 6.5, width,
            color);
}

static void put_times(FILE *out, const Measure *measure) {
    static const char *const colors[] = {"#56B4E9", "#E69F00", "#999999"};
    double most = 0, right = WIDTH - 110;
    size_t n = 0;
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        bool is_shown = p->setting.spp == 16;
        most = fmax(most, is_shown ? measure_seconds(p) : 0);
        n += is_shown;
    }
    if (n == 0) {
        return;
    }
    fputs("<h2>Where the time goes</h2><p>Settings with 16 samples per pixel. Structures, kappa, "
          "leaf size and kernels change no picture, only these bars and the bytes.</p><p>",
          out);
    put_key(out, colors[0], "update: vertices at the sampled instants");
    put_key(out, colors[1], "build: segments and structure");
    put_key(out, colors[2], "trace");
    double y = TOP;
    fprintf(out, "</p><svg viewBox='0 0 %d %.0f' width='%d'>\n", WIDTH, TOP + ROW * (double)n + 10,
            WIDTH);
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        if (p->setting.spp != 16) {
            continue;
        }
        const double parts[3] = {p->work.update, p->work.build, p->work.trace};
        double x = NAMES;
        put_row_name(out, p, y);
        fputs("<g>", out);
        for (int k = 0; k < 3; k++) {
            double width = parts[k] / most * (right - NAMES);
            put_bar(out, x, y, width, colors[k]);
            x += width;
        }
        put_tooltip(out, p);
        fprintf(out, "</g><text x='%.1f' y='%.1f'>%.3g s, %.3g MB</text>\n", x + 6, y + 4,
                measure_seconds(p), 1e-6 * (p->work.vertex_bytes + p->work.tree_bytes));
        y += ROW;
    }
    fputs("</svg>\n", out);
}

// ---- Tables

static void put_advice(FILE *out, const Measure *measure, const char *goal, MeasureAdvice advice) {
    fprintf(out, "<tr><td>%s</td>", goal);
    if (!advice.base) {
        fputs("<td colspan=4>nothing that was measured comes there</td></tr>\n", out);
        return;
    }
    fputs("<td><code>", out);
    put_escaped(out, measure_command(measure, measure_advice_arguments(measure->arena, &advice)));
    fprintf(out, "</code></td><td>%.3g s</td><td>%.3g %%</td><td>%s</td></tr>\n", advice.seconds,
            100 * advice.error, advice.is_measured ? "measured" : "reckoned");
}

static void put_best(FILE *out, const Measure *measure) {
    fputs("<h2>The best settings</h2><div class=wide><table "
          "class=best><tr><th>for</th><th>command</th>"
          "<th>seconds</th><th>error</th><th></th></tr>\n",
          out);
    put_advice(out, measure, "1 % error", measure_for_error(measure, 0.01));
    put_advice(out, measure, "3 % error", measure_for_error(measure, 0.03));
    put_advice(out, measure, "10 % error", measure_for_error(measure, 0.10));
    put_advice(out, measure, "10 s a frame", measure_for_seconds(measure, 10));
    put_advice(out, measure, "1 min a frame", measure_for_seconds(measure, 60));
    put_advice(out, measure, "10 min a frame", measure_for_seconds(measure, 600));
    fprintf(out,
            "</table></div><p>For this frame at %ux%u pixels: tracing takes longer with more "
            "pixels, in proportion. <em>Reckoned</em> means with another number of samples than "
            "was measured, by how time and noise went with samples here.</p>\n",
            measure->width, measure->height);
}

static void put_table(FILE *out, const Measure *measure) {
    fputs(
        "<h2>All that was measured</h2><p>Blue rows are on the front; bold is the default."
        "</p><div class=wide><table><tr><th>settings</th><th>update s</th><th>build s</th>"
        "<th>trace s</th><th>&plusmn; s</th><th>CPU s</th><th>MB</th><th>rays</th><th>error %</th>"
        "<th>noise %</th><th>bias %</th></tr>\n",
        out);
    for (size_t i = 0; i < measure->n_points; i++) {
        const MeasurePoint *p = &measure->points[i];
        const MeasureWork *w = &p->work;
        fprintf(out, "<tr class='%s%s'><td>", p->is_on_front ? "front " : "",
                p->is_default ? "default" : "");
        put_escaped(out, p->arguments);
        fprintf(out,
                "</td><td>%.3f</td><td>%.3f</td><td>%.3f</td><td>%.3f</td><td>%.3f</td>"
                "<td>%.2f</td><td>%.3g</td><td>%.3g</td><td>%.3g</td><td>%s%.3g</td></tr>\n",
                w->update, w->build, w->trace, 0.5 * (p->most - p->least), w->cpu,
                1e-6 * (w->vertex_bytes + w->tree_bytes), w->rays, 100 * p->error, 100 * p->noise,
                p->bias > 0 ? "" : "&lt;", 100 * (p->bias > 0 ? p->bias : p->bias_most));
    }
    fputs("</table></div>\n", out);
}

static void put_head(FILE *out, const Measure *measure) {
    const MeasureReference *r = &measure->reference;
    fputs("<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport "
          "content='width=device-width'><title>What accuracy costs: ",
          out);
    put_escaped(out, measure->scene);
    fprintf(out, "</title>%s<h1>What accuracy costs in ", STYLE);
    put_escaped(out, measure->scene);
    fprintf(out,
            "</h1><p>Frame %lld was rendered at %ux%u pixels on %u threads with %zu settings of "
            "<code>st4 render</code>, each %d times with other noise, and compared with a "
            "reference. The error is the root mean square difference from it, in percent of the "
            "mean brightness; seconds are medians of the frame's work, without loading the scene "
            "and writing the picture.</p><p>",
            (long long)measure->frame, measure->width, measure->height, measure->n_threads,
            measure->n_points, MEASURE_RUNS);
    if (r->spp) {
        fprintf(out,
                "The reference was made with %u samples per pixel, in two halves of "
                "independent noise, and motion held to 0.03 pixels. ",
                r->spp);
    }
    if (r->n == 2) {
        fprintf(out, "By the difference of its halves, its own noise is <b>%.3g %%</b>%s.</p>\n",
                100 * r->noise,
                r->noise > 0.01 ? ": much, so that smaller errors are not known; a larger "
                                  "<code>--budget</code> makes a better one"
                                : "");
    } else {
        fputs("The reference is one picture, which does not tell its own error: its noise counts "
              "as everyone's bias.</p>\n",
              out);
    }
}

void measure_write_html(const Measure *measure, FILE *out) {
    put_head(out, measure);
    put_best(out, measure);
    put_scatter(out, measure);
    put_parts(out, measure);
    put_times(out, measure);
    put_table(out, measure);
    fputs("<p>How it is measured: <code>man st4-measure</code>.</p></html>\n", out);
}
