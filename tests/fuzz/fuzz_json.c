// SPDX-License-Identifier: Apache-2.0
// A recognizer of JSON, of just the depth that diagnostics have.
#include "tests/fuzz/fuzz_json.h"

#include <string.h>

enum { MAX_NESTING = 8 };

typedef struct {
    const char *at, *end;
} Text;

static bool take(Text *t, char c) {
    if (t->at < t->end && *t->at == c) {
        t->at++;
        return true;
    }
    return false;
}

static bool take_word(Text *t, const char *word) {
    size_t n = strlen(word);
    if ((size_t)(t->end - t->at) < n || memcmp(t->at, word, n) != 0) {
        return false;
    }
    t->at += n;
    return true;
}

static bool is_hex(char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

static bool take_escape(Text *t) {
    if (t->at == t->end) {
        return false;
    }
    char c = *t->at++;
    if (c != 'u') {
        return c && strchr("\"\\/bfnrt", c);
    }
    for (int i = 0; i < 4; i++) {
        if (t->at == t->end || !is_hex(*t->at++)) {
            return false;
        }
    }
    return true;
}

// One character of UTF-8, of more than one byte.
static bool take_wide(Text *t) {
    unsigned char first = (unsigned char)*t->at++;
    int n = first >= 0xf0 ? 3 : first >= 0xe0 ? 2 : 1;
    if (first < 0xc2 || first > 0xf4) {
        return false;
    }
    unsigned code = first & (0x3fu >> n);
    for (int i = 0; i < n; i++) {
        if (t->at == t->end || ((unsigned char)*t->at & 0xc0) != 0x80) {
            return false;
        }
        code = code << 6 | ((unsigned char)*t->at++ & 0x3f);
    }
    return code >= (n == 3   ? 0x10000u
                    : n == 2 ? 0x800u
                             : 0x80u) &&
           code <= 0x10ffff && !(code >= 0xd800 && code <= 0xdfff);
}

bool fuzz_json_utf8(const char *text, size_t size) {
    Text t = {text, text + size};
    while (t.at < t.end) {
        if ((unsigned char)*t.at < 0x80) {
            t.at++;
        } else if (!take_wide(&t)) {
            return false;
        }
    }
    return true;
}

static bool take_string(Text *t) {
    if (!take(t, '"')) {
        return false;
    }
    while (t->at < t->end && *t->at != '"') {
        unsigned char c = (unsigned char)*t->at;
        if (c < 0x20) {
            return false;
        }
        if (c >= 0x80) {
            if (!take_wide(t)) {
                return false;
            }
        } else if (t->at++, c == '\\' && !take_escape(t)) {
            return false;
        }
    }
    return take(t, '"');
}

static bool take_value(Text *t, int nesting);

// What stands between two brackets, with commas.
static bool take_members(Text *t, char close, int nesting) {
    if (take(t, close)) {
        return true;
    }
    do {
        if (close == '}' && !(take_string(t) && take(t, ':'))) {
            return false;
        }
        if (!take_value(t, nesting + 1)) {
            return false;
        }
    } while (take(t, ','));
    return take(t, close);
}

// Numbers of diagnostics are whole.
static bool take_number(Text *t) {
    const char *start = t->at;
    while (t->at < t->end && *t->at >= '0' && *t->at <= '9') {
        t->at++;
    }
    return t->at > start && !(*start == '0' && t->at - start > 1);
}

static bool take_value(Text *t, int nesting) {
    if (nesting > MAX_NESTING) {
        return false;
    }
    if (take(t, '{')) {
        return take_members(t, '}', nesting);
    }
    if (take(t, '[')) {
        return take_members(t, ']', nesting);
    }
    if (t->at < t->end && *t->at == '"') {
        return take_string(t);
    }
    return take_word(t, "null") || take_word(t, "true") || take_word(t, "false") || take_number(t);
}

bool fuzz_json_lines(const char *text, size_t size) {
    Text t = {text, text + size};
    while (t.at < t.end) {
        if (*t.at != '{' || !take_value(&t, 0) || !take(&t, '\n')) {
            return false;
        }
    }
    return true;
}
