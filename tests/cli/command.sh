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
    for command in render check info eval mesh fmt depends compare help; do
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
    printf '#!/bin/sh\ncase $1 in info|compare|check|eval|mesh|fmt|depends|help) exec "%s" "$@" ;; esac\n' "$ST4" >bin/st4
    printf 'exec "%s" "$@" -s 2 --size 32x32 -q\n' "$ST4" >>bin/st4
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

test_manual_first_scene_renders() {
    sed -n '/^\.Bd -literal/,/^\.Ed/p; /^\.Ed/q' "$ROOT/man/st4.5" | sed '/^\./d' >first.st4
    expect 0 "$ST4" first.st4 -s 1 --size 16x9 -f 3
    [ -s first.exr ] || fail 'no first.exr'
}

test_scene_from_standard_input() {
    echo 'sphere { translate <4*t, 0, 0> }' | "$ST4" - -s 1 --size 16x16 -o ball.exr -q || fail "$?"
    [ -s ball.exr ] || fail 'no ball.exr'
}
