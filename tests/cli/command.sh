# SPDX-License-Identifier: Apache-2.0
# The command itself: start, help, usage errors, manuals.

test_version_is_quick() {
    expect 0 "$ST4" --version
    [[ $out =~ ^st4\ [0-9]+\.[0-9]+ ]] || fail "version: $out"
    local best=1000000 i start
    for i in 1 2 3 4 5 6 7 8 9 10; do
        start=${EPOCHREALTIME/./}
        "$ST4" --version >/dev/null
        i=$((${EPOCHREALTIME/./} - start))
        best=$((i < best ? i : best))
    done
    local most=20000
    [[ $ST4 == *san/* ]] && most=500000
    [ $best -lt $most ] || fail "start-up takes $best us"
}

test_help_names_every_command() {
    local command
    expect 0 "$ST4" help
    for command in render check info eval mesh fmt depends compare merge measure help; do
        has "$out" "  $command "
        [ $command = help ] || "$ST4" help $command | grep -q "^usage: st4 $command" ||
            fail "no help for $command"
        "$ST4" $command --help | cmp -s - <("$ST4" help $command) || fail "$command --help differs"
    done
    expect 2 "$ST4" help rendr
    has "$err" "did you mean 'render'?"
    expect 2 "$ST4"
    has "$err" 'usage: st4'
    "$ST4" help | awk 'length($0) > 80 || / $/ { exit 1 }' || fail 'help is wider than 80 columns'
}

test_usage_errors_have_status_2() {
    echo 'sphere {}' >a.st4
    local args
    while read -r args; do
        # shellcheck disable=SC2086
        expect 2 "$ST4" $args
        [ "$(wc -l <<<"$err")" = 1 ] || fail "more than one line: $err"
        [[ $err == st4:* ]] || fail "message: $err"
    done <<'END'
rendr a.st4
render
render a.st4 b.st4
--frmes 3 a.st4
a.st4 --spp 0
a.st4 --spp x
a.st4 --size 0x0
a.st4 --accel nosuch
a.st4 --cpu nosuch
a.st4 -Wnosuch
a.st4 -f 5-2
a.st4 --progress=x
check a.st4 --stats x
compare a.exr
eval a.st4
eval a.st4 1 --spp 3
mesh a.st4
fmt
fmt a.st4 -w --check
depends a.st4 a.st4
mesh a.st4 -o a.ply --label nosuch
a.st4 --samples 1
a.st4 --samples 0-3
a.st4 --samples 5-3 -o a.st4film
a.st4 --samples 1-3
a.st4 --samples 1-3 -o a.exr
a.st4 --samples 60-65 -o a.st4film
a.st4 -o a.st4film -o a.exr
a.st4 --checkpoint -1
check a.st4 --resume
merge
merge a.st4film
measure -
measure a.st4 --accel kd3
measure a.st4 --ref a.exr --ref b.exr --ref c.exr
END
}

test_manual_knows_every_structure() {
    echo 'sphere {}' >a.st4
    expect 2 "$ST4" a.st4 --accel nosuch
    local name
    for name in $(sed 's/.*none of//; s/,/ /g' <<<"$err"); do
        grep -qx ".It Cm $name" "$ROOT/man/st4.1" || fail "st4.1 does not explain --accel $name"
    done
}

# Runs the lines "$ st4 ..." of standard input in a copy of the examples, with few samples.
run_examples() {
    cp "$ROOT"/examples/*.st4 .
    mkdir bin
    cat >bin/st4 <<END
#!/bin/sh
case \$1 in info|compare|merge|check|eval|mesh|fmt|depends|help) exec "$ST4" "\$@" ;; esac
case "\$*" in *--samples*) exec "$ST4" "\$@" --size 32x32 -q ;; esac
exec "$ST4" "\$@" -s 2 --size 32x32 -q
END
    chmod +x bin/st4
    local line n=0
    while read -r line; do
        PATH=$PWD/bin:$PATH bash -c "$line" >log 2>&1 </dev/null || fail "$line: $(cat log)"
        n=$((n + 1))
    done < <(sed -nE 's/^(\.Dl )?\$ (.*st4 .*)/\2/p')
    [ $n -gt "$1" ] || fail "$n examples"
}

test_manual_examples_run() {
    run_examples 5 <"$ROOT/man/st4.1"
}

# Every display of the reference is a scene: without warnings, and of use to the eye.
test_manual_scenes_render() {
    awk '/^\.Bd -literal/ { n++; is_open = 1; next } /^\.Ed/ { is_open = 0 }
         is_open { gsub(/\\e/, "\\"); sub(/^\\&/, ""); print > (n ".st4") }' "$ROOT/man/st4.5"
    local scene n=0
    for scene in *.st4; do
        expect 0 "$ST4" "$scene" -s 1 --size 16x9 -f 1-2 -o "$scene.####.exr" -Werror
        [ -s "$scene.0002.exr" ] || fail "$scene: no picture"
        expect 0 "$ST4" fmt "$scene"
        n=$((n + 1))
    done
    below 6 $n
}

# What the tables hold and what the language's punctuation is stands in the reference.
test_manual_is_complete() {
    local word n=0
    for word in $(sed -nE 's/^(FUNCTION|KEYWORD|MODE|END|UNIT|PROPERTY|NODE)\(([A-Z_0-9]+, ){1,2}"([a-zA-Z0-9_]+)".*/\3/p' \
        "$ROOT"/lang/{builtins,keywords,keys,units,schema}.def | sort -u); do
        grep -qE "(^|[^a-z_])$word([^a-z_]|$)" "$ROOT/man/st4.5" || fail "st4.5 does not name $word"
        n=$((n + 1))
    done
    below 150 $n
    while read -r word; do
        grep -qF -- "$word" "$ROOT/man/st4.5" || fail "st4.5 does not show $word"
    done < <(sed -nE 's/^TOKEN\([A-Z]+, "(.*)"\)$/\1/p' "$ROOT/lang/tokens.def")
}

# The editors' files know each word of the tables; Vim and a reader of JSON take them, if there are any.
test_editors_know_the_words() {
    local word file
    for file in st4.vim st4.tmLanguage.json; do
        for word in $(sed -nE 's/^(FUNCTION|KEYWORD|MODE|UNIT|PROPERTY)\(([A-Z_0-9]+, ){1,2}"([a-zA-Z0-9_]+)".*/\3/p' \
            "$ROOT"/lang/{builtins,keywords,keys,units,schema}.def | sort -u); do
            grep -qE "[|(]$word(\\\\)?[|)]" "$ROOT/stdlib/editors/$file" || fail "$file does not know $word"
        done
    done
    if command -v python3 >/dev/null; then
        python3 -m json.tool "$ROOT/stdlib/editors/st4.tmLanguage.json" >/dev/null || fail 'no JSON'
    fi
    command -v vim >/dev/null || return 0
    printf 'let a = 2turn\nsphere Ball { radius = 3cm  scale sin(a) } // x\n' >a.st4
    local place
    for place in 1,1:st4Statement 1,9:st4Number 2,1:st4Node 2,8:st4Name 2,15:st4Property \
        2,24:st4Number 2,29:st4Statement 2,35:st4Function 2,44:st4Comment; do
        echo "call add(g:out, synIDattr(synID(${place%:*}, 1), 'name') . ' ${place#*:} ${place%:*}')"
    done >places.vim
    vim -u NONE -N -es -c 'let g:out = []' -c 'syntax on' -c "source $ROOT/stdlib/editors/st4.vim" \
        -c 'source places.vim' -c 'call writefile(g:out, "names")' -c 'qa!' a.st4 </dev/null
    [ "$(wc -l <names)" = 9 ] || fail 'Vim does not read the file'
    awk '$1 != $2 { print; bad = 1 } END { exit bad }' names || fail 'another color'
}

test_scene_from_standard_input() {
    local scene='let place = <4*t, 0, 0>  sphere { radius = 0.5  translate place }' args
    echo "$scene" | "$ST4" - -s 1 --size 16x16 -o ball.exr -q || fail "$?"
    [ -s ball.exr ] || fail 'no ball.exr'
    while read -r args; do
        # shellcheck disable=SC2086
        echo "$scene" | "$ST4" $args >log 2>&1 || fail "st4 $args: $(cat log)"
    done <<'END'
render - -s 1 --size 16x16 -o ball.exr
check -
info -
eval - place
mesh - -o ball.ply
fmt -
fmt -w -
fmt --check -
depends -
END
    [ -s ball.ply ] || fail 'no ball.ply'
    echo 'sphere { raduis = 1 }' | "$ST4" check - --color never 2>log && fail 'no error'
    has "$(cat log)" '-:1:10: error: sphere has no property'
}
