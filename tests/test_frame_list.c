// SPDX-License-Identifier: Apache-2.0
// Lists of frames: what they mean, and what is refused.
#include "lang/frame_list.h"
#include "tests/suite.h"

#include <string.h>

static void frame_list_spells_out(void **state) {
    (void)state;
    static const struct {
        const char *text;
        int64_t film_last;
        uint32_t n;
        int64_t frames[8];
    } cases[] = {
        {"7", 3, 1, {7}},
        {"1-3", 48, 3, {1, 2, 3}},
        {"3,1-2,2", 48, 3, {1, 2, 3}},
        {"1-7x3", 48, 3, {1, 4, 7}},
        {"1-8x3", 48, 3, {1, 4, 7}},
        {"44x2", 48, 3, {44, 46, 48}},
        {"44-x2", 49, 3, {44, 46, 48}},
        {"46-", 48, 3, {46, 47, 48}},
        {"-2-1", 48, 4, {-2, -1, 0, 1}},
        {"-2--1", 48, 2, {-2, -1}},
        {"-4x3", 0, 2, {-4, -1}},
        {"1-2,60,47x1", 48, 5, {1, 2, 47, 48, 60}},
        {"49-", 48, 0, {0}},
        {"0-10000000", 1, 0, {0}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Arena arena = {0};
        FrameList list;
        char message[128] = "";
        uint32_t n = 99;
        if (!frame_list_parse(&arena, cases[i].text, &list, message, sizeof message)) {
            fail_msg("%s: %s", cases[i].text, message);
        }
        const int64_t *frames = frame_list_frames(&arena, &list, cases[i].film_last, &n);
        if (n != cases[i].n || (n && memcmp(frames, cases[i].frames, n * sizeof *frames) != 0)) {
            fail_msg("%s: %u frames", cases[i].text, n);
        }
        arena_free(&arena);
    }
}

static void frame_list_refuses(void **state) {
    (void)state;
    static const char *const bad[] = {
        "",    ",",      "1,",  ",1",  "a",    "1-2-3", "3-1",         "1-2x0", "1x",
        "1x-", "1-2x-1", "1 2", " 1 ", "1..3", "+1",    "99999999999", "1,,2",  "0x10,",
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        Arena arena = {0};
        FrameList list;
        char message[128] = "";
        if (frame_list_parse(&arena, bad[i], &list, message, sizeof message)) {
            fail_msg("'%s' was taken", bad[i]);
        }
        assert_true(strlen(message) > 0);
        arena_free(&arena);
    }
}

static const struct CMUnitTest tests[] = {
    cmocka_unit_test(frame_list_spells_out),
    cmocka_unit_test(frame_list_refuses),
};

SUITE(frame_list, tests)
