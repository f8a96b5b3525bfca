# SPDX-License-Identifier: Apache-2.0
# Pictures on surfaces: found, read, the same for any threads; nothing of them where there are none.

# picture.png, 32 x 16 pixels: a red left half, a green right half.
make_picture() {
    cat >picture.st4 <<'END'
film { size = <32, 16> }
camera { from = <0, 0, 5>  to = <0, 0, 0>  kind = orthographic  fov = 11.4deg }
sky { color = <0, 0, 0> }
quad { size = <2, 1>  material = glow(u < 0.5 ? <0.8, 0, 0> : <0, 0.5, 0>) }
END
    expect 0 "$ST4" picture.st4 -s 64 -o picture.png -q
}

scene() {
    cat >textured.st4
}

test_textures_show_their_picture() {
    make_picture
    sed 's/glow(.*)/glow(image("picture.png", <u, v>))/' picture.st4 >textured.st4
    expect 0 "$ST4" picture.st4 -s 64 -o own.exr -q
    expect 0 "$ST4" textured.st4 -s 64 -o textured.exr -q
    expect 0 "$ST4" compare own.exr textured.exr --metric rmse --fail-above 0.05
    sed -i 's/<u, v>/<1 - u, v>/' textured.st4
    expect 0 "$ST4" textured.st4 -s 64 -o turned.exr -q
    expect 1 "$ST4" compare own.exr turned.exr --metric rmse --fail-above 0.3
}

test_textures_same_bytes_for_any_threads() {
    make_picture
    scene <<<'film { size = <64, 40> }
sphere { material = gloss(image("picture.png", <4*u, 2*v>), rough = image("picture.png", <u, v>, raw = true).x,
                          bump = 0.02*image("picture.png", <8*u, 8*v>).y, opacity = image_alpha("picture.png", <u, v>))
         translate <0.5*t, 1, 0> }
plane { material = mix(matte(image("picture.png", <p.x, p.z>)), glass(), 0.2) }
sun { angle = 2deg }
sky { }'
    local n
    for n in 1 2 5; do
        expect 0 "$ST4" textured.st4 -s 8 -j "$n" -o "$n.exr" -q
    done
    same 1.exr 2.exr
    same 1.exr 5.exr
    expect 0 "$ST4" textured.st4 -s 8 -o little.exr -q --memory 8M
    same 1.exr little.exr
    expect 0 "$ST4" depends textured.st4
    has "$out" picture.png
}

test_textures_say_what_is_missing() {
    scene <<<'sphere { material = matte(image("nothing.png", <u, v>)) }'
    expect 3 "$ST4" check textured.st4 --color never
    has "$err" 'textured.st4:1:'
    has "$err" nothing.png
    echo 'this is no picture' >text.png
    scene <<<'sphere { material = matte(image("text.png", <u, v>)) }'
    expect 3 "$ST4" check textured.st4 --color never
    has "$err" 'cannot read'
    make_picture
    head -c 80 picture.png >cut.png
    scene <<<'sphere { material = matte(image("cut.png", <u, v>)) }'
    expect 3 "$ST4" check textured.st4 --color never
    has "$err" 'cannot read'
    scene <<<'sphere { material = matte(image("picture.png", p)) }'
    expect 1 "$ST4" check textured.st4 --color never
    has "$err" "'uv' is a vector of 2, this is a vector of 3"
}

test_textures_cost_nothing_without_any() {
    echo 'sphere { material = glass() }  sun { }' >plain.st4
    LD_DEBUG=files LD_DEBUG_OUTPUT=libraries "$ST4" plain.st4 --size 8x8 -s 1 -o plain.exr -q ||
        fail "status $?"
    ! grep -qiE 'OpenImageIO|st4-image' libraries.* || fail 'an image library was loaded'
    make_picture
    scene <<<'sphere { material = matte(image("picture.png", <u, v>)) }'
    rm libraries.*
    LD_DEBUG=files LD_DEBUG_OUTPUT=libraries "$ST4" textured.st4 --size 8x8 -s 1 -o t.exr -q ||
        fail "status $?"
    grep -q 'st4-image' libraries.* || fail 'the texture was not looked at'
}
