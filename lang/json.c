// SPDX-License-Identifier: Apache-2.0
// Values of JSON.
#include "lang/json.h"

#include <math.h>
#include <string.h>

#include "lang/utf8.h"

void json_string(FILE *out, const char *text) {
    const char *end = text + strlen(text);
    unsigned size;
    fputc('"', out);
    for (; text < end; text += size) {
        uint32_t c = utf8_decode(text, end, &size);
        if (c == '"' || c == '\\') {
            fprintf(out, "\\%c", (int)c);
        } else if (utf8_steers(c) || c == UTF8_BAD) {
            fprintf(out, "\\u%04x", c);
        } else {
            fwrite(text, 1, size, out);
        }
    }
    fputc('"', out);
}

void json_number(FILE *out, double value) {
    if (isfinite(value)) {
        fprintf(out, "%.17g", value);
    } else {
        fputs("null", out);
    }
}
