// SPDX-License-Identifier: Apache-2.0
// Prints what editors need to color scenes, from the tables of lang/: see stdlib/editors/update.
#include <stdio.h>
#include <string.h>

// Words of one color. In Vim they are a group, in a TextMate grammar a scope.
typedef struct {
    const char *vim, *link; // group, and the common group that it looks like
    const char *scope;
    const char *const *words;
} Class;

static const char *const keywords[] = {
#define KEYWORD(id, text) text,
#include "lang/keywords.def"
#undef KEYWORD
    NULL};

// A node's name; that of the properties which many nodes share is no word.
#define NODE(id, name, class, variables, status, help) NAME_##class(name),
#define NAME_SETTING(name)                             name
#define NAME_CAMERA(name)                              name
#define NAME_LIGHT(name)                               name
#define NAME_SHAPE(name)                               name
#define NAME_GROUP(name)                               name
#define NAME_COMMON(name)                              ""
#define PROPERTY(...)
static const char *const nodes[] = {
#include "lang/schema.def"
    NULL};
#undef NODE
#undef PROPERTY

static const char *const properties[] = {
#define NODE(...)
#define PROPERTY(node, id, name, ...) name,
#include "lang/schema.def"
#undef NODE
#undef PROPERTY
    NULL};

static const char *const functions[] = {
#define FUNCTION(id, name, ...) name,
#include "lang/builtins.def"
#undef FUNCTION
    NULL};

static const char *const modes[] = {
#define MODE(id, name, ...) name,
#define END(id, name, ...)  name,
#include "lang/keys.def"
#undef MODE
#undef END
    "before", "after", NULL};

static const char *const units[] = {
#define UNIT(id, text, dimension, factor) text,
#include "lang/units.def"
#undef UNIT
    NULL};

static const char *const constants[] = {"true", "false", "pi", "x", "y", "z", "t", "T", NULL};

static const Class classes[] = {
    {"st4Statement", "Keyword", "keyword.control.st4", keywords},
    {"st4Node", "Type", "entity.name.type.st4", nodes},
    {"st4Property", "Identifier", "support.variable.property.st4", properties},
    {"st4Function", "Function", "support.function.st4", functions},
    {"st4Mode", "PreProc", "support.constant.st4", modes},
    {"st4Constant", "Constant", "constant.language.st4", constants},
};

enum { N_CLASSES = sizeof classes / sizeof *classes };

// Whether words[i] is worth printing: not empty, and for the first time.
static int is_new(const char *const *words, size_t i) {
    for (size_t k = 0; k < i; k++) {
        if (strcmp(words[k], words[i]) == 0) {
            return 0;
        }
    }
    return words[i][0] != '\0';
}

static void print_words(const char *const *words, const char *separator) {
    const char *before = "";
    for (size_t i = 0; words[i]; i++) {
        if (is_new(words, i)) {
            printf("%s%s", before, words[i]);
            before = separator;
        }
    }
}

// A word colors by what stands around it: a function before its bracket, a property before '=', a
// node before its block; keywords and constants anywhere.
static const char *look_behind(const Class *class, int is_vim) {
    static const char *const vim[] = {"",
                                      "\\ze\\%(\\s\\+\\w\\+\\)\\=\\%(\\[[^]]*\\]\\)\\=\\s*{",
                                      "\\ze\\s*=[^=]",
                                      "\\ze\\s*(",
                                      "",
                                      ""};
    static const char *const textmate[] = {"",
                                           "(?=(\\\\s+\\\\w+)?(\\\\[[^\\\\]]*\\\\])?\\\\s*\\\\{)",
                                           "(?=\\\\s*=[^=])",
                                           "(?=\\\\s*\\\\()",
                                           "",
                                           ""};
    return is_vim ? vim[class - classes] : textmate[class - classes];
}

static void print_vim(void) {
    puts("\" SPDX-License-Identifier: Apache-2.0\n"
         "\" Vim syntax of st4 scenes. Written by stdlib/editors/update; do not edit.\n"
         "\" Put it into ~/.vim/syntax, and into ~/.vim/ftdetect/st4.vim the line\n"
         "\"   autocmd BufNewFile,BufRead *.st4 setfiletype st4\n"
         "if exists('b:current_syntax')\n  finish\nendif\n"
         "syntax case match\n"
         "syntax match st4Name /\\<\\h\\w*\\>/");
    for (size_t i = N_CLASSES; i-- > 0;) {
        printf("syntax match %s /\\<\\%%(", classes[i].vim);
        print_words(classes[i].words, "\\|");
        printf("\\)\\>%s/\n", look_behind(&classes[i], 1));
    }
    fputs("syntax match st4Number /\\%(\\<\\d[0-9_]*\\%(\\.\\d\\+\\)\\=\\|\\.\\d\\+\\)"
          "\\%([eE][-+]\\=\\d\\+\\)\\=\\%(",
          stdout);
    print_words(units, "\\|");
    puts("\\)\\=\\>/\n"
         "syntax match st4Escape /\\\\[\"\\\\nt]/ contained\n"
         "syntax region st4String start=/\"/ skip=/\\\\./ end=/\"/ oneline contains=st4Escape\n"
         "syntax match st4Comment /\\/\\/.*/\n"
         "syntax region st4Comment start=/\\/\\*/ end=/\\*\\//\n"
         "syntax match st4Comment /\\%^#!.*/\n"
         "highlight default link st4Number Number\n"
         "highlight default link st4String String\n"
         "highlight default link st4Escape SpecialChar\n"
         "highlight default link st4Comment Comment");
    for (size_t i = 0; i < N_CLASSES; i++) {
        printf("highlight default link %s %s\n", classes[i].vim, classes[i].link);
    }
    puts("setlocal commentstring=//\\ %s\nlet b:current_syntax = 'st4'");
}

static void print_textmate(void) {
    puts("{\n"
         "  \"information_for_contributors\": \"Written by stdlib/editors/update; do not edit.\",\n"
         "  \"name\": \"st4\",\n"
         "  \"scopeName\": \"source.st4\",\n"
         "  \"fileTypes\": [\"st4\"],\n"
         "  \"firstLineMatch\": \"^#!.*\\\\bst4\\\\b\",\n"
         "  \"patterns\": [\n"
         "    {\"name\": \"comment.line.double-slash.st4\", \"match\": \"//.*$\"},\n"
         "    {\"name\": \"comment.line.shebang.st4\", \"match\": \"\\\\A#!.*$\"},\n"
         "    {\"name\": \"comment.block.st4\", \"begin\": \"/\\\\*\", \"end\": \"\\\\*/\"},\n"
         "    {\"name\": \"string.quoted.double.st4\", \"begin\": \"\\\"\", \"end\": \"\\\"|$\","
         " \"patterns\": [\n"
         "      {\"name\": \"constant.character.escape.st4\", \"match\": "
         "\"\\\\\\\\[\\\"\\\\\\\\nt]\"}\n"
         "    ]},");
    fputs("    {\"name\": \"constant.numeric.st4\", \"match\": "
          "\"(\\\\b\\\\d[0-9_]*(\\\\.\\\\d+)?|\\\\.\\\\d+)([eE][-+]?\\\\d+)?(",
          stdout);
    print_words(units, "|");
    puts(")?\\\\b\"},");
    for (size_t i = 0; i < N_CLASSES; i++) {
        printf("    {\"name\": \"%s\", \"match\": \"\\\\b(", classes[i].scope);
        print_words(classes[i].words, "|");
        printf(")\\\\b%s\"}%s\n", look_behind(&classes[i], 0), i + 1 < N_CLASSES ? "," : "");
    }
    puts("  ]\n}");
}

int main(int argc, char **argv) {
    if (argc == 2 && strcmp(argv[1], "st4.vim") == 0) {
        print_vim();
    } else if (argc == 2 && strcmp(argv[1], "st4.tmLanguage.json") == 0) {
        print_textmate();
    } else {
        fputs("lists: st4.vim or st4.tmLanguage.json is expected\n", stderr);
        return 2;
    }
    return 0;
}
