// SPDX-License-Identifier: Apache-2.0
// Output files are there whole or not at all.
#include "render/outfile.h"
#include "tests/suite.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct {
    char folder[64], path[128], link_path[128], message[256];
    OutFile file;
} Fixture;

static int set_up(void **state) {
    Fixture *f = calloc(1, sizeof *f);
    *state = f;
    snprintf(f->folder, sizeof f->folder, "/tmp/st4-outfile-XXXXXX");
    if (!mkdtemp(f->folder)) {
        return -1;
    }
    snprintf(f->path, sizeof f->path, "%s/a", f->folder);
    snprintf(f->link_path, sizeof f->link_path, "%s/link", f->folder);
    return 0;
}

static int tear_down(void **state) {
    Fixture *f = *state;
    unlink(f->path);
    unlink(f->link_path);
    int left = rmdir(f->folder);
    free(f);
    return left;
}

static void write_over(Fixture *f, const char *path, const char *text) {
    assert_true(outfile_open(&f->file, path, f->message, sizeof f->message));
    assert_int_equal(write(f->file.fd, text, strlen(text)), strlen(text));
}

static void assert_content(const Fixture *f, const char *expected) {
    char text[64] = "";
    FILE *file = fopen(f->path, "rb");
    if (!expected) {
        assert_null(file);
        return;
    }
    assert_non_null(file);
    assert_int_equal(fread(text, 1, sizeof text - 1, file), strlen(expected));
    fclose(file);
    assert_string_equal(text, expected);
}

static int count_files(const char *folder) {
    int n = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));) {
        n += e->d_name[0] != '.' || strlen(e->d_name) > 2;
    }
    closedir(d);
    return n;
}

static void outfile_appears_when_whole(void **state) {
    Fixture *f = *state;
    for (int i = 0; i < 2; i++) {
        const char *before = i ? "0" : NULL;
        write_over(f, f->path, i ? "1" : "0");
        assert_content(f, before);
        assert_true(outfile_commit(&f->file, f->message, sizeof f->message));
        assert_content(f, i ? "1" : "0");
        assert_int_equal(count_files(f->folder), 1);
    }
}

static void outfile_leaves_no_trace(void **state) {
    Fixture *f = *state;
    write_over(f, f->path, "old");
    assert_true(outfile_commit(&f->file, f->message, sizeof f->message));
    write_over(f, f->path, "new");
    outfile_abandon(&f->file);
    assert_content(f, "old");
    assert_int_equal(count_files(f->folder), 1);
}

// Two at once do not meet in one temporary file; the last one committed stays.
static void outfile_shares_nothing(void **state) {
    Fixture *f = *state;
    OutFile first;
    write_over(f, f->path, "first");
    first = f->file;
    write_over(f, f->path, "second");
    assert_true(outfile_commit(&f->file, f->message, sizeof f->message));
    assert_content(f, "second");
    assert_true(outfile_commit(&first, f->message, sizeof f->message));
    assert_content(f, "first");
    assert_int_equal(count_files(f->folder), 1);
}

static void outfile_follows_links(void **state) {
    Fixture *f = *state;
    struct stat s;
    assert_int_equal(symlink("a", f->link_path), 0);
    for (int i = 0; i < 2; i++) { // dangling at first
        write_over(f, f->link_path, i ? "again" : "once");
        assert_true(outfile_commit(&f->file, f->message, sizeof f->message));
        assert_int_equal(lstat(f->link_path, &s), 0);
        assert_true(S_ISLNK(s.st_mode));
        assert_content(f, i ? "again" : "once");
    }
    unlink(f->link_path);
    assert_int_equal(symlink("link", f->link_path), 0);
    assert_false(outfile_open(&f->file, f->link_path, f->message, sizeof f->message));
    assert_string_equal(f->message, "cannot create: Too many levels of symbolic links");
}

static void outfile_takes_long_names(void **state) {
    Fixture *f = *state;
    char path[400];
    snprintf(path, sizeof path, "%s/%0255d", f->folder, 7);
    write_over(f, path, "x");
    assert_true(outfile_commit(&f->file, f->message, sizeof f->message));
    assert_int_equal(unlink(path), 0);
    snprintf(path, sizeof path, "%s/%0256d", f->folder, 7);
    assert_false(outfile_open(&f->file, path, f->message, sizeof f->message));
    assert_string_equal(f->message, "cannot create: File name too long");
    assert_int_equal(count_files(f->folder), 0);
}

#define OUTFILE_TEST(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)

static const struct CMUnitTest tests[] = {
    OUTFILE_TEST(outfile_appears_when_whole), OUTFILE_TEST(outfile_leaves_no_trace),
    OUTFILE_TEST(outfile_shares_nothing),     OUTFILE_TEST(outfile_follows_links),
    OUTFILE_TEST(outfile_takes_long_names),
};

SUITE(outfile, tests)
