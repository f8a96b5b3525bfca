# SPDX-License-Identifier: Apache-2.0
# What pictures show: the examples, and a blade that is everywhere within a frame.

test_examples_render() {
    local scene name
    for scene in "$ROOT"/examples/*.st4; do
        name=$(basename "$scene" .st4)
        expect 0 "$ST4" "$scene" --size 40x30 -s 2 -f 1-2 -o "$name.####.exr" --validate
        lacks "$err" 'warning:'
        [ -s "$name.0001.exr" ] && [ -s "$name.0002.exr" ] || fail "$name: no pictures"
        expect 0 "$ST4" info "$name.0002.exr"
        has "$out" 40x30
    done
}

test_pictures_for_the_eye() {
    expect 0 "$ST4" "$ROOT/examples/hello.st4" --size 40x30 -s 2 -f 1 -o eye.png
    [ "$(head -c 4 eye.png | tail -c 3)" = PNG ] || fail 'not a PNG'
}

test_bunny_takes_a_mesh() {
    cat >tetrahedron.obj <<'END'
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
END
    expect 0 "$ST4" "$ROOT/examples/bunny.st4" -D model=tetrahedron.obj --size 40x30 -s 2 -f 3 \
        -o mesh.exr
    expect 0 "$ST4" "$ROOT/examples/bunny.st4" --size 40x30 -s 2 -f 3 -o own.exr
    expect 0 "$ST4" compare mesh.exr own.exr
    expect 1 "$ST4" compare mesh.exr own.exr --fail-above 0.001
}

# The blade covers a ninth of the circle. Turning evenly, it is at every place of the ring for a
# ninth of the time, so its blur is a ring that shines a ninth as bright, drawn here without motion.
test_blade_turning_twice_a_frame_is_a_disc() {
    cat >blade.st4 <<'END'
film { size = <48, 48> }
shutter { angle = 360deg  phase = start }
camera { from = <0, 0, 5>  fov = 28deg  kind = orthographic }
sky { color = <0, 0, 0> }
param from = 0deg
surface {
  u = 0.2..1  v = -20deg..20deg  res = <4, 16>
  fn at(u, v) = <-u*sin(v), u*cos(v), 0>
  material = glow(<1, 1, 1>, 1)
  rotate z, from + 2turn * 24 * t
}
END
    cat >ring.st4 <<'END'
film { size = <48, 48> }
shutter { length = 0s }
camera { from = <0, 0, 5>  fov = 28deg  kind = orthographic }
sky { color = <0, 0, 0> }
surface {
  u = 0.2..1  v = 0turn..1turn  res = <4, 144>
  fn at(u, v) = <-u*sin(v), u*cos(v), 0>
  material = glow(<1, 1, 1>, 1/9)
}
END
    expect 0 "$ST4" blade.st4 -s 1024 -o blade.exr
    expect 0 "$ST4" blade.st4 -s 1024 -D from=70deg -o turned.exr
    expect 0 "$ST4" blade.st4 -s 64 --shutter 0 -o sharp.exr
    expect 0 "$ST4" ring.st4 -s 1024 -Wno-zero-shutter -o ring.exr
    expect 0 "$ST4" compare blade.exr ring.exr --metric rmse --fail-above 0.002
    expect 0 "$ST4" compare turned.exr ring.exr --metric rmse --fail-above 0.002
    expect 1 "$ST4" compare sharp.exr ring.exr --metric rmse --fail-above 0.1
}

# A jump within the frame is no motion to sample finely, also where the first copies are left out.
test_baked_copies_jump() {
    cat >jump.st4 <<'END'
film { size = <32, 32> }
shutter { angle = 360deg  phase = start }
camera { from = <0, 0, 5> }
param least = 0
for i in 0..2 {
  surface {
    visible = i > least  bake = true  res = <2, 2>
    fn at(u, v) = <u - 0.5, v - 0.5, 0>
    fn deform(p) = p + (t < 0.3/24 ? <0, 0, 0> : <1, 0, 0>)
  }
}
END
    local least
    for least in -1 0 1; do
        expect 0 "$ST4" jump.st4 -D least=$least -s 1 -Werror -o jump.exr
    done
}

test_compare_measures() {
    cat >even.st4 <<'END'
film { size = <16, 16> }
param shade = 0.5
sky { color = <shade, shade, shade> }
sphere { radius = 0.001  translate <0, -1000, 0> }
camera { from = <0, 0, 5>  to = <0, 0, 9> }
END
    expect 0 "$ST4" even.st4 -s 4 -o a.exr -q
    expect 0 "$ST4" even.st4 -s 4 -o b.exr -q -D shade=0.625
    expect 0 "$ST4" compare a.exr a.exr --fail-above 0
    expect 0 "$ST4" compare a.exr b.exr --metric rmse --fail-above 0.1251
    expect 1 "$ST4" compare a.exr b.exr --metric rmse --fail-above 0.1249
    expect 0 "$ST4" compare a.exr b.exr --metric mse --fail-above 0.01563
    expect 1 "$ST4" compare a.exr b.exr --metric max --fail-above 0.1249
    expect 3 "$ST4" compare a.exr missing.exr
    expect 0 "$ST4" even.st4 -s 4 -o small.exr -q --size 8x8
    expect 3 "$ST4" compare a.exr small.exr
}

test_statistics_are_json() {
    expect 0 "$ST4" "$ROOT/examples/head.st4" --size 32x32 -s 2 -f 12 -o head.exr --stats stats.json
    grep -q '"version"' stats.json || fail "$(cat stats.json)"
    # Braces, brackets and quotes are in pairs: what a reader of JSON trips over first.
    local mark
    for mark in '{ }' '[ ]'; do
        [ "$(tr -cd "${mark% *}" <stats.json | wc -c)" = "$(tr -cd "${mark#* }" <stats.json | wc -c)" ] ||
            fail "unbalanced $mark: $(cat stats.json)"
    done
    lacks "$(cat stats.json)" nan
    lacks "$(cat stats.json)" inf
}

# Two of the three things are out of sight.
test_what_no_ray_meets_is_not_built() {
    cat >far.st4 <<'END'
film { size = <32, 24> }
camera { from = <0, 1, 6> to = <0, 0, 0> }
sun { dir = <1, 2, 1> }
torus { major = 1 minor = 0.3 rotate x, t*90deg }
torus { major = 1 minor = 0.25 translate <0, 0, 900> }
box { translate <0, 200, 0> }
END
    local threads
    for threads in 1 2 5; do
        expect 0 "$ST4" far.st4 -q -s 4 -j $threads -o "$threads.exr" --stats stats.json
        grep -q '"structures": 3,' stats.json || fail "$(grep structures stats.json)"
        grep -q '"unbuilt": 2,' stats.json || fail "$(grep unbuilt stats.json)"
    done
    expect 0 "$ST4" far.st4 -q -s 4 -o all.exr --validate --stats stats.json
    grep -q '"unbuilt": 0,' stats.json || fail "$(grep unbuilt stats.json)"
    cmp 1.exr 2.exr && cmp 1.exr 5.exr && cmp 1.exr all.exr || fail 'the pictures differ'
}

test_subframes_share_the_samples() {
    local scene=$ROOT/examples/propeller.st4
    expect 0 "$ST4" "$scene" --size 40x30 -f 2 -s 16 --method accumulate --subframes 8 -o a.exr \
        --stats a.json --validate
    has "$(cat a.json)" '"blocks": 8,'
    has "$(cat a.json)" '"time": 0,'
    expect 0 "$ST4" info a.exr
    has "$out" '--method accumulate'
    has "$out" '--subframes 8'
    expect 0 "$ST4" "$scene" --size 40x30 -f 2 -s 16 --method accumulate --subframes 8 -o b.exr \
        --accel kd3 -j 1
    same a.exr b.exr
    # Static structures: one set of vertices and no segments, whatever deforms.
    expect 0 "$ST4" "$ROOT/examples/head.st4" --size 40x30 -f 24 -s 4 --method accumulate \
        --subframes 2 -o c.exr --accel kd3 --stats c.json
    has "$(cat c.json)" '"keys": 2,'
    has "$(cat c.json)" '"primitives": 19600,'
    has "$(cat c.json)" '"segments": 19600,'
    expect 2 "$ST4" "$scene" -s 16 --method accumulate --subframes 6 -o c.exr
    has "$err" '--spp 18 can'
    expect 2 "$ST4" "$scene" -s 16 --subframes 6 -o c.exr
}

test_crop_is_a_part_of_the_picture() {
    expect 0 "$ST4" "$ROOT/examples/propeller.st4" --size 64x48 -s 2 -f 3 -o part.exr -q \
        --crop 10,30,20,48
    expect 0 "$ST4" info part.exr
    has "$out" 20x28
    has "$out" '10,30,20,48 of 64x48'
    expect 0 "$ST4" "$ROOT/examples/propeller.st4" --size 64x48 -s 2 -f 3 -o part.png -q \
        --crop 10,30,20,48
    expect 2 "$ST4" "$ROOT/examples/propeller.st4" --size 64x48 -s 2 -f 3 -o part.exr \
        --crop 10,30,20,49
    has "$err" "--crop: '10,30,20,49' reaches beyond the picture of 64x48 pixels"
}

test_films_are_packed_as_asked() {
    cat >film.st4 <<'END'
param filter = "box"
param pack = "zip"
film {
  size = <40, 30>  aov = ["z"]  half = pack != "none"  compression = pack
  filter = filter  filter_width = 1.5px  view = "neutral"
}
sphere { material = glow(<1e6, 1, 0.5>, 1) }
END
    local pack filter
    for pack in zip zips piz rle none; do
        expect 0 "$ST4" film.st4 -q -s 4 -D pack=$pack -o $pack.exr
        expect 0 "$ST4" compare $pack.exr zip.exr --channel Z --fail-above 0
        expect 0 "$ST4" info $pack.exr
        case $pack in
        none) has "$out" 'A:float B:float G:float R:float Z:float' ;;
        *) has "$out" 'A:half B:half G:half R:half Z:float' ;;
        esac
    done
    expect 0 "$ST4" compare piz.exr zip.exr --fail-above 0
    for filter in box triangle gaussian blackman-harris; do
        expect 0 "$ST4" film.st4 -q -s 4 -D "filter=$filter" -o "$filter.exr" -o "$filter.png"
        [ "$filter" = box ] || differ box.exr "$filter.exr"
    done
    expect 1 "$ST4" check film.st4 -D filter=mitchell
    has "$err" "filter is a word, this is"
}

test_layers_are_asked_for() {
    echo 'film { size = <40, 30>  aov = ["position"] } sphere {}' >film.st4
    expect 0 "$ST4" film.st4 -q -s 4 -o film.exr
    expect 0 "$ST4" info film.exr
    has "$out" 'A:float B:float G:float R:float position.X:float position.Y:float position.Z:float'
    expect 0 "$ST4" film.st4 -q -s 4 -o none.exr --aov none
    expect 0 "$ST4" info none.exr
    has "$out" $'A:float B:float G:float R:float\n'
    expect 0 "$ST4" film.st4 -q -s 4 -o z.exr --aov z
    expect 0 "$ST4" info z.exr
    has "$out" $'A:float B:float G:float R:float Z:float\n'
    expect 0 "$ST4" compare z.exr none.exr --fail-above 0
}
