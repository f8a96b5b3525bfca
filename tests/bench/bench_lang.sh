#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Deforming against a loop in C, loading a million shapes against POV-Ray: make bench-lang.
#
# CPU seconds (of user and system), so that other work on the machine counts little; medians of
# `rounds` runs, least and most in brackets. spheres=N rounds=N change the size.
set -eu
st4=${ST4:-./st4} bench=${BENCH:-build/release/bench-lang}
n=${spheres:-1000000} rounds=${rounds:-3}
work=$(mktemp -d "${TMPDIR:-/tmp}/bench-lang.XXXXXX")
trap 'rm -rf "$work"' EXIT
failed=0

"$bench" deform || failed=1

# The same spheres for both: a statement each.
awk -v n="$n" -v st4="$work/many.st4" -v pov="$work/many.pov" 'BEGIN {
    srand(7)
    print "film { size = <160, 120> }\ncamera { from = <0, 0, 160> to = <0, 0, 0> }" > st4
    print "#version 3.7;\nglobal_settings { assumed_gamma 1 }" > pov
    print "camera { location <0, 0, -160> look_at 0 }\nlight_source { <100, 200, -300> rgb 1 }" > pov
    for (i = 0; i < n; i++) {
        at = sprintf("<%.4f, %.4f, %.4f>", 100 * rand() - 50, 100 * rand() - 50, 100 * rand() - 50)
        r = sprintf("%.4f", 0.05 + 0.35 * rand())
        c = sprintf("<%.3f, %.3f, %.3f>", rand(), rand(), rand())
        print "sphere { center = " at " radius = " r " material = matte(" c ") }" > st4
        print "sphere { " at ", " r " pigment { rgb " c " } }" > pov
    }
}'
# Five kinds in any order, a third of them without a material, some of them turned.
awk -v n="$n" 'function at() {
        return sprintf("<%.4f, %.4f, %.4f>", 100 * rand() - 50, 100 * rand() - 50, 100 * rand() - 50)
    }
    function r() { return sprintf("%.4f", 0.05 + 0.35 * rand()) }
    function color() {
        return rand() < 0.33 ? "" \
            : sprintf(" material = matte(<%.3f, %.3f, %.3f>)", rand(), rand(), rand())
    }
    BEGIN {
        srand(8)
        print "film { size = <160, 120> }\ncamera { from = <0, 0, 160> to = <0, 0, 0> }"
        for (i = 0; i < n; i++) {
            k = int(5 * rand())
            if (k == 0)
                print "sphere { center = " at() " radius = " r() color() " }"
            else if (k == 1)
                print "box { size = <" r() ", " r() ", " r() "> rotate y, " r() "turn translate " \
                    at() color() " }"
            else if (k == 2)
                print "cylinder { from = " at() " to = " at() " radius = " r() color() " }"
            else if (k == 3)
                print "cone { from = " at() " to = " at() " radius = " r() color() " }"
            else
                print "disc { radius = " r() " rotate x, " r() "turn translate " at() color() " }"
        }
    }' >"$work/mixed.st4"
cat >"$work/loop.st4" <<END
film { size = <160, 120> }
camera { from = <0, 0, 160> to = <0, 0, 0> }
for i in 0..$((n - 1)) {
    sphere {
        center = 100 * <rand(i, 0), rand(i, 1), rand(i, 2)> - <50, 50, 50>
        radius = 0.05 + 0.35 * rand(i, 3)
        material = matte(<rand(i, 4), rand(i, 5), rand(i, 6)>)
    }
}
END

# Sets seconds, spread and kilobytes.
measure() {
    local least most
    read -r seconds least most kilobytes < <("$bench" time "$@")
    spread="($least to $most)"
}

ratio() { awk -v a="$1" -v b="$2" 'BEGIN { printf "%.2f", a / b }'; }

# expect WHAT RATIO LIMIT: prints it; fails where the ratio is below.
expect() {
    printf '  %-34s %8s, at least %s\n' "$1" "$2" "$3"
    awk -v a="$2" -v b="$3" 'BEGIN { exit !(a >= b) }' || failed=1
}

echo "loading: $n spheres"
measure "$rounds" "$st4" eval "$work/many.st4" 1
load=$seconds
echo "  parse and evaluate                 $seconds s $spread, $((kilobytes * 1024 / n)) bytes an object"
measure "$rounds" "$st4" render "$work/many.st4" --size 1x1 -s 1 --progress none -o "$work/first.exr"
first=$seconds
echo "  to the first ray                   $seconds s $spread"
measure "$rounds" "$st4" check -q "$work/many.st4"
check=$kilobytes written=$seconds
# beyond_arrays WHAT NUMBERS: bytes an object of the last check, less those of so many numbers each.
beyond_arrays() {
    measure "$rounds" "$bench" arrays "$n" "$2"
    local bytes=$(((check - kilobytes) * 1024 / n))
    printf '  %-34s %s s, %s bytes an object more than its arrays, at most 250\n' "$1" "$written" "$bytes"
    [ "$bytes" -le 250 ] || failed=1
}
beyond_arrays check 7
spheres=$written
measure "$rounds" "$st4" eval "$work/mixed.st4" 1
mixed=$seconds
echo "  five kinds, parse and evaluate     $seconds s $spread"
measure "$rounds" "$st4" check -q "$work/mixed.st4"
check=$kilobytes written=$seconds
beyond_arrays "five kinds, check" 8
measure "$rounds" "$st4" check -q "$work/loop.st4"
echo "  check, the same from a for         $seconds s $spread, $((kilobytes * 1024 / n)) bytes an object"
expect "written out / for" "$(ratio "$spheres" "$seconds")" 1

if ! command -v povray >/dev/null; then
    echo "  POV-Ray is not installed: nothing to compare with"
    exit "$failed"
fi
# Its own statistics: CPU seconds of parsing and of bounding.
povray Input_File_Name="$work/many.pov" Output_to_File=off Display=off Width=16 Height=12 \
    Work_Threads=1 >"$work/pov" 2>&1
read -r parse bound < <(sed -nE '/(Parse|Bounding) Time/{n;s/.*with ([0-9.]+) CPU.*/\1/p}' \
    "$work/pov" | tr '\n' ' ') || true
echo "  POV-Ray                            $parse s to parse, $bound s to bound"
expect "its parse / parse and evaluate" "$(ratio "$parse" "$load")" 3
expect "its parse / five kinds" "$(ratio "$parse" "$mixed")" 3
expect "its parse and bounds / first ray" \
    "$(awk -v a="$parse" -v b="$bound" -v c="$first" 'BEGIN { printf "%.2f", (a + b) / c }')" 10
exit "$failed"
