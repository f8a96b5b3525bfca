# SPDX-License-Identifier: Apache-2.0
# The commands that look into a scene without rendering it: eval, mesh, fmt, depends.

# a_scene: moving.st4, with names to ask for.
a_scene() {
    cat >moving.st4 <<'END'
film { frames = 1..3  fps = 4 }
let angle = keys { 0s: 0deg, 2s: 90deg }
let place = <t, 2*t, t^2>
group Car {
  for i in 0..2 { box Wheel { size = <2, 2, 2>  translate <10*i, t, 0> } }
  box Body { scale <-1, 1, 1>  translate <0, 0, -20>  visible = t < 1s }
}
plane {}
END
}

# row N: the Nth line of $out, columns separated by spaces.
row() {
    sed -n "$1p" <<<"$out" | tr '\t' ' '
}

is() {
    [ "$1" = "$2" ] || fail "'$1' instead of '$2'"
}

test_eval_is_a_table() {
    a_scene
    expect 0 "$ST4" eval moving.st4 angle place 'd(place).z' 't > 1' '"a b"' --at '0..2 by 0.5'
    is "$err" ''
    is "$(wc -l <<<"$out")" 6
    is "$(sed -n 1p <<<"$out")" \
        $'t\tangle [deg]\tplace.x\tplace.y\tplace.z\td(place).z\tt > 1\t"a b"'
    is "$(row 2)" '0 0 0 0 0 0 false a b'
    is "$(row 3)" '0.5 22.5 0.5 1 0.25 1 false a b'
    is "$(row 6)" '2 90 2 4 4 4 true a b'
    expect 0 "$ST4" eval moving.st4 '-2^2' '-(t + 1)' --at 1s
    is "$(row 2)" '1 -4 -2'
    expect 0 "$ST4" eval moving.st4 'place - x' 'rgb(t, 1, 0)' --at 3s
    is "$(row 1)" 't (place - x).x (place - x).y (place - x).z rgb(t, 1, 0).r rgb(t, 1, 0).g rgb(t, 1, 0).b'
    is "$(row 2)" '3 2 6 9 3 1 0'
}

test_eval_times() {
    a_scene
    expect 0 "$ST4" eval moving.st4 t
    is "$(tr '\n' ' ' <<<"$out")" $'t\tt 0\t0 0.25\t0.25 0.5\t0.5 '
    expect 0 "$ST4" eval moving.st4 t --at '[6f, 1ms]' --fps 2
    is "$(row 2)" '3 3'
    is "$(row 3)" '0.001 0.001'
    expect 1 "$ST4" eval moving.st4 t --at 3deg
    has "$err" 'a time is expected, this is an angle'
    expect 1 "$ST4" eval moving.st4 t --at t
    has "$err" 'depends on t'
    expect 1 "$ST4" eval moving.st4 nosuch t+ --color never
    errors "$err" 2
    is "$out" ''
    expect 1 "$ST4" eval moving.st4 p
    has "$err" 'only t and T'
}

# ply_numbers FILE: how many vertices, and the numbers of the text that follows the header.
ply_count() {
    sed -n "s/^element $2 //p;/^end_header/q" "$1"
}

# ply_bounds FILE: lowest and highest x y z; the file begins each vertex with three doubles.
ply_bounds() {
    local n header size
    n=$(ply_count "$1" vertex)
    header=$(($(sed '/^end_header/q' "$1" | wc -c)))
    size=$(sed '/^end_header/q' "$1" | awk '/^property double/ { n += 8 } /^property float/ { n += 4 }
        END { print n }')
    tail -c +$((header + 1)) "$1" | head -c $((n * size)) | od -An -v -t f8 -w"$size" |
        awk '{ for (k = 1; k <= 3; k++) {
                   if (NR == 1 || $k < lo[k]) lo[k] = $k
                   if (NR == 1 || $k > hi[k]) hi[k] = $k } }
             END { print lo[1], lo[2], lo[3], hi[1], hi[2], hi[3] }'
}

test_mesh_at_an_instant() {
    a_scene
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' >four.obj
    cat >four.st4 <<'END'
mesh { file = "four.obj"  fn deform(p) = p * (1 + t)  translate <0, 5*t, 0> }
END
    expect 0 "$ST4" mesh four.st4 --at 1s -o four.ply
    has "$err" '4 vertices, 4 triangles of 1 object'
    is "$(ply_bounds four.ply)" '0 5 0 2 7 6'
    expect 0 "$ST4" mesh four.st4 -o rest.ply -q
    is "$err" ''
    is "$(ply_bounds rest.ply)" '0 0 0 1 1 3'
    # What is written can be read, and is the same from there.
    echo 'mesh { file = "four.ply" }' >again.st4
    expect 0 "$ST4" mesh again.st4 -o again.ply -q
    same four.ply again.ply
}

test_mesh_by_label() {
    a_scene
    local n
    expect 0 "$ST4" mesh moving.st4 --at 0.5 -o all.ply
    has "$err" 'of 4 objects'
    has "$err" '1 plane left out'
    n=$(ply_count all.ply vertex)
    expect 0 "$ST4" mesh moving.st4 --at 0.5 -o wheels.ply --label Car/Wheel
    is "$(ply_count wheels.ply vertex)" $((n * 3 / 4))
    expect 0 "$ST4" mesh moving.st4 --at 0.5 -o car.ply --label Car
    is "$(ply_count car.ply vertex)" "$n"
    expect 0 "$ST4" mesh moving.st4 --at 3 -o one.ply --label 'Wheel[2]'
    has "$err" 'of 1 object'
    expect 0 "$ST4" mesh moving.st4 --at 3 -o none.ply --label Body
    has "$err" '1 object is not there'
    is "$(ply_count none.ply vertex)" 0
    expect 2 "$ST4" mesh moving.st4 -o none.ply --label Whel
    has "$err" "did you mean 'Wheel'?"
    expect 1 "$ST4" mesh moving.st4 --at 0..1 -o none.ply
    has "$err" 'one instant is expected'
    expect 3 "$ST4" mesh moving.st4 -o nosuch/a.ply
    has "$err" 'nosuch/a.ply'
}

# Triangles of closed shapes turn their front outwards: the volume that they enclose is positive,
# and that of the shape, also where a transform mirrors it.
test_mesh_by_numbers_of_labels() {
    for i in $(seq 200); do echo "box Crate$i { translate <$i, 0, 0> } box Bin[$i] { }"; done >many.st4
    echo 'for i in 0..3 { for j in 0..3 { box Cell[10*i + j] { } } }' >>many.st4
    for label in Crate17 Crate170 'Bin[17]' 'Bin[170]' 'Cell[23]'; do
        expect 0 "$ST4" mesh many.st4 --label "$label" -o one.ply
        [[ $err == *"12 triangles of 1 object"* ]] || fail "$label: $err"
    done
    expect 0 "$ST4" mesh many.st4 --label Bin -o all.ply
    [[ $err == *"of 200 objects"* ]] || fail "$err"
}

test_mesh_faces_outwards() {
    cat >ball.st4 <<'END'
sphere { scale <-1, 1, 1>  translate <3, 1, 0> }
END
    expect 0 "$ST4" mesh ball.st4 -o ball.ply -q
    local n header
    n=$(ply_count ball.ply vertex)
    header=$(($(sed '/^end_header/q' ball.ply | wc -c)))
    tail -c +$((header + 1)) ball.ply | head -c $((n * 24)) | od -An -v -t f8 -w24 >points
    tail -c +$((header + 1 + n * 24)) ball.ply | od -An -v -t u1 -w13 |
        awk '{ for (k = 0; k < 3; k++)
                   printf "%d ", $(2 + 4*k) + 256 * ($(3 + 4*k) + 256 * $(4 + 4*k))
               print "" }' >faces
    awk 'NR == FNR { x[NR - 1] = $1; y[NR - 1] = $2; z[NR - 1] = $3; next }
         { a = $1; b = $2; c = $3
           v += x[a]*(y[b]*z[c] - z[b]*y[c]) + y[a]*(z[b]*x[c] - x[b]*z[c]) + z[a]*(x[b]*y[c] - y[b]*x[c]) }
         END { v /= 6; exit !(v > 3.9 && v < 4.19) }' points faces || fail 'the volume is not that of a sphere'
}

test_fmt_leaves_the_examples() {
    (cd "$ROOT" && tests/check/scenes) || fail "examples are not in the canonical layout"
}

test_fmt_prints_and_writes() {
    printf 'sphere{radius=1+t}   // a ball\nbox{}\n' >ugly.st4
    printf 'sphere { radius = 1 + t }  // a ball\nbox {}\n' >fine.st4
    expect 0 "$ST4" fmt ugly.st4
    cmp -s fine.st4 .out || fail "$out"
    "$ST4" fmt - <ugly.st4 | cmp -s fine.st4 - || fail 'from standard input'
    expect 1 "$ST4" fmt --check fine.st4 ugly.st4
    is "$out" ugly.st4
    grep -q 'sphere{' ugly.st4 || fail 'a check changed the file'
    expect 0 "$ST4" fmt -w ugly.st4 fine.st4
    is "$out" ''
    same ugly.st4 fine.st4
    expect 0 "$ST4" fmt --check ugly.st4 fine.st4
    is "$out" ''
}

test_fmt_leaves_broken_files_alone() {
    printf 'sphere{radius= }\n' >broken.st4
    cp broken.st4 copy.st4
    expect 1 "$ST4" fmt -w broken.st4 --color never
    errors "$err" 1
    same broken.st4 copy.st4
    expect 3 "$ST4" fmt nosuch.st4
    has "$err" nosuch.st4
    [ -z "$(find . -name '*tmp*')" ] || fail "left behind: $(ls)"
}

test_depends_lists_what_is_read() {
    mkdir parts 'a folder'
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >'a folder/flat $1.obj'
    echo 'def Flat { mesh { file = "flat $1.obj" } }  fn g(x) = x' >parts/flat.st4
    echo 'include "parts/flat.st4"  Flat {}  mesh { file = "flat $1.obj" }' >scene.st4
    expect 0 "$ST4" depends scene.st4 -I 'a folder'
    is "$out" $'scene.st4\nparts/flat.st4\na folder/flat $1.obj'
    is "$("$ST4" depends - -I parts <<<'include "flat.st4"  sphere {}')" parts/flat.st4
    expect 3 "$ST4" depends scene.st4 --color never
    errors "$err" 2
    is "$out" ''
    expect 0 "$ST4" depends scene.st4 -I 'a folder' --make picture.exr
    printf '\t@echo made >$@\n' >recipe
    { sed '/flat.*obj$/q' .out; cat recipe; sed '1,/flat.*obj$/d' .out; } >Makefile
    make -s || fail 'make does not read the rule'
    sleep 0.02
    make -q || fail 'nothing changed, but make makes it again'
    touch -d '+1 minute' 'a folder/flat $1.obj'
    ! make -q || fail 'a mesh changed, and make does nothing'
}

test_a_formatted_file_keeps_its_mode() {
    printf '#!/usr/bin/env st4\nsphere{}\n' >run.st4
    chmod 750 run.st4
    expect 0 "$ST4" fmt -w run.st4
    [ "$(stat -c %a run.st4)" = 750 ] || fail "mode $(stat -c %a run.st4)"
}

test_all_reports_are_json() {
    echo 'print "a", 3  sphere { }' >print.st4
    expect 0 "$ST4" check -q print.st4 --diag json
    has "$err" '"severity":"print"'
    local command
    for command in 'fmt nosuch.st4' 'info nosuch.exr' 'check nosuch.st4' 'check print.st4 -f 9-' \
        'check print.st4 -W nosuch' 'mesh print.st4' \
        'print.st4 --crop 0,9999,0,9' 'print.st4 --subframes 3' 'print.st4 --samples 90-99 -o a.st4film' \
        'print.st4 -o a.png -o b.png' 'print.st4 --stats no-folder/a.json'; do
        "$ST4" $command --diag json >out 2>err && fail "$command is fine"
        grep -qv '^{"version":1,' err && fail "$command: $(cat err)"
    done
    return 0
}
