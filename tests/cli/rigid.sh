# SPDX-License-Identifier: Apache-2.0
# Rigid bodies: against closed forms, under bad input, in any order of frames.

test_rigid_free_fall() {
    cat >a.st4 <<'END'
sphere { }
sim rigid Fall {
  span = 0..1  step = 1/240
  body Stone { sphere { radius = 0.1 }  vel = <1, 2, 0>  translate <0, 5, 0> }
  body Pair { // of unlike weights: turns about the centre of both
    sphere { radius = 0.1 }
    sphere { radius = 0.2  center = <0.5, 0, 0> }
    translate <9, 9, 0>
  }
  body Top { box { size = <0.2, 0.4, 0.6> }  spin = <0, 3, 0>  translate <3, 9, 0> }
}
let turn = rotate(y, 3rad*t)
END
    at a.st4 '0..0.99 by 0.037' 'Fall.Stone.pos - <t, 5 + 2*t - 4.905*t^2, 0>' \
        'Fall.Stone.vel - <1, 2 - 9.81*t, 0>' 'Fall.Pair.pos - <9, 9 - 4.905*t^2, 0>'
    all_below 1e-9
    at a.st4 '0..0.99 by 0.037' 'Fall.Top.spin - <0, 3, 0>'
    all_below 1e-2
}

# A top without weight, of moments 1 : 1 : 1/5: its axis and its spin go round its angular momentum, as
# members of what it is read as, of its turn, and of transforms that hold it.
test_rigid_spins() {
    cat >a.st4 <<'END'
sphere { }
sim rigid S {
  span = 0..2  step = 1/960  tolerance = 1e-8  gravity = 0*x
  body Even { box { size = <0.2, 0.4, 0.6> }  spin = 3*y }
  body Top { box { size = <0.1, 0.1, 0.3> }  spin = start  translate 9*x }
}
let start = <2, 0, 5>
let momentum = <start.x, 0, start.z/5>
let round = length(momentum)*t*1rad
let axis = turned(z, momentum, round)
let exact = turned(start, momentum, round)
let whole = translate(3*y)*rotate(x, 40deg*t)*S.Top*scale(<1, 2 + t, 3>)
fn across(q) = length(q*z - axis)
END
    at a.st4 '0.003..1.99 by 0.037' 'S.Even.spin - 3*y' 'S.Top.spin - exact' 'S.Top.turn.spin - exact' \
        'd(S.Top.turn) - exact' 'whole.spin - turned(exact, x, 40deg*t) - 40deg/1rad*x'
    all_below 2e-4
    at a.st4 '0.003..1.99 by 0.037' 'across(S.Top.turn)' 'S.Top*x - S.Top.pos - S.Top.turn*x'
    all_below 2e-5
}

test_rigid_friction_and_drag() {
    cat >a.st4 <<'END'
sphere { }
sim rigid Slide {
  span = 0..2  step = 1/480
  fixed { plane { } }
  body Block { box { size = <0.4, 0.2, 0.4> }  vel = <3, 0, 0>  translate <0, 0.1, 0> }
}
let stop = 3/(0.5*9.81)
let way = min(t, stop)
sim rigid Drag {
  span = 0..2  step = 1/960
  body Drop { sphere { radius = 0.1 }  mass = 2kg  force = -3*vel  translate <0, 50, 0> }
}
let k = 3/2
END
    at a.st4 '0..2 by 0.1' 'Slide.Block.pos.x - (3*way - 0.5*0.5*9.81*way^2)' \
        'Slide.Block.pos.y - 0.1'
    all_below 1e-3
    at a.st4 '0..2 by 0.1' 'Drag.Drop.pos.y - (50 + 9.81/k^2*(1 - exp(-k*t)) - 9.81/k*t)'
    all_below 1e-4
}

test_rigid_elastic_collision() {
    cat >a.st4 <<'END'
sphere { }
sim rigid Balls {
  span = 0..2  step = 1/960  gravity = <0, 0, 0>
  for i in 0..1 {
    body Ball[i] {
      sphere { radius = 0.1 }
      bounce = 1  friction = 0
      vel = <1 - i, 0, 0>
      translate <i, 0, 0>
    }
  }
}
END
    at a.st4 '0..2 by 0.125' 'Balls.Ball[0].pos.x - min(t, 0.8)' \
        'Balls.Ball[1].pos.x - max(1, t + 0.2)'
    all_below 5e-3
}

# A ball keeps its corner, and does not dive into the floor between steps.
test_rigid_bounce() {
    cat >a.st4 <<'END'
sphere { }
sim rigid Ball {
  span = 0..2  step = 1/960
  fixed { plane { } }
  body B { sphere { radius = 0.1 }  bounce = 0.8  translate <0, 1.1, 0> }
}
let hit = sqrt(2/9.81)
let since = t - hit
END
    at a.st4 '0..0.45 by 0.05' 'Ball.B.pos.y - (1.1 - 4.905*t^2)'
    all_below 1e-4
    at a.st4 '[0.5, 0.6, 0.8, 1]' 'Ball.B.pos.y - (0.1 + 0.8*9.81*hit*since - 4.905*since^2)'
    all_below 2e-2
    at a.st4 '0..2 by 1ms' 'min(Ball.B.pos.y - 0.1, 0)'
    all_below 5e-3
    at a.st4 '[0.44, 0.47]' 'Ball.B.vel.y'
    awk '{ exit !(NR == 1 ? $2 < -4.2 : $2 > 3.3) }' <<<"${out/$'\n'/ }" || true
    below "$(head -n 1 <<<"$out" | cut -d' ' -f2)" -4.2
    below 3.2 "$(tail -n 1 <<<"$out" | cut -d' ' -f2)"
}

test_rigid_joints_and_driven_bodies() {
    cat >a.st4 <<'END'
sphere { }
sim rigid P {
  span = 0..3  step = 1/960
  body Bob { sphere { radius = 0.1 }  translate <1, 2, 0> }
  joint hinge Pivot { a = Bob  at = <0, 2, 0>  axis = z }
  body Bead { sphere { radius = 0.1 }  vel = <0, 0, 1>  translate <5, 5, 0> }
  joint slider Rail { a = Bead  axis = z }
}
sim rigid Push {
  span = 0..2  step = 1/480
  fixed { plane { } }
  fixed Pusher { box { size = <0.2, 0.6, 1> }  translate <0.5*t, 0.3, 0> }
  body Block { box { size = <0.4, 0.4, 0.4> }  translate <0.6, 0.2, 0> }
}
let speed = length(P.Bob.vel)
END
    at a.st4 '0..2.9 by 0.1' 'length(P.Bob.pos - <0, 2, 0>) - 1'
    all_below 5e-3
    at a.st4 '0..2.9 by 0.1' 'speed^2/2*1.004 + 9.81*(P.Bob.pos.y - 2)' # 1.004: its own spin
    all_below 0.15
    at a.st4 '0..2.9 by 0.3' 'P.Bead.pos - <5, 5, t>'
    all_below 1e-2
    at a.st4 '[1.5, 1.9]' 'Push.Block.pos.x - (0.5*t + 0.3)'
    all_below 1e-2
}

# Stops, friction and motors of hinges and sliders.
test_rigid_joints_with_stops_and_strength() {
    cat >a.st4 <<'END'
sphere { }
sim rigid R { // a fixed body first, whether it moves or not
  span = 0..2  gravity = 0*x
  for i in 0..1 {
    fixed Post[i] { sphere { }  translate <5*i, -5, (i > 0 ? 1e-9*t : 0)> }
    body Wing[i] { box { }  mass = 6kg  translate 5*i*x }
    joint hinge { a = Post[i]  b = Wing[i]  at = 5*i*x  axis = z  strength = 999  speed = 1  range = -30deg..45deg }
    body Drawer[i] { box { }  mass = 6kg  translate <5*i, 0, 9> }
    joint slider { a = Post[i]  b = Drawer[i]  axis = x  strength = 200  speed = 0.5  range = -0.1..0.3 }
  }
}
sim rigid S {
  span = 0..6  gravity = 0*x
  body A { box { }  spin = 2*z }
  joint hinge { a = A  range = -45deg..90deg }
  body B { box { }  spin = -2*z  translate 5*x }
  joint hinge { a = B  at = 5*x  range = -45deg..90deg }
  for i in 0..1 {
    body Slide[i] { box { }  mass = 3kg  vel = (1 - 2*i)*2*z  translate (10 + 5*i)*x }
    joint slider Rail[i] { a = Slide[i]  range = -1..2 }
  }
  body Brake { box { }  mass = 3kg  vel = 3*z  translate 20*x }
  joint slider { a = Brake  strength = 3 }
  body Motor { box { }  mass = 6kg  translate 25*x }
  joint hinge { a = Motor  at = 25*x  strength = 2  speed = t < 4 ? 3 : -3 }
  body H { box { }  mass = 6kg  translate 30*x }
  body I { box { }  mass = 6kg  translate 30*x + 5*z }
  joint hinge { a = H  b = I  at = 30*x  strength = 2  speed = 1 }
  body Late { box { }  mass = 6kg  translate 35*x }
  joint hinge { a = Late  at = 35*x  strength = 2  speed = max(0, t - 4) }
}
fn turn(b) = atan2(dot(b.turn*x, y), dot(b.turn*x, x))/1rad
let slow = min(t, 3)
END
    at a.st4 '0..2 by 0.25' 'turn(R.Wing[0]) + min(t, pi/4)' 'turn(R.Wing[1]) + min(t, pi/4)' \
        'R.Drawer[0].pos.x + min(t/2, 0.3)' 'R.Drawer[1].pos.x - 5 + min(t/2, 0.3)' \
        'R.Post[0].pos.y + 5' 'R.Post[1].pos.x - 5'
    all_below 5e-3
    at a.st4 '0..6 by 0.25' 'turn(S.A) - min(2*t, pi/2)' 'turn(S.B) - max(-2*t, -pi/4)' \
        'S.Slide[0].pos.z - min(2*t, 2)'
    all_below 5e-3
    at a.st4 '0..2 by 0.25' 'S.Slide[1].pos.z - max(-2*t, -1)'
    all_below 0.1
    at a.st4 '0.01..5.9 by 0.25' 'S.Brake.pos.z - 3*slow + slow^2/2' \
        'S.Motor.spin.z - min(2*t, 3) + 2*max(0, t - 4)' 'S.H.spin.z - min(2*t, 0.5)' \
        'S.I.spin.z + min(2*t, 0.5)' 'S.Late.spin.z - max(0, t - 4)'
    all_below 5e-3
}

# Hulls, meshes and capsules slide, roll and lie as what they are.
test_rigid_shapes_of_triangles() {
    cat >a.st4 <<'END'
sphere { }
let corners = [for i in 0..7: <i % 2, floor(i/2) % 2, floor(i/4)> - <0.5, 0.5, 0.5>]
let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
sim rigid S {
  span = 0..3  step = 1/480
  fixed { plane { } }
  fixed Table { quad { size = <8, 8> }  rotate x, -90deg  translate <0, 1, -20> }
  body Hull { convex = true  mesh { points = corners  faces = faces }  vel = <3, 0, 0>  translate <0, 0.5, 0> }
  body Solid { mesh { points = corners  faces = faces }  vel = <3, 0, 0>  translate <0, 0.5, 3> }
  body OnTable { convex = true  mesh { points = corners  faces = faces }  translate <0, 1.6, -20> }
  body Ring { torus { major = 0.5  minor = 0.1 }  translate <9, 0.3, 0> }
  body Tip { cone { from = <0, 0.8, 0>  to = <0, 0, 0>  radius = 0.2 }  rotate z, 1deg  translate <-9, 0, 0> }
  body Roller {
    capsule { from = <0, 0, -1>  to = <0, 0, 1>  radius = 0.25 }
    vel = <1, 0, 0>  spin = <0, 0, -4>  translate <0, 0.25, 20>
  }
}
let stop = 3/(0.5*9.81)
let way = min(t, stop)
sim rigid Drop {
  span = 0..1  step = 1/240  gravity = <0, 0, 0>
  body Cone { cone { radius = 1  to = <0, 4, 0> }  spin = <0, 2, 0>  force = <0, 1000, 0> }
  body Box { mesh { points = corners  faces = faces }  force = <1000, 0, 0>  translate <9, 0, 0> }
}
END
    at a.st4 '0..3 by 0.25' 'S.Hull.pos.x - (3*way - 0.5*0.5*9.81*way^2)' 'S.Hull.pos.y - 0.5' \
        'S.Solid.pos.x - (3*way - 0.5*0.5*9.81*way^2)' 'S.Solid.pos.y - 0.5'
    all_below 0.02
    at a.st4 '[2, 2.5, 3]' 'S.OnTable.pos - <0, 1.5, -20>' 'S.Ring.pos - <9, 0.1, 0>'
    all_below 0.01
    at a.st4 '[3]' 'S.Tip.pos.y'
    below "$(cut -d' ' -f2 <<<"$out")" 0.25 # it has fallen on its side
    at a.st4 '0..3 by 0.5' 'S.Roller.pos - <t, 0.25, 20>'
    all_below 0.01
    # A ton for each cubic metre; round means 48 corners, which take 0.3 % away.
    at a.st4 '0..1 by 0.1' 'Drop.Box.pos.x - 9 - t^2/2'
    all_below 1e-4
    at a.st4 '0..1 by 0.1' 'Drop.Cone.pos.y - t^2/2/(pi*4/3*0.99715)'
    all_below 1e-4
}

# Copies of defs, groups, loops and choices, scaled or not; what is scaled is a hull.
test_rigid_bodies_of_defs() {
    cat >a.st4 <<'END'
film { frames = 1..48 }
def Wheel(r = 0.3) {
  cylinder { from = <0, 0, -0.1>  to = <0, 0, 0.1>  radius = r }
  for i in 0..2 { box { size = <0.05, r, 0.25>  rotate z, 60deg*i } }
  lamp { power = 3 }
}
def Cart {
  scale 2
  Wheel { translate <0.5, 0, 0> }
  group { translate <-0.5, 0, 0>  Wheel { rotate z, 20deg } }
}
sim rigid S {
  fixed { plane { } }
  fixed { for k in 0..3 { quad { size = <4, 0.2>  rotate y, 90deg*k  translate <20, 0.1, 0> } } }
  body Wheel { Wheel { }  translate 0.5*y }
  body Cross { for k in 0..1 { box { size = <1, 0.1, 0.1>  rotate y, 90deg*k } }  if true { sphere { radius = 0.2 } }  translate <3, 2, 0> }
  body Cart { Cart { }  translate <6, 1, 0> }
  body Egg { sphere { scale <1, 0.5, 1> }  translate <9, 1, 0> }
}
END
    at a.st4 '[1.9]' 'S.Wheel.pos - 0.3*y' 'S.Cross.pos - <3, 0.2, 0>' 'S.Cart.pos - <6, 0.6, 0>' 'S.Egg.pos.y - 0.5'
    all_below 2e-3
    sed 's/body Wheel { Wheel { }/body Wheel { instance Wheel { speed = 2 }/' a.st4 >b.st4
    expect 1 "$ST4" sim b.st4
    has "$err" 'has no clock of its own'
}

a_pile() {
    cat >pile.st4 <<'END'
film { size = <48, 27>  frames = 1..72 }
camera { from = <0, 1.6, 5>  to = <0, 0.8, 0> }
sim rigid Pile {
  step = 1/480  span = 0..3  seed = 7
  fixed Floor { plane { } }
  for i in 0..5 {
    body Crate[i] {
      box { size = <0.3, 0.3, 0.3> }
      density = 400  bounce = 0.2  friction = 0.6
      translate <0.1*rand(1, i), 0.5 + 0.4*i, 0>
    }
  }
}
for i in 0..5 { box Crate[i] { size = <0.3, 0.3, 0.3>  pose = Pile.Crate[i] } }
END
}

test_rigid_frames_in_any_order() {
    a_pile
    expect 0 "$ST4" render pile.st4 -f 30-33 -s 2 -o 'all.##.exr' --cache one
    expect 0 "$ST4" render pile.st4 -f 33 -s 2 -j 1 -o 'alone.##.exr' --cache two
    expect 0 "$ST4" compare all.33.exr alone.33.exr --metric max --fail-above 0
    same one/*.sim two/*.sim
    # Two that start at once, with nothing kept yet.
    "$ST4" render pile.st4 -f 33 -s 2 -q -o 'a.##.exr' --cache both & \
        "$ST4" render pile.st4 -f 33 -s 2 -q -o 'b.##.exr' --cache both
    wait
    same a.33.exr b.33.exr
    same both/*.sim one/*.sim
    expect 0 "$ST4" compare all.33.exr a.33.exr --metric max --fail-above 0
    # What lies still is stored once; a pose puts the shape where the body is.
    at pile.st4 '[0, 3]' 'Pile.Crate[2].pos.y'
    expect 0 "$ST4" mesh pile.st4 --at 0 --label 'Crate[2]' -o out.ply
    expect 0 "$ST4" sim pile.st4 --cache one
    below "$(awk '{ print $4 }' <<<"$out")" 600
}

# heap.st4: so many layers of side x side boxes, each turned its own way, fall in a heap.
a_heap() {
    cat >heap.st4 <<END
sphere { }
let side = $1
let n = $1*$1*$2
sim rigid Heap {
  span = 0..10  step = 1/240
  fixed { plane { } }
  if $3 {
    for k in 0..3 {
      fixed { box { size = <0.2, 8, 8> }  translate <-0.25*side, 2, 0>  rotate y, 90deg*k }
    }
  }
  for i in 0..(n - 1) {
    let column = i % side
    let row = floor(i/side) % side
    body Box[i] {
      box { size = <0.3, 0.3, 0.3> }
      friction = 0.6
      rotate y, 360deg*rand(4, i)
      translate 0.45*<column - (side - 1)/2, 0, row - (side - 1)/2>
      translate <0.04*rand(1, i), 0.3 + 0.4*floor(i/side^2), 0.04*rand(2, i)>
    }
  }
}
END
}

# From 5 s to 10 s no box of the heap moves by a millimetre, or lies below the floor.
heap_lies_still() {
    local i
    local -a moves=()
    for ((i = 0; i < $1; i++)); do
        moves+=("length(Heap.Box[$i].pos - at(Heap.Box[$i].pos, 5s))" "max(0, 0.148 - Heap.Box[$i].pos.y)")
    done
    at heap.st4 '[6, 8, 10]' "${moves[@]}"
    all_below 1e-3
}

test_rigid_heap_comes_to_rest() {
    a_heap 5 4 false
    heap_lies_still 100
    [ -n "${STRESS-}" ] || return 0
    a_heap 10 10 true
    heap_lies_still 1000
}

# What sleeps wakes when it is hit, when it is pushed, over others too, and when its ground moves.
test_rigid_sleepers_wake() {
    cat >a.st4 <<'END'
sphere { }
sim rigid S {
  span = 0..6  step = 1/480
  fixed { plane { } }
  for i in 0..1 { body Box[i] { box { size = <0.4, 0.4, 0.4> }  translate <0.4*i, 0.2, 0> } }
  body Pusher {
    box { size = <0.4, 0.4, 0.4> }
    force = <600*max(0, t - 2), 0, 0>
    translate <-0.4, 0.2, 0>
  }
  body Target { box { size = <0.4, 0.4, 0.4> }  friction = 0.1  translate <0, 0.2, 5> }
  body Ball { sphere { radius = 0.2 }  vel = <-2, 0, 0>  spin = <0, 0, 10>  translate <6, 0.2, 5> }
  for i in 0..2 { body Row[i] { box { size = <0.4, 0.4, 0.4> }  friction = 0.1  translate <0.4*i, 0.2, 10> } }
  body Fast { sphere { radius = 0.2 }  vel = <3, 0, 0>  spin = <0, 0, -15>  translate <-8, 0.2, 10> }
  fixed Lift { box { size = <1, 0.2, 1> }  translate <0, 0.9 - 0.05*max(0, t - 2), -5> }
  body Rider { box { size = <0.4, 0.4, 0.4> }  translate <0, 1.2, -5> }
}
END
    at a.st4 '[1.5, 2]' 'S.Box[0].pos.x' 'S.Box[1].pos.x - 0.4' 'S.Target.pos.x' 'S.Rider.pos.y - 1.2'
    all_below 1e-3
    at a.st4 '[2.5, 4, 5.9]' 'S.Rider.pos.y - (1.2 - 0.05*(t - 2))' 'S.Rider.pos.x'
    all_below 2e-3
    at a.st4 '[6]' 'S.Box[0].pos.x' 'S.Target.pos.x' 'S.Row[2].pos.x'
    below 1 "$(cut -d' ' -f2 <<<"$out")"
    below "$(cut -d' ' -f3 <<<"$out")" -0.1
    below 0.83 "$(cut -d' ' -f4 <<<"$out")"
}

test_rigid_mistakes() {
    local start="sphere { } sim rigid S {" body='body B { sphere { } } }'
    refused() {
        printf '%s\n' "$1" >a.st4
        expect 1 "$ST4" sim a.st4 --color never
        has "$err" "$2"
    }
    refused "$start step = 0  $body" 'step is more than 0'
    refused "$start span = 0..1e6  step = 1ms  $body" 'this takes 1e+09 steps'
    refused "$start span = 0..2  body B { sphere { } force = t > 1s ? <0/0, 0, 0> : <1, 0, 0> } }" \
        'S.B: at t = 1.00104 s its force is not a finite number'
    refused "$start span = 0..2  body A { box { } } body B { sphere { } mass = 1kg force = <1e9, 0, 0> translate <5, 0, 0> } }" \
        'S.B: at t = 0.00208333 s it runs away'
    refused "$start body B { } }" 'a body needs a shape'
    refused "$start body { box { } } }" 'a body needs a label'
    refused "$start body B { box { size = <1, 0, 1> } } }" 'a size above 0'
    refused "$start body B { box { } scale 2 } }" 'can not be scaled'
    refused "$start body B { box { } translate <t, 0, 0> } }" 'can not depend on t'
    refused "$start body B { points { at = [x] } } }" 'points are no shape of a rigid body'
    refused "$start body B { torus { minor = 0 } } }" 'a size above 0'
    refused "$start body B { torus { minor = 0.1 + 0.1*t } } }" 'keeps its form: it can not depend on t'
    refused "$start body B[0] { disc { } } }" 'S.B[0]: at t = 0 s its surface has holes: 48 of its edges are not'
    refused "$start body B { convex = true disc { } } }" 'S.B: at t = 0 s its shape is flat'
    refused "$start body B { mesh { points = [0*x, x, y, z] faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3]] } } }" \
        'its surface has holes: 3 of its edges are not'
    refused "$start body B { plane { } } }" 'a plane of a sim rigid stands still'
    refused "$start body B[1] { box { } } }" 'numbered 0, 1, 2'
    refused "$start body B { box { } } joint hinge J { a = C } }" "no body is called 'C'"
    refused "$start body B { box { } } joint hinge { a = B[\"x\"] } }" 'index is a number, this is a string'
    refused "$start body B { box { } } joint hinge J[t] { a = B } }" "index must be known"
    refused "$start body B { box { } } joint hinge { a = B  range = -1..1 } }" 'goes from an angle to another'
    refused "$start body B { box { } } joint hinge { a = B  range = 10deg..90deg } }" '0 is in it'
    refused "$start body B { box { } } joint hinge { a = B  range = 0deg..200deg } }" 'less than half a turn'
    refused "$start body B { box { } } joint slider { a = B  range = -1deg..1deg } }" 'goes from a length to another'
    refused "$start body B { box { } } joint ball { a = B  strength = 1 } }" 'belongs to a hinge or a slider'
    refused "$start body B { box { } } joint hinge { a = B  speed = 1 } }" 'is nothing without strength'
    refused "$start body B { box { } } joint hinge { a = B  strength = t } }" 'must be known'
    refused "$start body B { box { } } joint hinge { a = B  range = 6 } }" 'range'
    refused "$start body B { box { } } joint hinge { a = B  b = B } }" 'its a and b are the same'
    refused "$start fixed F { box { } } body B { box { } } joint ball { a = F } }" "this one's are fixed"
    refused "$start body B { box { } } joint slider { a = B  axis = 0*x } }" '<0, 0, 0> is none'
    refused "$start span = 0..2  body B { box { } } joint hinge { a = B  strength = 1  speed = (0.5 - t)^0.5 } }" \
        'S: at t = 0.5 s the speed of the joint of B is not a finite number'
    refused "$start span = 0..2  fixed F[2] { box { } translate y*(0.5 - t)^0.5 } body B { box { } translate 9*x } }" \
        "numbered 0, 1, 2"
    refused "$start span = 0..2  fixed F { box { } translate y*(0.5 - t)^0.5 } body B { box { } translate 9*x } }" \
        'the place of the fixed body F is not finite'
    refused "$start fixed { box { } scale 1 + t } body B { box { } } }" 'can not be scaled'
    refused "$start body B { box { } } joint hing J { a = B } }" 'there is no joint hing'
    refused "$start fixed { plane { } } }" 'no bodies that move'
    refused "$start box { } }" 'holds body, fixed and joint'
    refused "$start $body sphere { pose = S.C }" "S has no member 'C'"
    refused "$start $body sphere { pose = 3 }" 'pose is a transform'
    refused "$start $body sphere { radius = S.B.speed }" 'a transform has .pos, .vel, .turn and .spin'
}
