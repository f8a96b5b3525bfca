# SPDX-License-Identifier: Apache-2.0
# Simulations: against closed forms, in any order of frames, kept and made again.

# The simulations of a.st4 come to the same bytes by three threads as by one for each processor.
same_by_any_threads() {
    expect 0 "$ST4" sim a.st4 --cache one -q
    expect 0 env OMP_NUM_THREADS=3 "$ST4" sim a.st4 --cache two -q
    expect 0 diff -r one two
}

test_sim_closed_forms() {
    cat >a.st4 <<'END'
sphere { }
sim state Fall { span = 0..2  h = 20  v = 0  h' = v  v' = -9.81 }
sim state Drag {
  span = 0..4  tolerance = 1e-8
  pos = <0, 0>  vel = <30, 40>
  pos' = vel  vel' = <0, -9.81> - 0.7*vel
}
sim state Spring { span = 0..20  tolerance = 1e-9  q = 1  w = 0  q' = w  w' = -4*q }
sim state Stiff { span = 0..2  tolerance = 1e-7  stiff = true  q = 0  q' = 5000*(cos(t*1rad) - q) }
let g = 9.81
let fade = exp(-0.7*t)
END
    at a.st4 '0..1.99 by 0.1' 'Fall.h - (20 - g/2*t^2)' 'Fall.v + g*t' 'd(Fall.h) - Fall.v'
    all_below 1e-6
    at a.st4 '0..4 by 0.25' 'Drag.pos.x - 30*(1 - fade)/0.7' \
        'Drag.pos.y - ((40 + g/0.7)*(1 - fade)/0.7 - g/0.7*t)'
    all_below 1e-5
    at a.st4 '0..20 by 0.5' 'Spring.q - cos(2rad*t)'
    all_below 3e-8
    at a.st4 '0.1..2 by 0.1' \
        'Stiff.q - (5000^2*cos(t*1rad) + 5000*sin(t*1rad))/(5000^2 + 1)'
    all_below 1e-5
}

test_sim_orbits_and_energy() {
    cat >a.st4 <<'END'
sphere { }
sim state Planet { // 100 turns
  span = 0..629  tolerance = 1e-11
  pos = <1, 0>  vel = <0, 1>
  pos' = vel  vel' = -pos / (pos.x^2 + pos.y^2)^1.5
}
let turns = Planet.pos - <cos(t*1rad), sin(t*1rad)>
sim state Double { // a double pendulum of equal rods and weights
  span = 0..10  tolerance = 1e-10
  a = 2  b = -0.2  wa = 0  wb = 0
  a' = wa  b' = wb
  let s = sin((a - b)*1rad)
  let c = cos((a - b)*1rad)
  wa' = (-9.81*2*sin(a*1rad) + 9.81*sin(b*1rad)*c - s*(wb^2 + wa^2*c)) / (2 - c^2)
  wb' = 2*s*(wa^2 + 9.81*cos(a*1rad) + wb^2*c/2) / (2 - c^2)
}
let energy = Double.wa^2 + 0.5*Double.wb^2 + Double.wa*Double.wb*cos((Double.a - Double.b)*1rad) -
             9.81*(2*cos(Double.a*1rad) + cos(Double.b*1rad))
END
    at a.st4 '[1, 62.8, 314, 628.3]' turns
    all_below 2e-6
    at a.st4 '0..10 by 0.1' 'energy - at(energy, 0)'
    all_below 2e-7
}

# The tables of the manual: what is measured stays below what stands there.
test_sim_accuracy_is_as_the_manual_says() {
    local kind name measured stated row i n=0
    expect 0 "$ROOT/tests/sim_accuracy"
    while IFS='|' read -r kind name measured; do
        row=$(sed -n "/errors of $kind\$/,/errors end/p" "$ROOT/man/st4.5" | grep -F ".It $name Ta ")
        [ -n "$row" ] || fail "the manual has no row '$name' for sim $kind"
        row=${row#".It $name Ta "}
        for i in 1 2 3; do
            stated=$(sed 's/ Ta /|/g' <<<"$row" | cut -d'|' -f$i)
            below "$(cut -d'|' -f$i <<<"$measured")" "$stated"
            n=$((n + 1))
        done
    done <<<"$out"
    [ $n = 51 ] || fail "$n figures"
}

# Two balls of one weight swap their speeds: each gets the one that the other had before.
test_sim_collision() {
    cat >a.st4 <<'END'
sphere { }
sim state Balls {
  count = 2  span = 0..4  tolerance = 1e-8
  q = id == 0 ? 0 : 2
  w = id == 0 ? 1 : 0
  q' = w
  when Balls.q[1] - Balls.q[0] < 0.5 { w = Balls.w[1 - id] }
}
END
    at a.st4 '0..4 by 0.125' 'Balls.q[0] - min(t, 1.5)' 'Balls.q[1] - max(2, t + 0.5)'
    all_below 1e-9
}

# Sums over what is near are those over all, where the rest adds nothing; members that meet fly on
# together, and those far away feel nothing.
test_sim_near() {
    cat >a.st4 <<'END'
sphere { }
let n = 40
fn fade(d) = max(0, 1 - dot(d, d)/0.49)^2
sim state Near {
  count = n  span = -1..1  tolerance = 1e-6
  pos = randdir(1, id)*(0.2 + rand(2, id)) - <0, 0.3, 0>
  vel = randdir(3, id)
  fn pull(j) = fade(Near.pos[j] - pos)*(Near.vel[j] - vel)
  fn push(j) = -2*fade(Near.pos[j] - pos)*(Near.pos[j] - pos)
  fn count(j) = fade(Near.pos[j] - pos)
  seen = 0
  pos' = vel
  vel' = near(Near.pos, 0.7, pull) + near(Near.pos, 0.7, push) - pos
  seen' = near(Near.pos, 0.7, count)
}
sim state All {
  count = n  span = -1..1  tolerance = 1e-6
  pos = randdir(1, id)*(0.2 + rand(2, id)) - <0, 0.3, 0>
  vel = randdir(3, id)
  fn sway(d, v) = fade(d)*(v - 2*d)
  fn all(j) = j < n ? sway(All.pos[j] - pos, All.vel[j] - vel) + all(j + 1) : <0, 0, 0>
  fn count(j) = j < n ? fade(All.pos[j] - pos) + count(j + 1) : -1
  seen = 0
  pos' = vel
  vel' = all(0) - pos
  seen' = count(0)
}
sim state Line { // on a line: each moves as many times as fast as others are within 1
  count = 100  span = 0..1
  at = (id % 10)*100 + floor(id/10)*0.1
  way = 0
  fn one(j) = 1
  at' = 0
  way' = near(Line.at, 1, one)
}
END
    at a.st4 '[-1, -0.5, 0, 0.5, 1]' 'Near.pos[0] - All.pos[0]' 'Near.vel[17] - All.vel[17]' \
        'Near.seen[5] - All.seen[5]' 'Near.pos[39] - All.pos[39]'
    all_below 1e-5
    at a.st4 '[1]' 'Line.way[0] - 9' 'Line.way[37] - 9'
    all_below 1e-6
    same_by_any_threads
}

# Members that read each other come and go: who is not there is in no sum of near(), keeps its state
# and has nothing happen to it; what the others do bends exactly at the instant.
test_sim_coming_and_going() {
    cat >a.st4 <<'END'
sphere { }
fn within(a, b) = clamp(t - a, 0, b - a)
sim state Sum { // 1, 2 and 3 are added up while they are there
  count = 4  span = 0..4  tolerance = 1e-8
  born = [-1, 1, 0.5, 7][id]
  dies = [9, 9, 1.5, 9][id]
  q = 10*id
  fn worth(j) = j + 1
  q' = near(Sum.q, 100, worth)
}
sim state Spring { // two on a spring, which holds while both are there
  count = 2  span = 0..4  tolerance = 1e-9
  born = id == 0 ? 0 : 1
  dies = id == 0 ? 10 : 3
  q = 1 + id  w = 0
  q' = w
  w' = Spring.alive[1 - id] ? 4*(Spring.q[1 - id] - q) : 0
}
let swing = cos(sqrt(8)*within(1, 3)*1rad)/2
let drift = sqrt(8)*sin(sqrt(8)*2rad)/2*max(0, t - 3)
sim state Guard { // 0 counts who has come, of those that are no more than 2 at once
  count = 5  span = 0..4
  born = id == 0 ? 0 : 0.5*id
  dies = id == 0 ? 9 : 0.5*id + 1
  q = 0  n = 0  late = 0
  fn one(j) = 1
  let others = near(Guard.q, 1, one)
  q' = 0
  for k in 1..4 { when Guard.alive[k] { n = n + 1 } }
  when others > 1 { late = t }
}
END
    at a.st4 '[-1, 0, 0.25, 0.5, 0.500001, 0.75, 0.999999, 1, 1.25, 1.5, 1.500001, 2, 3, 4, 5]' \
        'Sum.q[0] - 2*within(1, 4) - 3*within(0.5, 1.5)' \
        'Sum.q[1] - 10 - within(1, 4) - 3*within(1, 1.5)' \
        'Sum.q[2] - 20 - within(0.5, 1.5) - 2*within(1, 1.5)' 'Sum.q[3] - 30'
    all_below 1e-9
    at a.st4 '0..4 by 0.125' 'Spring.q[0] - (1.5 - swing + drift)' 'Spring.q[1] - (1.5 + swing)'
    all_below 3e-8
    at a.st4 '[0.4, 0.6, 1.1, 1.6, 2.1, 4]' 'Guard.n[0] - min(4, floor(t/0.5))' \
        'Guard.late[0] - (t < 1 ? 0 : 1)' 'Guard.n[1] - (t < 1 ? 0 : 1)' \
        'Guard.n[3] - (t < 2 ? 0 : 1)'
    all_below 1e-9
}

# Where members read each other, but what they read adds nothing, they do as those by themselves do.
test_sim_coming_and_going_alone() {
    local kind
    echo 'sphere { }' >a.st4
    for kind in Alone Together; do
        cat <<END
sim state $kind {
  count = 40  span = 0..3  tolerance = 1e-7
  born = 0.02*id
  dies = 0.02*id + 1.2 + 0.4*rand(3, id)
  pos = <0, 1, 0>  vel = 2*randdir(2, id) + <0, 3, 0>
  fn none(j) = 0
  pos' = vel
  vel' = <0, -9.81, 0> - 0.2*vel $([ $kind = Alone ] || echo "+ near(Together.pos, 1, none)*x")
  when pos.y < 0 { pos = <pos.x, 0, pos.z>  vel = <vel.x, -0.6*vel.y, vel.z> }
}
END
    done >>a.st4
    at a.st4 '0..3 by 0.04' 'Alone.pos[0] - Together.pos[0]' 'Alone.pos[17] - Together.pos[17]' \
        'Alone.pos[39] - Together.pos[39]' 'Alone.alive[20] == Together.alive[20] ? 0 : 1'
    all_below 1e-6
}

# Members that read each other go back one by one to what happens to them. Where conditions, or rates,
# name others, steps end for all, or all are looked at: it comes to the same.
test_sim_crowds() {
    local kind zero none i
    local -a misses
    echo 'sphere { }' >a.st4
    for kind in Few Named All; do
        zero='' none=''
        [ $kind = Named ] && none="+ 0*Named.vel[0]"
        [ $kind = All ] && zero="+ 0*All.pos[0].y"
        cat <<END
sim state $kind {
  count = 80  span = 0..2  tolerance = 1e-7
  born = 0.9*rand(5, id)
  dies = id % 3 == 0 ? 0.8 + rand(6, id) : 9
  pos = <0, 1, 0> + 0.6*rand(1, id)*randdir(7, id)
  vel = 3*randdir(8, id)
  hits = 0
  fn fade(d) = max(0, 1 - dot(d, d)/0.09)^3
  fn push(j) = -40*fade($kind.pos[j] - pos)*($kind.pos[j] - pos)
  pos' = vel
  vel' = <0, -9.81, 0> - 0.5*pos + (id % 4)*near($kind.pos, 0.3, push) $none
  hits' = 0
  when pos.y $zero < 0 { pos = <pos.x, 0, pos.z>  vel = <vel.x, -0.6*vel.y, vel.z>  hits = hits + 1 }
  when t > 0.6 + 0.3*rand(9, id) { vel = 1.5*vel }
  when length(vel) > 6 { vel = 0.4*vel }
}
END
    done >>a.st4
    for kind in Named All; do
        misses=()
        for i in $(seq 0 79); do
            misses+=("Few.pos[$i] - $kind.pos[$i]" "Few.hits[$i] - $kind.hits[$i]")
        done
        at a.st4 '[0.3, 0.61, 0.9, 1.3, 2]' "${misses[@]}"
        all_below 1e-4
    done
    at a.st4 '[2]' 'Few.hits[0] + Few.hits[8] + Few.hits[77]'
    below 20 "$(cut -d' ' -f2 <<<"$out")"
    same_by_any_threads
}

# Bullets, each born and gone within what is one long step for marks that stand still, fly through one
# or two of them: none lets one pass unseen. Each adds up what the integral over its way is.
test_sim_crowds_see_who_passes() {
    cat >a.st4 <<'END'
sphere { }
sim state S {
  count = 32  span = 0..10  tolerance = 1e-7
  born = id < 30 ? -1 : id == 30 ? 0.4 : 4
  dies = id < 30 ? 99 : id == 30 ? 1.43 : 4.095
  at = id < 30 ? 0.9 + 7*id : id == 30 ? 0 : 0.5
  seen = 0
  fn bump(j) = max(0, 1 - ((S.at[j] - at)/0.3)^2)^3
  at' = id < 30 ? 0 : 8
  seen' = id < 30 ? near(S.at, 0.3, bump) : 0
}
sim state Pairs { // a bullet for each mark; steps are short for what swings and stays where it is
  count = 80  span = 0..2  tolerance = 1e-7
  born = id < 30 ? 0.2 + 0.0513*id : -1
  dies = id < 30 ? 0.21 + 0.0513*id : 99
  at = 1000*(id % 30) + (id < 30 ? 0 : id < 60 ? 0.45 : 50)
  seen = 0
  swing = id < 60 ? 0 : 1
  speed = 0
  fn bump(j) = max(0, 1 - ((Pairs.at[j] - at)/0.3)^2)^3
  at' = id < 30 ? 300 : 0
  seen' = id < 30 ? 0 : near(Pairs.at, 0.3, bump)
  swing' = speed
  speed' = -1e4*swing
}
let one = 32/35*0.3
fn after(when) = t > when ? one/8 : 0
END
    at a.st4 '[0.3, 2, 9]' 'S.seen[0] - after(1) - after(4.1)' 'S.seen[1] - after(1.5)' 'S.seen[2]'
    all_below 1e-6
    local -a misses=()
    for i in $(seq 0 29); do misses+=("Pairs.seen[30 + $i] - one/300"); done
    at a.st4 '[2]' "${misses[@]}"
    all_below 1e-6
}

# A bouncing ball keeps its corner: at the instant, and a thousandth of a second beside it.
test_sim_bounce() {
    cat >a.st4 <<'END'
sphere { }
sim state Ball {
  span = 0..3  tolerance = 1e-6
  h = 1  v = 0
  h' = v  v' = -9.81
  when h < 0 { h = 0  v = -0.8*v }
}
let g = 9.81
let hit = sqrt(2/g)
let since = t - hit
let exact = since < 0 ? 1 - g/2*t^2 : 0.8*sqrt(2*g)*since - g/2*since^2
END
    at a.st4 '[0.2, 0.45, 0.4514, 0.45152, 0.45153, 0.4525, 0.6, 1.1]' 'Ball.h - exact'
    all_below 1e-6
    at a.st4 '0..3 by 1ms' 'min(Ball.h, 0)'
    all_below 1e-9
}

# Statements that are chosen, once, and repeated, in the block and in events.
test_sim_for_and_if() {
    cat >a.st4 <<'END'
sphere { }
param bounces = true
sim state Marks { // one after another is passed, and says what it is worth
  span = 0..4
  at = 0  sum = 0
  for k in 1..3 {
    let worth = 10^(k - 1)
    when at > k { sum = sum + worth }
  }
  at' = 1
}
sim state Ball {
  if bounces { span = 0..3  h = 1 } else { span = 0..1  h = 1  w = 0  w' = h }
  v = 0
  h' = v
  let g = 9.81
  if g < 9 { v' = 1 } else if g < 10 { v' = -g } else { v' = 0 }
  if bounces {
    let keep = 0.8
    when h < 0 { h = 0  if keep > 0.5 { v = -keep*v } else { v = 0 } }
  }
}
sim state Sum { // within an event all read what was before
  count = 3  span = 0..1
  q = id  r = 0
  q' = 1
  when t > 0.5 { for k in 0..2 { let add = k*id  q = q + add  if k < 2 { r = k + 5 } } }
}
let g = 9.81
let since = t - sqrt(2/g)
let exact = since < 0 ? 1 - g/2*t^2 : 0.8*sqrt(2*g)*since - g/2*since^2
END
    at a.st4 '[0.2, 0.45, 0.4515, 0.4525, 0.6, 1.1]' 'Ball.h - exact'
    all_below 1e-6
    at a.st4 '[0.999999, 1.000001, 1.999999, 2.000001, 2.999999, 3.000001]' Marks.sum
    [ "$(cut -d' ' -f2 <<<"$out" | tr '\n' ' ')" = '0 1 1 11 11 111 ' ] || fail "$out"
    at a.st4 '[0.25, 0.75]' 'Sum.q[2] - (t < 0.5 ? 2 : 6) - t' 'Sum.r[1] - (t < 0.5 ? 0 : 6)'
    all_below 1e-9
    expect 1 "$ST4" eval a.st4 Ball.w --at 1
    has "$err" "no member 'w'"
    expect 0 "$ST4" eval a.st4 'Ball.w - (1 - 9.81/6)' --at 1 -D bounces=false
    out=$(tail -n +2 <<<"$out" | tr '\t' ' ')
    all_below 1e-6
}

# Rotations turn with the angular velocity that is their rate.
test_sim_rotations() {
    cat >a.st4 <<'END'
box { size = <1, 2, 3>  pose = Flips.q[0] }
fn turns(a, b) = <length(a*x - b*x), length(a*y - b*y), length(a*z - b*z)>
let s = 1rad*t
sim state Even { span = 0..10  q = rotate(x, 90deg)  q' = pi/2*y }
sim state Top { // its axis goes round the angular momentum
  count = 2  span = 0..10  tolerance = 1e-9
  q = rotate(x, 30deg + 40deg*id)
  q' = L/2 + 1.5*dot(L, q*z)*(q*z)
}
let L = <1, 3, 2>
fn top(start) = rotate(L, length(L)/2*s)*rotate(start*z, 1.5*dot(L, start*z)*s)*start
sim state Free { // three moments: the angular momentum stays, in space
  span = 0..20  tolerance = 1e-9
  q = rotate(y, 10deg)  w = <0.1, 3, 0.1>
  q' = q*w
  w' = <(2 - 3)*w.y*w.z, (3 - 1)*w.z*w.x, (1 - 2)*w.x*w.y>/<1, 2, 3>
}
let momentum = Free.q*(<1, 2, 3>*Free.w)
sim state Flips { // half a turn about z each second, and all others likewise
  count = 2  span = 0..3  born = 1.5*id  n = 1 + id
  q = rotate(y, 20deg)  q' = x
  when t > n { q = rotate(z, 180deg)*Flips.q[0]  n = n + 1 }
  n' = 0
}
fn on(a, b) = rotate(x, clamp(t - a, 0, b - a)*1rad)
fn flip(a) = rotate(z, t > a ? 180deg : 0deg)
END
    at a.st4 '0..10 by 0.25' 'turns(Even.q, rotate(y, 90deg*t)*rotate(x, 90deg))'
    all_below 1e-6
    at a.st4 '0..10 by 0.25' 'turns(Top.q[0], top(rotate(x, 30deg)))' \
        'turns(Top.q[1], top(rotate(x, 70deg)))'
    all_below 2e-7
    # Their rates are their spin: that of what they are read as, and of what is made of them.
    at a.st4 '0..9.9 by 0.26' 'Even.q.spin - pi/2*y' \
        'Top.q[1].spin - L/2 - 1.5*dot(L, Top.q[1]*z)*(Top.q[1]*z)' 'd(Top.q[0]) - Top.q[0].spin' \
        'd(top(rotate(x, 70deg))) - Top.q[1].spin' 'Free.q.spin - Free.q*Free.w'
    all_below 2e-5
    at a.st4 '0..20 by 0.25' 'momentum - at(momentum, 0)'
    all_below 1e-6
    at a.st4 '[0, 0.5, 0.999, 1.001, 1.7, 2.001, 2.5]' \
        'turns(Flips.q[0], on(2, 3)*flip(2)*on(1, 2)*flip(1)*on(0, 1)*rotate(y, 20deg))' \
        '(t < 2 ? 0 : 1)*turns(Flips.q[0], Flips.q[1])'
    all_below 1e-6
}

test_sim_rest() {
    cat >a.st4 <<'END'
film { frames = 1..72 }
sim state Ball {
  count = 2  h = 1 + id  v = 0
  h' = v  v' = -9.81
  when h < 0 { h = 0  v = -0.3*v }
}
for i in 0..1 { sphere { radius = 0.1  translate <i, Ball.h[i] + 0.1, 0> } }
END
    expect 0 "$ST4" check a.st4
    has "$err" 'Ball, member 0 rests from t = 0.838'
    has "$err" 'so do 1 more'
    [ "$(grep -c sim-rests <<<"$err")" = 1 ] || fail "$err"
    expect 0 "$ST4" info a.st4
    lacks "$err" rests
    at a.st4 '[1.5, 2, 3]' 'Ball.h[0]' 'Ball.h[1]'
    all_below 1e-6
}

# That points come and go is no motion that is missed; that they jump or swell all at once, more than
# are looked at one by one, is. Sizes are a list of the simulation's too.
test_sim_points_come_and_go() {
    cat >a.st4 <<'END'
film { size = <64, 36>  frames = 1..24 }
camera { from = <0, 0, 5>  to = 0*x }
sim state S {
  count = 600  span = 0..1
  born = 0.1 + 0.3*id/600
  dies = 0.5 + 0.4*id/600
  at = <id/300 - 1, -0.5, 0>
  size = 0.1
  at' = y
  size' = 0.1
  when t > 0.3 + 0.5*id/600 { size = size }
}
points { at = S.at  radius = S.size }
END
    expect 0 "$ST4" check a.st4
    lacks "$err" tolerance-missed
    sed 's/{ size = size }/{ size = 3*size }/' a.st4 >b.st4
    expect 0 "$ST4" check b.st4
    has "$err" tolerance-missed
    sed 's/{ size = size }/{ at = at + x }/' a.st4 >b.st4
    expect 0 "$ST4" check b.st4
    has "$err" tolerance-missed
    sed 's/S.size }/[0.1, 0.2] }/' a.st4 >b.st4
    expect 1 "$ST4" check b.st4
    has "$err" 'there are 600 points and 2 radii'
    sed 's/S.size }/S.at }/' a.st4 >b.st4
    expect 1 "$ST4" check b.st4
    has "$err" 'radius is a number or a list of numbers, item 0 is a vector of 3'
}

# The scene of sparks: born one after another, never below the floor.
a_scene_of_sparks() {
    cat >sparks.st4 <<'END'
film { size = <48, 27>  frames = 1..72 }
camera { from = <0, 1.6, 5>  to = <0, 0.8, 0> }
sim state Sparks {
  count = 60  span = 0..3  tolerance = 1e-6
  let birth = 0.02 * id
  born = birth
  dies = birth + 2
  pos = <0, 1, 0>
  vel = 3 * randdir(2, id) + <0, 3, 0>
  pos' = vel
  vel' = <0, -9.81, 0> - 0.2*vel
  when pos.y < 0 { pos = <pos.x, 0, pos.z>  vel = <vel.x, -0.6*vel.y, vel.z> }
}
points { at = Sparks.pos  radius = 0.03  material = glow(kelvin(2400), 5) }
END
}

test_sim_sparks_stay_above() {
    local -a heights=()
    a_scene_of_sparks
    for i in $(seq 0 59); do heights+=("min(Sparks.pos[$i].y, 0)"); done
    at sparks.st4 '0..3 by 2ms' "${heights[@]}"
    all_below 1e-6
    at sparks.st4 '[0.39, 0.4, 2.39, 2.4]' 'Sparks.alive[20] ? 1 : 0'
    [ "$(cut -d' ' -f2 <<<"$out" | tr -d '\n')" = 0110 ] || fail "$out"
}

test_sim_frames_in_any_order() {
    a_scene_of_sparks
    expect 0 "$ST4" render sparks.st4 -f 30-33 -s 2 -o 'all.##.exr' --cache one
    expect 0 "$ST4" render sparks.st4 -f 33 -s 2 -j 1 -o 'alone.##.exr' --cache two
    expect 0 "$ST4" compare all.33.exr alone.33.exr --metric max --fail-above 0
    same one/*.sim two/*.sim
}

test_sim_kept() {
    local file before
    a_scene_of_sparks
    expect 0 "$ST4" sim sparks.st4 --cache kept
    has "$out" simulated
    expect 0 "$ST4" sim sparks.st4 --cache kept
    has "$out" 'kept before'
    file=$(ls kept/*.sim)
    before=$(cksum <"$file")
    for damage in 'printf x | dd of="$file" bs=1 seek=5000 conv=notrunc' 'truncate -s -8 "$file"' \
        'printf nonsense >"$file"' ': >"$file"' \
        'printf x | dd of="$file" bs=1 seek=76 conv=notrunc' \
        'printf x | dd of="$file" bs=1 seek=118 conv=notrunc'; do
        eval "$damage" 2>/dev/null
        expect 0 "$ST4" sim sparks.st4 --cache kept
        has "$out" simulated
        [ "$(cksum <"$file")" = "$before" ] || fail "other bytes after: $damage"
    done
    sed -i 's/0.2\*vel/0.3*vel/' sparks.st4
    expect 0 "$ST4" sim sparks.st4 --cache kept
    has "$out" simulated
    # Two at once.
    "$ST4" sim sparks.st4 --cache both -q & "$ST4" sim sparks.st4 --cache both -q
    wait
    same both/*.sim "kept/$(ls both)"
    touch file
    expect 0 "$ST4" sim sparks.st4 --cache file/below
    has "$err" 'cannot create the folder'
}

test_sim_mistakes() {
    local start="sphere { } sim state S {"
    refused() {
        printf '%s\n' "$1" >a.st4
        expect 1 "$ST4" sim a.st4 --color never
        has "$err" "$2"
    }
    refused "$start span = 0..9  q = 1  q' = q^2 }" 'S: at t = 1 s its equations grow without bound'
    refused "$start count = 3  span = 0..2  q = id  q' = id == 2 and t > 0.5s ? 0/0 : 1 }" 'S, member 2: at t = 0.5'
    refused "$start q = 1/0  q' = 1 }" 'its start values are not finite'
    refused "$start count = 3  span = 0..9  q = 1 + id  q' = q^2 + 0*S.q[0] }" 'S, member 2: at t = 0.333333 s its equations cannot be integrated any further'
    refused "$start count = 3  span = 0..2  q = id  q' = id == 2 and t > 0.5s ? 0/0 : S.q[0] }" 'S, member 2: at t = 0.5'
    refused "$start count = 3  q = 1/(1 - id)  q' = S.q[0] }" 'S, member 1: at t = 0 s its start values are not finite'
    refused "$start count = 3  q = id  q' = 1/(1 - S.q[id]) }" 'S, member 1: at t = 0 s its rates are not finite'
    refused "$start count = 3  span = 0..2  q = 1 + id  q' = -1  when q < 0 { q = 1/0 } }" 'S, member 0: at t = 1 s an event gives it values that are not finite'
    refused "$start count = 3  span = 0..2  q = 1 + id  q' = -S.q[0]^0  when q < 0 { q = 1/0 } }" 'S, member 0: at t = 1 s an event gives it values that are not finite'
    refused "$start q = 0  q' = R.p } sim state R { p = 0  p' = S.q }" "S.q is read here for what S itself needs to run"
    refused "$start q = 0  q' = R.B.pos.x } sim rigid R { body B { box { } force = S.q*x } }" "S.q is read here for what S itself needs"
    refused "$start q = 1  q' = -g } let g = S.q" "S.q is read here for what S itself needs"
    refused "$start span = 2..2  q = 0  q' = 1 }" 'the span is empty'
    refused "$start q = 0  cuont = 5  q' = 1 }" "did you mean 'count'?"
    refused "$start q = 0  q' = <1, 2> }" "the rate of 'q' is a number"
    refused "$start v' = 1  q = 0  q' = 1 }" "'v' has a rate, but no start value"
    refused "$start q = 0  q' = 1  when q > 1 { w = 2 } }" "'w' has an assignment, but no start"
    refused "$start q = 0  q' = 1  sphere { } }" "'sim state' holds settings"
    if [ -n "${STRESS-}" ]; then
        refused "$start span = 0..1e7  q = 1  w = 0  q' = w  w' = -q }" 'more than four million steps'
    fi
    refused "$start }" 'has no states'
    refused "sim stat S { q = 0  q' = 1 } sphere { }" 'there is no sim stat'
    refused "$start q = 0  q' = 1 } sphere { radius = S.r }" "S has no member 'r'"
    refused "$start q = 0  q' = 1 } sphere { radius = S }" "write S.NAME"
    refused "$start tolerance = 0  q = 0  q' = 1 }" 'tolerance'
    refused "$start q = rotate(x, 1deg)  q' = q }" "the rate of 'q' is its angular velocity"
    refused "$start q = rotate(x, 1deg)  q' = x  when t > 1 { q = x } }" 'is a rotation'
    refused "$start q = translate(x)  q' = x }" 'this is a transform'
    refused "$start q = 0  q' = 1  if id > 0 { v = 1 } }" "the condition of 'if' must be known"
    refused "$start q = 0  q' = 1  if q > 0 { v = 1 } }" "nothing is called 'q' here"
    refused "$start q = 0  q' = 1  when q > 0 { if q > 1 { q = 0 } } }" 'it is decided once, for all members'
    refused "$start q = 0  for k in 0..t { when q > k { q = 0 } } }" 'the end of a range must be known'
    refused "$start q = 0  for k in 0..9 { q' = k } }" "the rate of 'q' is given twice"
    errors "$err" 1
    refused "$start q = 0  q' = 1  for k in 0..9 { sphere { } } }" "'sim state' holds settings"
    errors "$err" 1
    refused "$start q = 0  q' = 1  for k in 0..999 { when q > k { q = 0 } } }" 'more than 256 events'
    errors "$err" 1
    refused "$start q = 0  q' = 1  when q > 0 { q' = 3 } }" 'an event holds assignments'
    start="sphere { } sim state S { count = 3  q = id  q' = "
    refused "$start near(1, 1, sin) }" 'near wants a place of all members of S'
    refused "$start near(S.q, 0, sin) }" 'the radius of near is more than 0'
    refused "$start near(S.q, 1, 5) }" "near wants a function of another member's number"
    refused "$start near(S.q, t, f)  fn f(j) = 1 }" 'the radius of near'
    refused "$start near(S.q, 1, f)  fn f(j) = near(S.q, 1, g)  fn g(j) = j }" 'can not depend on another near'
    refused "$start near(S.q, 1, f)  fn f(j) = \"a\" }" 'near adds up numbers'
    refused "sphere { radius = near([1], 1, sin) }" 'stands in the rates and events of a sim state'
    start="sphere { } sim state S {"
    refused "$start count = 2  born = S.q[0]  q = 0  q' = S.q[1] }" 'born and dies can not read the members'
    refused "$start born = q  q = 0  q' = 1 }" "nothing is called 'q' here"
    refused "$start r = 0  q = S.r  q' = 1 }" 'start values, born and dies can not read the members'
    refused "$start q = 0  q' = 1  r = 0  r' = d(q) }" "the rate of x is what stands behind x' ="
    refused "$start q = 0  q' = 1  r = 0  r' = at(q, t - 1) }" 'known at one instant only'
    refused "$start q = rotate(x, t*0deg)  q' = x  r = x  r' = q.spin }" 'known at one instant only'
}

# A simulation of a def's copy is its own; nothing that is not read is run.
test_sim_in_defs() {
    cat >a.st4 <<'END'
def Ball(speed) {
  sim state Way { span = 0..2  q = 0  q' = speed }
  sphere { radius = 0.1  translate <Way.q, 0, 0> }
}
for i in 0..2 { Ball(1 + i) { } }
sim state Unread { q = 0  q' = 0/0 }
END
    expect 0 "$ST4" mesh a.st4 --at 2s -o out.ply
    expect 0 "$ST4" check a.st4
    expect 1 "$ST4" sim a.st4
    has "$err" 'Unread: at t = 0 s its rates are not finite'
}

test_sim_before_and_after() {
    cat >a.st4 <<'END'
film { frames = 1..96 }
sim state S { span = 0..3  q = 1  q' = 1 }
sphere { translate <S.q, 0, 0> }
END
    at a.st4 '[-1, 5]' 'S.q'
    [ "$out" = $'-1 1\n5 4' ] || fail "$out"
    expect 0 "$ST4" info a.st4
    has "$err" 'S is read at t = 3.0'
    has "$err" 'its end is held'
}
