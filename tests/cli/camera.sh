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
