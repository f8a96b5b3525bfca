#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The tables of section 7 of Olsson's thesis, measured here: make thesis.
#
# Propeller (about 1000 triangles per part, all in one tree as there), twisted head (10,000) and a
# dense deforming mesh (346,000: a stand-in, or obj=FILE) by the thesis' tree, the default
# structure, a 3D tree with and without segments, and by accumulated subframes of static 3D trees.
# Depth, leaf size and kappa are the thesis'. Segments are summed over subframes; those of the
# default structure are its clusters. Seconds by the clock, medians of `rounds` runs.
#   size=320x240 rounds=3 counts="8 16" limit=600 scenes="propeller head mesh" obj=FILE
set -eu
cd "$(dirname "$0")/../.."
st4=$(readlink -f "${ST4:-./st4}")
size=${size:-160x120} rounds=${rounds:-1} counts=${counts:-8 16} limit=${limit:-600}
work=$(mktemp -d "${TMPDIR:-/tmp}/bench-thesis.XXXXXX")
trap 'rm -rf "$work"' EXIT
cp examples/propeller.st4 examples/head.st4 "$work"
{
    cat <<'END'
film    { size = <640, 480>  frames = 1..8 }
shutter { length = 4f  phase = start }
camera  { from = <0.4, 0.6, 4.2>  to = <0, 0, 0>  fov = 36deg }
sun     { dir = <-1, 1.5, 1.2>  power = 3 }
sky     { color = <0.3, 0.35, 0.4> }
let bend = 35deg * sin(0.5turn * t/0.3s)
END
    if [ -n "${obj-}" ]; then
        echo "mesh { file = \"$(readlink -f "$obj")\"  fit = 2m"
    else
        cat <<'END'
surface {
  u = 0turn..1turn  v = 0turn..0.5turn  res = <720, 240>
  let r = 1 + 0.08*sin(9*u)*sin(7*v) + 0.01*sin(60*u)*sin(50*v)
  fn at(u, v) = r * <0.7*sin(v)*cos(u), cos(v), 0.7*sin(v)*sin(u)>
END
    fi
    echo '  fn deform(p) = turned(p, z, bend * smoothstep(-1, 1, p.y)) }'
} >"$work/mesh.st4"

# number FILE OBJECT NAME: of a statistics file.
number() {
    awk -v object="\"$2\": {" -v name="\"$3\":" '
        index($0, object) { is_open = 1 }
        is_open && index($0, name) { sub(/.*: /, ""); sub(/,/, ""); print; exit }' "$1"
}

median() {
    sort -g | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'
}

# row NAME COUNT ARGUMENTS...
row() {
    local name=$1 count=$2 i stats=$work/stats
    shift 2
    for ((i = 1; i <= rounds; i++)); do
        if ! timeout "$limit" "$st4" render "$@" --size "$size" -q --progress none \
            -o "$work/picture.exr" --stats "$stats.$i" 2>"$work/log"; then
            printf '  %-26s %5s  not done in %s s%s\n' "$name" "$count" "$limit" \
                "$(head -n 1 "$work/log" | sed 's/^/: /')"
            return
        fi
    done
    local column
    printf '  %-26s %5s' "$name" "$count"
    for column in sample segment build trace; do
        for ((i = 1; i <= rounds; i++)); do number "$stats.$i" seconds $column; done | median
    done | awk '{ v[NR] = $1 } END { printf " %8.3f %8.3f %8.3f", v[1], v[2] + v[3], v[4] }'
    for column in 'rays camera' 'rays shadow' 'rays bounce' 'bytes tree' 'bytes vertices' \
        'bytes segments' 'tree segments'; do
        # shellcheck disable=SC2086
        number "$stats.1" $column
    done | awk '{ v[NR] = $1 } END {
        printf " %10d %9.3f %9.3f %9d\n", v[1] + v[2] + v[3], v[4] / 1e6, (v[5] + v[6]) / 1e6, v[7] }'
}

# table SCENE FRAME BASE ARGUMENTS...: counts of samples, of subframes with BASE samples each.
table() {
    local scene=$1 frame=$2 each=$3 count
    shift 3
    echo "$scene, frame $frame, $size, medians of $rounds"
    printf '  %-26s %5s %8s %8s %8s %10s %9s %9s %9s\n' method count update build trace rays \
        'tree MB' 'prims MB' segments
    for count in $counts; do
        row 'accumulate, kd3' "$count" "$work/$scene.st4" -f "$frame" --accel kd3 "$@" \
            --method accumulate --subframes "$count" -s $((count * each))
    done
    local structure
    for count in $counts; do
        for structure in '' kd4-thesis kd3; do
            row "${structure:-the default}" "$count" "$work/$scene.st4" -f "$frame" \
                ${structure:+--accel $structure} "$@" -s "$count"
        done
        row 'kd3, not segmented' "$count" "$work/$scene.st4" -f "$frame" --accel kd3 "$@" \
            --kappa 1e6 -s "$count"
    done
    echo
}

"$st4" --version
for scene in ${scenes:-propeller head mesh}; do
    case $scene in
    propeller) table propeller 12 4 --bake ;;
    head) table head 24 2 --leaf-size 8 --max-depth 32 ;;
    mesh) table mesh 4 1 --kappa 4 --leaf-size 8 --max-depth 24 ;;
    *) echo "scenes: '$scene' is none of propeller, head, mesh" >&2 && exit 2 ;;
    esac
done
