#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Simulations against the bare loops of tests/bench/bench_sim.c: processor seconds and bytes of both,
# and what came of it. boxes=1000 and sparks=10000 say how many.
#
#   ST4=program BENCH=bench-sim tests/bench/bench_sim.sh
set -u
boxes=${boxes:-1000} sparks=${sparks:-10000}
export LC_ALL=C
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT

cat >"$work/pile.st4" <<END
sphere { }
sim rigid Pile {
  span = 0..10  step = 1/240
  fixed { plane { } }
  for k in 0..3 {
    fixed { box { size = <0.2, 8, 8> }  translate <2.5, 2, 0>  rotate y, 90deg*k }
  }
  for i in 0..$((boxes - 1)) {
    body Box[i] {
      box { size = <0.3, 0.3, 0.3> }
      friction = 0.6
      rotate y, 2.4rad*i
      translate <0.45*(i % 10 - 4.5) + 0.04*sin(7rad*i), 0.3 + 0.4*floor(i/100),
        0.45*(floor(i/10) % 10 - 4.5) + 0.04*cos(5rad*i)>
    }
  }
}
END
cat >"$work/sparks.st4" <<END
sphere { }
sim state Sparks {
  count = $sparks  span = 0..3  tolerance = 1e-6
  born = 2*id/$sparks
  pos = <0, 1, 0>
  vel = <2*cos(2.4rad*id), 3 + sin(7rad*id), 2*sin(2.4rad*id)>
  pos' = vel
  vel' = <0, -9.81, 0> - 0.2*vel
  when pos.y < 0 { pos = <pos.x, 0, pos.z>  vel = <vel.x, -0.6*vel.y, vel.z> }
}
END

# evaluate SCENE TIMES EXPR...: the numbers of the table without the times, one a line.
evaluate() {
    local scene=$1 times=$2
    shift 2
    "$ST4" eval "$work/$scene.st4" "$@" --at "$times" --cache "$work/$scene" -q |
        tail -n +2 | cut -f2- | tr '\t' '\n'
}

# The farthest that a box moves from 5 s to 10 s.
figure_of_pile() {
    local i
    local -a moves=()
    for ((i = 0; i < boxes; i++)); do moves+=("length(Pile.Box[$i].pos - at(Pile.Box[$i].pos, 5s))"); done
    evaluate pile '[6, 8, 10]' "${moves[@]}" | sort -g | tail -n 1
}

# The lowest height of every hundredth spark at any of 600 instants.
figure_of_sparks() {
    local i
    local -a heights=()
    for ((i = 0; i < sparks; i += 100)); do heights+=("min(Sparks.pos[$i].y, 0)"); done
    evaluate sparks '0..3 by 5ms' "${heights[@]}" | sort -g | head -n 1
}

TIMEFORMAT='%U %S'
# measure NAME N SPAN FIGURE
measure() {
    local own bare seconds
    own=$({ time "$ST4" sim "$work/$1.st4" --cache "$work/$1" -q >/dev/null; } 2>&1 |
        awk 'NF == 2 { print $1 + $2 }')
    seconds=$("$BENCH" "$1" "$2" "$3")
    read -r -a bare <<<"$seconds"
    printf '%-8s %8d %10.2f %12d %14s %12.2f %12d %14s\n' "$1" "$2" "$own" \
        "$(cat "$work/$1"/*.sim | wc -c)" "$("figure_of_$1")" "${bare[@]}"
}

printf '%-8s %8s %10s %12s %14s %12s %12s %14s\n' '' members 'st4, s' bytes '' 'bare loop, s' bytes ''
measure pile "$boxes" 10
measure sparks "$sparks" 3
echo "pile: the farthest move of a box from 5 s to 10 s; sparks: the lowest height of one, metres"
