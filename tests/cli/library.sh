# SPDX-License-Identifier: Apache-2.0
# The standard library: it is found, and each of its definitions has an example that renders.

# Splits a file into lines "NAME<tab>EXAMPLE", the example that stands above each definition.
definitions() {
    awk '/^\/\/ Example: / { example = substr($0, 13) }
         match($0, /^(fn|def|let) [A-Za-z_0-9]+/) {
             split(substr($0, RSTART, RLENGTH), word, " "); print word[2] "\t" example; example = ""
         }' "$1"
}

test_library_definitions_render() {
    local file name example n=0
    for file in "$ROOT"/stdlib/*.st4; do
        while IFS=$'\t' read -r name example; do
            [[ $example == *".$name"* ]] || fail "${file##*/}: $name has no example above it"
            printf 'include "%s" as %s\n%s\n' "${file##*/}" "$(basename "$file" .st4)" "$example" >a.st4
            # Lights and cameras want something to show.
            grep -qE 'plane|sphere|box|shapes' <<<"$example" || echo 'sphere {}' >>a.st4
            # Every definition is used, so a warning is about the library or its example.
            expect 0 "$ST4" a.st4 --size 24x18 -s 1 -f 5 -o a.exr --shutter 180deg
            lacks "$err" 'warning:'
            n=$((n + 1))
        done < <(definitions "$file")
    done
    [ $n -gt 60 ] || fail "$n definitions"
}

test_library_files_say_how_they_are_used() {
    local file name
    for file in "$ROOT"/stdlib/*.st4; do
        name=$(basename "$file" .st4)
        sed '/^$/q' "$file" | grep -q "^//   include \"$name.st4\" as $name\$" ||
            fail "$name.st4 does not open with its usage"
        { sed -n '/^[^/]/q; /^$/q; s/^\/\/   //p' "$file"; } >usage.st4
        expect 0 "$ST4" check usage.st4 -Wno-unused-let
    done
}

# Beside the script, then -I, then the library: the nearest wins.
test_library_comes_last() {
    mkdir own
    echo 'let amber = <1, 2, 3>' >own/colors.st4
    printf 'include "colors.st4" as colors\nprint colors.amber\nsphere {}\n' >a.st4
    expect 0 "$ST4" check a.st4
    lacks "$out$err" '<1, 2, 3>'
    expect 0 "$ST4" check a.st4 -I own
    has "$out$err" '<1, 2, 3>'
    echo 'let amber = <4, 5, 6>' >colors.st4
    expect 0 "$ST4" check a.st4 -I own
    has "$out$err" '<4, 5, 6>'
}

# A script of the same name as a file of the library can use it; one that names only itself goes round.
test_a_script_includes_the_next_of_its_name() {
    printf 'include "colors.st4" as colors\nprint colors.amber\nsphere {}\n' >colors.st4
    expect 0 "$ST4" check colors.st4
    echo 'include "own.st4"' >own.st4
    expect 1 "$ST4" check own.st4
    has "$err" "'own.st4' includes itself: own.st4 -> own.st4"
}

# Installed, the program lies in bin and the library in share.
test_library_is_found_where_it_is_installed() {
    mkdir -p usr/bin usr/share/st4
    cp "$ST4" usr/bin/st4
    printf 'include "colors.st4" as colors\nsphere { material = matte(colors.amber) }\n' >a.st4
    expect 3 usr/bin/st4 check a.st4
    has "$err" 'standard library'
    cp -r "$ROOT/stdlib" usr/share/st4/stdlib
    expect 0 usr/bin/st4 check a.st4
}
