#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What --noise X promises, against a long reference: for each example and X the true error over X,
# and the reported estimate over the true error, the least and the greatest of some seeds.
#
#   ST4=program tests/bench/bench_noise.sh
#
# scenes="hello dominoes", noises="0.2 0.1 0.05", seeds="1 2 3", size=64x40 and reference=16384 (its
# samples per pixel) say what is measured. References are kept in out/noise.
set -u
cd "$(dirname "$0")/../.." || exit 2
st4=${ST4:-./st4} noises=${noises:-0.2 0.1 0.05} seeds=${seeds:-1 2 3}
size=${size:-64x40} reference=${reference:-16384}
export LC_ALL=C
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
mkdir -p out/noise

number() {
    sed -nE 's/^ *"'"$1"'": *([^,]*),?$/\1/p' "$2" | head -n 1
}

printf '%-12s %6s %9s   %-17s %-17s\n' scene X samples 'true / X' 'estimate / true'
for scene in ${scenes:-$(basename -s .st4 examples/*.st4)}; do
    film=examples/$scene.st4
    last=$("$st4" info "$film" | sed -nE 's/.*frames [0-9]+ to ([0-9]+)$/\1/p')
    frame=$(((2 * last + 4) / 5))
    long=out/noise/$scene.$size.$reference.exr
    [ "$long" -nt "$film" ] ||
        "$st4" render "$film" -f $frame --size "$size" -s "$reference" --seed 777 -q -o "$long" || exit 1
    for noise in $noises; do
        for seed in $seeds; do
            "$st4" render "$film" -f $frame --size "$size" --noise "$noise" --seed "$seed" -q \
                --stats "$work/stats.json" -o "$work/a.exr" || exit 1
            "$st4" compare -q --metric relrmse "$work/a.exr" "$long" >"$work/true"
            echo "$noise $(cat "$work/true") $(number noise "$work/stats.json")" \
                "$(number samples_per_pixel "$work/stats.json")"
        done >"$work/rows"
        awk -v scene="$scene" '
            { over = $2 / $1; near = $2 > 0 ? $3 / $2 : 1; n += $4 }
            NR == 1 { low = high = over; least = most = near }
            { low = over < low ? over : low; high = over > high ? over : high }
            { least = near < least ? near : least; most = near > most ? near : most }
            END { printf "%-12s %6g %9.0f   %5.2f to %-8.2f %5.2f to %-8.2f\n", scene, $1, n / NR,
                  low, high, least, most }' "$work/rows"
    done
done
