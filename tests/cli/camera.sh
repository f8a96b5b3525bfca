# SPDX-License-Identifier: Apache-2.0
# Camera and shutter as a script gives them: what they cost, what they default to, what they show.

# samples FILE KIND: how many were drawn, by the statistics.
samples() {
    sed -nE "s/.*\"samples\": *\{[^}]*\"$2\": *([0-9]+).*/\1/p" <(tr -d '\n' <"$1")
}

scene_of_a_ball() {
    cat <<END
film { size = <32, 24> }
camera { from = <0, 0, 4>  to = <0, 0, 1>  $1 }
sphere {}
END
}

test_pinholes_draw_no_lens_samples() {
    local camera
    for camera in '' 'aperture = 0' 'blades = 6  focus = 2 + t' 'shift = <0.1, 0>'; do
        scene_of_a_ball "$camera" >pinhole.st4
        expect 0 "$ST4" pinhole.st4 -s 4 -o pinhole.exr --stats pinhole.json
        [ "$(samples pinhole.json lens)" = 0 ] || fail "$camera: lens samples"
        [ "$(samples pinhole.json time)" = 0 ] || fail "$camera: time samples"
        expect 0 "$ST4" info pinhole.st4
        has "$out" 'the camera is a pinhole'
    done
    scene_of_a_ball 'aperture = 10cm' >lens.st4
    expect 0 "$ST4" lens.st4 -s 4 -o lens.exr --stats lens.json
    [ "$(samples lens.json lens)" = $((32 * 24 * 4)) ] || fail 'no sample for each ray'
    [ "$(samples lens.json time)" = 0 ] || fail 'time samples for a lens that stands still'
    expect 0 "$ST4" info lens.st4
    lacks "$out" 'the camera is a pinhole'
}

# An aperture that opens within the shutter: rays before it draw none.
test_lens_that_opens() {
    {
        scene_of_a_ball 'aperture = t < 0 ? 0 : 0.1'
    } >opens.st4
    expect 0 "$ST4" opens.st4 -s 64 -o opens.exr --stats opens.json
    [ "$(samples opens.json lens)" = $((32 * 24 * 32)) ] || fail 'half of the rays have a lens'
}

test_focus_is_at_to() {
    scene_of_a_ball 'aperture = 30cm' >default.st4
    scene_of_a_ball 'aperture = 30cm  focus = 3' >given.st4
    scene_of_a_ball 'aperture = 30cm  focus = 5' >other.st4
    for camera in default given other; do
        expect 0 "$ST4" $camera.st4 -s 4 -o $camera.exr
    done
    expect 0 "$ST4" compare default.exr given.exr --fail-above 0
    expect 1 "$ST4" compare default.exr other.exr --fail-above 0.001
    # Where the camera's group grows, so does the distance.
    cat >group.st4 <<'END'
film { size = <32, 24> }
group { scale 2  camera { from = <0, 0, 2>  to = <0, 0, 0.5>  aperture = 30cm } }
sphere {}
END
    expect 0 "$ST4" group.st4 -s 4 -o group.exr
    expect 0 "$ST4" compare group.exr given.exr --fail-above 0
}

test_lens_out_of_range_is_warned_of() {
    scene_of_a_ball 'aperture = 10cm  focus = t' >focus.st4
    expect 0 "$ST4" focus.st4 -s 16 -o focus.exr
    has "$err" 'focus that is not above it'
    has "$err" 'not-finite'
}

test_spherical_camera_sees_all_around() {
    cat >around.st4 <<'END'
film { size = <32, 16> }
camera { kind = spherical  from = <0, 0, 0>  to = <0, 0, -1> }
sky { color = <0, 0, 0> }
sphere { radius = 10  material = glow(<1, 1, 1>, 0.5) }
END
    sed 's/^sphere.*//; s/<0, 0, 0> }/<0.5, 0.5, 0.5> }/' around.st4 >sky.st4
    expect 0 "$ST4" around.st4 -s 4 -o around.exr
    expect 0 "$ST4" sky.st4 -s 4 -o sky.exr
    expect 0 "$ST4" compare around.exr sky.exr --fail-above 0.0001
}

# mistake SCRIPT MESSAGE: the script is refused so.
mistake() {
    echo "$1" >mistake.st4
    expect 1 "$ST4" check mistake.st4
    has "$err" "$2"
    errors "$err" 1
}

test_lens_mistakes() {
    mistake 'camera { kind = spherical  shift = <0.1, 0> }' \
        'mistake.st4:1:28: error: a spherical camera sees all directions, it has no shift'
    mistake 'camera { aperture = 1cm  blades = 2 }' 'an aperture has at least 3 blades, this is 2'
    mistake 'camera { aperture = -1cm }' 'aperture is at least 0, this is -0.01'
    mistake 'camera { aperture = 1cm  focus = 0m }' 'focus is more than 0, this is 0'
    mistake 'camera { aperture = 90deg }' 'aperture is a length, this is an angle'
    mistake 'camera { shift = 0.5 }' 'write <0.5, 0.5>'
}

test_shutter_mistakes() {
    mistake 'shutter { fn curve(x) = x - 0.5 }' \
        'mistake.st4:1:11: error: curve is at least 0, this is -0.5 at x = 0'
    mistake 'shutter { fn curve(x) = 0 }' 'curve is 0 everywhere: no light would fall on the film'
    mistake 'shutter { fn curve(x) = 1/x }' 'curve is not a finite number at x = 0'
    mistake 'shutter { fn curve(x) = noise(9000*x) + 1 }' 'curve changes too fast'
    mistake 'shutter { fn curve(x) = x*t }' 'curve can not depend on t'
    mistake 'shutter { fn curve(s) = s }' 'it may take: x'
    mistake 'shutter { curve = cosin }' 'did you mean cosine?'
    mistake 'shutter { curve = 3 }' 'it is one of: box cosine trapezoid(a, b), or a function of x'
    mistake 'shutter { curve = trapezoid(0.2, 0.9) }' 'these are 0.2 and 0.9'
    mistake 'shutter { roll = down }' "a shutter that rolls needs 'readout'"
    mistake 'shutter { readout = 2ms }' 'readout is of a shutter that rolls'
    mistake 'shutter { fn delay(u, v) = 1/(u - 0.5/640) }' \
        'delay is not finite, or more than 1e15 frames, at u = 0.00078125, v = 0.00104167'
    mistake 'shutter { length = 1e20 }' 'the shutter opens, closes or is read out more than 1e15 frames away'
    mistake 'shutter { length = 1e300 }' 'more than 1e15 frames away'
    mistake 'shutter { angle = 1e22deg }' 'more than 1e15 frames away'
    mistake 'shutter { length = 1e6 }  sphere { translate <t, 0, 0> }' 'more than a million frames'
    mistake 'shutter { fn delay(u, v) = 3deg }' 'delay gives a time, this is an angle'
    mistake 'shutter { fn delay(u, v) = t }' 'delay can not depend on t'
    mistake 'shutter { delay = 5ms }' 'write fn delay(u, v) = ...'
}

# The words are functions that one could write; a curve may have any size, and be named before.
test_curves_are_functions() {
    local name script
    while IFS='|' read -r name script; do
        echo "film { size = <32, 8> } shutter { angle = 360deg  $script } sphere { translate 20*t*x }
            let soft = trapezoid(0.25, 0.5)  print(soft(0.125))" >"$name.st4"
        expect 0 "$ST4" "$name.st4" -s 16 -o "$name.exr"
        has "$out$err" 0.5
    done <<'END'
none|phase = center
box|curve = box
one|fn curve(x) = 7
soft|curve = soft
ramps|fn curve(x) = 100*min(1, min(x/0.25, (1 - x)/0.5))
cosine|curve = cosine
sine|fn curve(x) = sin(x*180deg)
END
    expect 0 "$ST4" compare none.exr box.exr --fail-above 0
    expect 0 "$ST4" compare none.exr one.exr --fail-above 1e-6
    expect 0 "$ST4" compare soft.exr ramps.exr --fail-above 1e-6
    expect 0 "$ST4" compare cosine.exr sine.exr --fail-above 1e-6
    expect 1 "$ST4" compare cosine.exr box.exr --metric max --fail-above 0.01
}

# A light that is there for 5 ms of the 1/48 s gives 5 ms' worth.
test_strobe_of_5_ms_gives_its_share() {
    strobe() {
        cat <<END
film { size = <8, 8> }
shutter { angle = 180deg  phase = start }
camera { from = <0, 3, 0>  to = <0, 0, 0>  up = z }
sun { dir = y  angle = 0deg  $1 }
plane { material = matte(<0.5, 0.5, 0.5>) }
END
    }
    strobe 'power = 10  visible = t >= 8ms and t < 13ms' >visible.st4
    strobe 'power = t >= 8ms and t < 13ms ? 10 : 0' >power.st4
    strobe 'power = 10*0.24' >steady.st4 # 5 ms of 20.8333 ms
    for scene in visible power steady; do
        expect 0 "$ST4" $scene.st4 -s 1000 -o $scene.exr
    done
    expect 0 "$ST4" compare visible.exr power.exr --fail-above 0
    # The sun's 2.4 W/m2 leave 0.382; a sample in a thousand is 0.0016.
    expect 0 "$ST4" compare visible.exr steady.exr --fail-above 0.0035
}

# What each pixel sees does not depend on threads, nor on how many frames are sampled together, and
# what deforms is where what moves as a whole is: no ray asks for a time that was not sampled.
rolling_scene() {
    cat <<END
film { size = <40, 30>  frames = 1..5 }
shutter { angle = 90deg  curve = cosine  roll = left  readout = 1.5f  fn delay(u, v) = 3f*v*v - 1f }
camera { from = <0, 0, 6>  to = <0, 0, 0>  aperture = 5cm  blades = 5 }
sun { dir = <1, 2, 3> }
surface {
  u = -1..1  v = -1..1  res = <4, 4>
  fn at(u, v) = <u, v, 0>
  $1
}
END
}

test_delays_are_sampled_whatever_the_block() {
    rolling_scene 'fn deform(p) = p + <3*sin(2turn*t), sin(3turn*t), 0>' >deforms.st4
    rolling_scene 'translate <3*sin(2turn*t), sin(3turn*t), 0>' >moves.st4
    expect 0 "$ST4" deforms.st4 -s 32 -j 1 -o 'all.####.exr' --validate
    expect 0 "$ST4" deforms.st4 -s 32 -j 5 -o 'few.####.exr' --memory 1M
    expect 0 "$ST4" deforms.st4 -s 32 -j 2 -f 3 -o one.exr
    expect 0 "$ST4" moves.st4 -s 32 -f 3 -o moves.exr
    for n in 1 2 3 4 5; do
        expect 0 "$ST4" compare all.000$n.exr few.000$n.exr --fail-above 0
    done
    expect 0 "$ST4" compare all.0003.exr one.exr --fail-above 0
    expect 0 "$ST4" compare one.exr moves.exr --metric rmse --fail-above 0.02
    expect 0 "$ST4" info deforms.st4
    has "$out" 'delayed   by'
}

# At an instant shutter without motion a delay costs nothing.
test_delays_are_free_where_nothing_moves() {
    echo 'film { size = <32, 24> } shutter { roll = down  readout = 3f  curve = cosine } sphere {}' \
        >still.st4
    echo 'film { size = <32, 24> } sphere {}' >plain.st4
    expect 0 "$ST4" still.st4 -s 4 -o still.exr --stats still.json
    expect 0 "$ST4" plain.st4 -s 4 -o plain.exr
    [ "$(samples still.json time)" = 0 ] || fail 'time samples'
    expect 0 "$ST4" compare still.exr plain.exr --fail-above 0
}
