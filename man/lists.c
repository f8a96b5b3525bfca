// SPDX-License-Identifier: Apache-2.0
// Prints one of the manuals' lists as mdoc, from the tables of lang/: see man/update.
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

// A line of text: what roff would take for a command or an escape is made harmless.
static void print_text(const char *text, const char *end) {
    fputs(*text == '.' || *text == '\'' ? "\\&" : "", stdout);
    for (; *text; text++) {
        fputs(*text == '\\' ? "\\e" : (char[]){*text, 0}, stdout);
    }
    fputs(end, stdout);
}

// "render the frames" as a sentence, "Render the frames."; each sentence on a line of its own.
static void print_sentence(const char *text) {
    char sentence[400];
    snprintf(sentence, sizeof sentence, "%s", text);
    if (sentence[0] >= 'a' && sentence[0] <= 'z') {
        sentence[0] = (char)(sentence[0] - 'a' + 'A');
    }
    char *rest = sentence;
    for (char *stop; (stop = strstr(rest, ". ")); rest = stop + 2) {
        *stop = 0;
        print_text(rest, ".\n");
    }
    size_t n = strlen(rest);
    print_text(rest, n && rest[n - 1] == '.' ? "\n" : ".\n");
}

static void list_commands(void) {
    puts(".Bl -tag -width Ds");
#define COMMAND(id, name, operands, least, most, help)                                             \
    printf(".It Cm %s Ar %s\n", name, operands);                                                   \
    print_sentence(help);
#include "lang/commands.def"
#undef COMMAND
    puts(".El");
}

typedef enum {
#define COMMAND(id, ...) INDEX_##id,
#include "lang/commands.def"
#undef COMMAND
    N_COMMANDS
} CommandIndex;

enum {
#define COMMAND(id, ...) ON_##id = 1 << INDEX_##id,
#include "lang/commands.def"
#undef COMMAND
    ON_SCENE = ON_RENDER | ON_CHECK,
    ON_LOAD = ON_SCENE | ON_INFO | ON_EVAL | ON_MESH | ON_DEPENDS,
    ON_ALL = (1 << N_COMMANDS) - 1,
    SETS_PICTURE = 1 << N_COMMANDS
};

static void print_argument(const char *argument, bool is_choice) {
    if (!is_choice) {
        printf(" Ar %s", argument);
        return;
    }
    for (const char *c = argument; *c; c += strspn(c, "|")) {
        int length = (int)strcspn(c, "|");
        printf("%s Cm %.*s", c == argument ? "" : " |", length, c);
        c += length;
    }
}

static void print_commands_of(unsigned commands) {
    if (commands == ON_ALL) {
        return;
    }
    const char *before = "Taken by\n.Cm ";
#define COMMAND(id, name, ...)                                                                     \
    if (commands & ON_##id) {                                                                      \
        printf("%s%s", before, name);                                                              \
        before = " ,\n.Cm ";                                                                       \
    }
#include "lang/commands.def"
#undef COMMAND
    puts(" .");
}

static void print_option(char letter, const char *name, const char *argument, const char *kind,
                         const char *fallback, unsigned commands, const char *help) {
    bool is_choice = !strcmp(kind, "CHOICE");
    printf(".It");
    if (letter) {
        printf(" Fl %c", letter);
        if (argument) {
            print_argument(argument, is_choice);
        }
    }
    if (name) {
        printf("%s Fl -%s", letter ? " ," : "", name);
        if (argument) {
            printf(" Ns = Ns");
            print_argument(argument, is_choice);
        }
    }
    putchar('\n');
    print_sentence(help);
    if (fallback) {
        printf("The default is\n.Cm %s .\n", fallback);
    }
    print_commands_of(commands);
}

// Channels stand in a file as they are written here.
static void list_layers(void) {
    puts(".Bl -tag -width Ds");
#define LAYER(id, name, channels, help)                                                            \
    printf(".It Cm %s\n", name);                                                                   \
    print_sentence(help);                                                                          \
    puts("Channels: " channels ".");
#include "render/layers.def"
#undef LAYER
    puts(".El");
}

static void list_options(void) {
    puts(".Bl -tag -width Ds");
#define OPTION(id, letter, name, argument, kind, least, most, fallback, commands, help)            \
    print_option(letter, name, argument, #kind, fallback, commands, help);
#include "lang/options.def"
#undef OPTION
    puts(".El");
}

static void list_warnings(void) {
    puts(".Bl -tag -width Ds");
#define WARNING(id, name, help)                                                                    \
    printf(".It Cm %s\n", name);                                                                   \
    print_sentence(help);
#include "lang/warnings.def"
#undef WARNING
    puts(".El");
}

// A word of one of the tables, as people would say it.
typedef struct {
    const char *id, *text;
} Phrase;

static const char *phrase_of(const Phrase *phrases, const char *id) {
    while (phrases->id && strcmp(id, phrases->id) != 0) {
        phrases++;
    }
    return phrases->text;
}

static const Phrase dimension_phrases[] = {
    {"DIMENSION_ANGLE", "an angle, in radians"},
    {"DIMENSION_ANGULAR_RATE", "an angle per second, in radians"},
    {"DIMENSION_TIME", "a time, in seconds"},
    {"DIMENSION_LENGTH", "a length, in metres"},
    {"DIMENSION_MASS", "a mass, in kilograms"},
    {"DIMENSION_RATE", "a rate, per second"},
    {"DIMENSION_PIXELS", "a distance, in pixels"},
    {NULL, "a number"},
};

static const Phrase type_phrases[] = {
    {"NUMBER", "a number"},
    {"COUNT", "a whole number"},
    {"ANGLE", "an angle"},
    {"BOOL", "true or false"},
    {"STRING", "a string"},
    {"STRINGS", "a string or a list of strings"},
    {"VEC2", "a vector of two"},
    {"VEC3", "a vector"},
    {"COLOR", "a color"},
    {"RANGE", "a range"},
    {"MATERIAL", "a material"},
    {"FUNCTION", "a function"},
    {"LIST", "a list"},
    {"NUMBER_OR_LIST", "a number or a list of them"},
    {"WORD", "a word"},
    {"WORD_OR_NUMBER", "a word or a number"},
    {"WORD_OR_FUNCTION", "a word or a function"},
    {NULL, "a value"},
};

static void print_unit(const char *text, const char *dimension, double factor) {
    if (!*text) {
        return;
    }
    printf(".It Cm %s\n%s: ", text, phrase_of(dimension_phrases, dimension));
    if (factor == 0) {
        puts("one frame period");
    } else {
        printf("%.10g\n", factor);
    }
}

static void list_units(void) {
    puts(".Bl -tag -width Ds");
#define UNIT(id, text, dimension, factor) print_unit(text, #dimension, factor);
#include "lang/units.def"
#undef UNIT
    puts(".El");
}

typedef struct {
    const char *id, *name, *variables, *status, *help;
} Node;

typedef struct {
    const char *node, *name, *type, *when, *text, *low, *status, *names, *help;
} Property;

#define NODE(id, name, class, variables, status, help) {#id, name, variables, #status, help},
#define PROPERTY(...)
static const Node nodes[] = {
#include "lang/schema.def"
};
#undef NODE
#undef PROPERTY

#define NODE(...)
#define PROPERTY(node, id, name, type, dimension, when, text, low, high, status, names, help)      \
    {#node, name, #type, #when, text, #low, #status, names, help},
static const Property properties[] = {
#include "lang/schema.def"
};
#undef NODE
#undef PROPERTY

enum {
    N_NODES = sizeof nodes / sizeof *nodes,
    N_PROPERTIES = sizeof properties / sizeof *properties
};

static bool is_ready(const char *status) {
    return !strcmp(status, "READY");
}

static void print_property(const Property *property) {
    printf(".It Va %s", property->name);
    if (*property->text) {
        fputs(" No = Ql \"", stdout);
        for (const char *c = property->text; *c; c++) {
            fputs(*c == '"' ? "\\(dq" : (char[]){*c, 0}, stdout);
        }
        putchar('"');
    }
    putchar('\n');
    char what[300];
    const char *names = property->names;
    const char *of = !*names                               ? ""
                     : !strcmp(property->type, "FUNCTION") ? " of some of "
                                                           : ", one of ";
    snprintf(what, sizeof what, "%s%s%s%s%s: %s", phrase_of(type_phrases, property->type), of,
             names, !strcmp(property->low, "POSITIVE") ? " of more than 0" : "",
             !strcmp(property->when, "MOVES") ? ", may move" : "", property->help);
    print_sentence(what);
}

static void print_later(const char *node) {
    const char *before = ".Pp\nNot supported yet:\n.Va ";
    bool is_any = false;
    for (int i = 0; i < N_PROPERTIES; i++) {
        if (!strcmp(properties[i].node, node) && !is_ready(properties[i].status)) {
            printf("%s%s", before, properties[i].name);
            before = " ,\n.Va ";
            is_any = true;
        }
    }
    fputs(is_any ? " .\n" : "", stdout);
}

static void print_node(const Node *node) {
    printf(".Ss %s\n", node->name);
    print_sentence(node->help);
    if (*node->variables) {
        printf("Within its block\n.Va %s\nare known.\n", node->variables);
    }
    bool is_open = false;
    for (int i = 0; i < N_PROPERTIES; i++) {
        const Property *property = &properties[i];
        if (strcmp(property->node, node->id) != 0 || !is_ready(property->status)) {
            continue;
        }
        fputs(is_open ? "" : ".Bl -tag -width Ds\n", stdout);
        is_open = true;
        print_property(property);
    }
    fputs(is_open ? ".El\n" : "", stdout);
    print_later(node->id);
}

static void print_later_node(const Node *node) {
    printf(".It Ic %s\n", node->name);
    print_sentence(node->help);
    const char *before = "Takes\n.Va ";
    for (int i = 0; i < N_PROPERTIES; i++) {
        if (!strcmp(properties[i].node, node->id)) {
            printf("%s%s", before, properties[i].name);
            before = " ,\n.Va ";
        }
    }
    puts(" .");
}

static void list_nodes(void) {
    for (int i = 0; i < N_NODES; i++) {
        if (is_ready(nodes[i].status)) {
            print_node(&nodes[i]);
        }
    }
    bool is_any = false;
    for (int i = 0; i < N_NODES; i++) {
        if (!is_ready(nodes[i].status)) {
            fputs(is_any ? "" : ".Ss Not supported yet\n.Bl -tag -width Ds\n", stdout);
            print_later_node(&nodes[i]);
            is_any = true;
        }
    }
    fputs(is_any ? ".El\n" : "", stdout);
}

// mdoc takes a comma for the end of a parameter, unless it is written by its number.
static void print_parameter(const char *text, size_t n) {
    fputs(" \"", stdout);
    for (size_t i = 0; i < n; i++) {
        fputs(text[i] == ',' ? "\\N'44'" : (char[]){text[i], 0}, stdout);
    }
    putchar('"');
}

static void print_function(const char *name, const char *params, const char *result,
                           const char *help) {
    printf(".It Fn %s", name);
    for (const char *c = params; *c;) { // .Fn name "a number" "b number = 1"
        size_t n = strcspn(c, ",<");
        n += c[n] == '<' ? strcspn(c + n, ">") + 1 : 0; // a default with commas in it
        print_parameter(c, n);
        c += n + (c[n] ? 2 : 0);
    }
    char what[400];
    snprintf(what, sizeof what, "%s; gives %s", help, result);
    putchar('\n');
    print_sentence(what);
}

static void list_functions(void) {
    puts(".Bl -tag -width Ds");
#define FUNCTION(id, name, params, result, run, op, help)                                          \
    if (strcmp(#run, "later") != 0) {                                                              \
        print_function(name, params, result, help);                                                \
    }
#include "lang/builtins.def"
#undef FUNCTION
    puts(".El");
    const char *before = ".Pp\nNot supported yet:\n.Fn ";
#define FUNCTION(id, name, params, result, run, op, help)                                          \
    if (strcmp(#run, "later") == 0) {                                                              \
        printf("%s%s", before, name);                                                              \
        before = " ,\n.Fn ";                                                                       \
    }
#include "lang/builtins.def"
#undef FUNCTION
    fputs(*before == ' ' ? " .\n" : "", stdout);
}

static void print_word(const char *name, unsigned n_arguments, const char *help) {
    printf(".It Cm %s", name);
    if (n_arguments) {
        printf(" No (%u values)", n_arguments);
    }
    putchar('\n');
    print_sentence(help);
}

static void list_modes(void) {
    puts(".Bl -tag -width Ds");
#define MODE(id, name, n_arguments, help) print_word(name, n_arguments, help);
#include "lang/keys.def"
#undef MODE
    puts(".El");
}

static void list_ends(void) {
    puts(".Bl -tag -width Ds");
#define END(id, name, help) print_word(name, 0, help);
#include "lang/keys.def"
#undef END
    puts(".El");
}

static void list_words(void) {
    puts(".Bl -tag -width Ds");
#define WORD(word, answer)                                                                         \
    printf(".It Ic %s\n", word);                                                                   \
    print_sentence(answer);
#include "lang/words.def"
#undef WORD
    puts(".El");
}

int main(int argc, char **argv) {
    static const struct {
        const char *name;
        void (*print)(void);
    } lists[] = {
        {"commands", list_commands}, {"options", list_options}, {"warnings", list_warnings},
        {"units", list_units},       {"nodes", list_nodes},     {"functions", list_functions},
        {"modes", list_modes},       {"ends", list_ends},       {"words", list_words},
        {"layers", list_layers},
    };
    for (size_t i = 0; argc == 2 && i < sizeof lists / sizeof *lists; i++) {
        if (!strcmp(argv[1], lists[i].name)) {
            lists[i].print();
            return 0;
        }
    }
    fprintf(stderr, "lists: there is no list '%s'\n", argc == 2 ? argv[1] : "");
    return 2;
}
