// SPDX-License-Identifier: Apache-2.0
// Comes before each file of the program that is built for fuzzing: there are no files but those
// that the input holds (fuzz_files.c), what is printed is kept, and memory that is not given back
// is seen at the end of the very execution.
#ifndef TESTS_FUZZ_FUZZ_REDIRECT_H
#define TESTS_FUZZ_FUZZ_REDIRECT_H

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

extern FILE *fuzz_reports;

char *fuzz_realpath(const char *path, char *to);
int fuzz_stat(const char *path, struct stat *about);
FILE *fuzz_fopen(const char *path, const char *mode);
int fuzz_fclose(FILE *file);
DIR *fuzz_opendir(const char *path);
struct dirent *fuzz_readdir(DIR *dir);
int fuzz_closedir(DIR *dir);
void *fuzz_malloc(size_t size);
void *fuzz_calloc(size_t n, size_t size);
void *fuzz_realloc(void *memory, size_t size);
void fuzz_free(void *memory);

#ifndef FUZZ_NO_REDIRECT
#define realpath          fuzz_realpath
#define stat(path, about) fuzz_stat(path, about)
#define fopen             fuzz_fopen
#define fclose            fuzz_fclose
#define opendir           fuzz_opendir
#define readdir           fuzz_readdir
#define closedir          fuzz_closedir
#define malloc            fuzz_malloc
#define calloc            fuzz_calloc
#define realloc           fuzz_realloc
#define free              fuzz_free
#undef stderr
#define stderr fuzz_reports
#endif

#endif
