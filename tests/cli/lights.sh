# SPDX-License-Identifier: Apache-2.0
# Skies from files and functions.

# A sky alone, from the file named.
sky_scene() {
    cat <<END
film { size = <16, 8> }
camera { from = <0, 0, 5>  to = <0, 0, 9>  fov = 60deg }
sphere { radius = 0.001  translate <0, -1000, 0> }
sky { $1 }
END
}

test_sky_images_have_their_curve() {
    sky_scene 'color = <0.25, 0.5, 0.125>' >plain.st4
    expect 0 "$ST4" plain.st4 -s 4 -q -o sky.png -o sky.exr
    printf '#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\100\200\040\200\100\200\040\200' >sky.hdr
    local kind
    for kind in png exr hdr; do
        sky_scene "image = \"sky.$kind\"" >from.st4
        expect 0 "$ST4" from.st4 -s 4 -q -o "from-$kind.exr"
        # 8 bits are half a step off at most.
        expect 0 "$ST4" compare "from-$kind.exr" sky.exr --metric max --fail-above 0.003
    done
}

test_sky_images_that_can_not_be_read() {
    sky_scene 'image = "missing.exr"' >missing.st4
    expect 3 "$ST4" check missing.st4 --color never
    has "$err" "missing.st4:4:15: error: "
    has "$err" "missing.exr"
    echo 'no picture' >bad.png
    head -c 200 /dev/zero >bad.exr
    local kind
    for kind in png exr; do
        sky_scene "image = \"bad.$kind\"" >bad.st4
        expect 3 "$ST4" check bad.st4 --color never
        has "$err" "bad.st4:4:15: error: cannot take "
        has "$err" "bad.$kind' for a sky: "
    done
    sky_scene 'image = "bad.png"  color = <1, 1, 1>' >both.st4
    expect 1 "$ST4" check both.st4 --color never
    has "$err" "a sky has a color, a gradient or an image, not two of them"
}

# Radiance a + b height gives a surface that faces up as much as a + 2/3 b everywhere.
test_sky_gradients_give_their_light() {
    cat >ground.st4 <<'END'
film { size = <8, 8> }
camera { from = <0, 5, 0>  to = <0, 0, 0>  up = <0, 0, -1>  fov = 20deg }
render { bounces = 0 }
plane { material = matte(<0.5, 0.5, 0.5>) }
END
    { cat ground.st4; echo 'sky { fn gradient(height) = <0.3, 0.2, 0.1> + 0.6*height*<1, 1, 1> }'; } >ramp.st4
    { cat ground.st4; echo 'sky { color = <0.7, 0.6, 0.5> }'; } >even.st4
    { cat ground.st4; echo 'sky { power = 2  fn gradient(dir) = <0.15, 0.1, 0.05> + <1, 1, 1>*max(0.3*dot(dir, y), 0) }'; } >other.st4
    expect 0 "$ST4" ramp.st4 -s 256 -q -o ramp.exr
    expect 0 "$ST4" even.st4 -s 4 -q -o even.exr
    expect 0 "$ST4" other.st4 -s 256 -q -o other.exr
    expect 0 "$ST4" compare ramp.exr even.exr --metric rmse --fail-above 0.003
    expect 0 "$ST4" compare other.exr even.exr --metric rmse --fail-above 0.003
}

# info says that light samples are left out just where the statistics count none.
test_info_knows_lights_with_an_extent() {
    local light n
    while IFS='|' read -r n light; do
        echo "film { size = <8, 8>  frames = 1..24 }  sphere {}  $light" >light.st4
        expect 0 "$ST4" light.st4 -f 12 -s 4 -q -o light.exr --stats light.json
        expect 0 "$ST4" info light.st4
        if [ "$n" = none ]; then
            has "$out" 'no light but the sky has an extent'
            grep -q '"light": *0[,}]' light.json || fail "$light: $(cat light.json)"
        else
            lacks "$out" 'has an extent'
            grep -q '"light": *[1-9]' light.json || fail "$light: $(cat light.json)"
        fi
    done <<'END2'
none|
none|lamp { from = <0, 0, 9>  power = 100*t }
none|sun { angle = 0deg }
some|sun {}
some|lamp { from = <0, 3, 5>  radius = 0.1 }
some|lamp { from = <0, 3, 5>  radius = 0.1  power = 100*t }
some|lamp { from = <0, 3, 5>  radius = 0.2*t }
some|lamp { from = <0, 3, 5>  radius = 0.2  cone = 90deg  dir = <0, -3, t - 5> }
some|area { from = <0, 3, 5>  power = 100*t }
END2
}
