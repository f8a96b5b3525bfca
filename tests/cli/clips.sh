# SPDX-License-Identifier: Apache-2.0
# Clips of mesh files: st4 mesh at instants of them, in scenes and in a def that plays spans of them.

# An octal escape of four bytes for each number that is used here.
floats() {
    local x
    for x in "$@"; do
        case $x in
        0) printf '\0\0\0\0' ;;
        1) printf '\0\0\200\077' ;;
        2) printf '\0\0\0\100' ;;
        4) printf '\0\0\200\100' ;;
        esac
    done
}

# a.gltf: a triangle whose node goes 4 along z in the second of Go, and 2 up in the two of Up.
a_gltf() {
    local bytes
    bytes=$({
        floats 0 0 0 1 0 0 0 1 0
        floats 0 1 0 0 0 0 0 4
        floats 0 2 0 0 0 0 2 0
    } | base64 -w 0)
    cat >a.gltf <<END
{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"mesh": 0, "name": "flag"}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"animations": [
{"name": "Go", "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
"samplers": [{"input": 1, "output": 2}]},
{"name": "Up", "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
"samplers": [{"input": 3, "output": 4}]}],
"accessors": [
{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0,0,0], "max": [1,1,0]},
{"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
{"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"},
{"bufferView": 3, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
{"bufferView": 4, "componentType": 5126, "count": 2, "type": "VEC3"}],
"bufferViews": [
{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
{"buffer": 0, "byteOffset": 44, "byteLength": 24}, {"buffer": 0, "byteOffset": 68, "byteLength": 8},
{"buffer": 0, "byteOffset": 76, "byteLength": 24}],
"buffers": [{"byteLength": 100, "uri": "data:application/octet-stream;base64,$bytes"}]}
END
}

# first_is SCENE TIME X Y Z: where the first vertex of the scene is, to six digits.
first_is() {
    local begin place
    expect 0 "$ST4" mesh "$1" --at "$2" -o out.ply -q
    lacks "$err" warning
    begin=$(grep -a -b end_header out.ply | cut -d : -f 1)
    place=$(tail -c +$((begin + 12)) out.ply | head -c 24 | od -A n -w24 -t f8 |
        awk '{ for (i = 1; i <= 3; i++) printf "%s%.6g", (i > 1 ? " " : ""), $i + 0 }')
    [ "$place" = "$3 $4 $5" ] || fail "at $2 the vertex is at $place"
}

test_clips_are_where_they_are() {
    a_gltf
    cat >one.st4 <<'END'
film { frames = 1..24  fps = 24 }
mesh { file = "a.gltf"  clip = "Go" }
END
    first_is one.st4 -1s 0 0 0
    first_is one.st4 0.25s 0 0 1
    first_is one.st4 7s 0 0 4
    cat >two.st4 <<'END'
film { frames = 1..72  fps = 24 }
mesh { file = "a.gltf"  clip = ["Go", "Up"]  fit = 2  ground = true
    fn deform(p) = p + <1, 0, 0> }
END
    first_is two.st4 0.5s 0 0 4
    first_is two.st4 1s 0 0 0
    first_is two.st4 2s 0 2 0
    first_is two.st4 5s 0 4 0
    expect 0 "$ST4" info a.gltf
    has "$out" 'triangles            1'
    has "$out" 'clip                 "Go", 1 s'
    has "$out" 'clip                 "Up", 2 s'
}

# The instance's own clock runs through spans of the clips; the film's is longer than they are.
test_clips_play_in_a_def() {
    a_gltf
    cat >def.st4 <<'END'
film { frames = 1..240  fps = 24 }
camera { from = <0, 1, 20> }
def Flag {
    clip go = 0s..1s
    clip up = 1s..3s
    mesh { file = "a.gltf"  clip = ["Go", "Up"] }
}
instance Flag { clips = [play(go), play(up, at = 5s, fade = 0)] }
END
    first_is def.st4 0.25s 0 0 1
    first_is def.st4 3.25s 0 0 1
    first_is def.st4 6s 0 1 0
    expect 0 "$ST4" render def.st4 -f 7 -o out.exr -q
    expect 0 "$ST4" check def.st4
    lacks "$err" warning
}

# A fade is no shape: what moves in it alone moves, once.
test_fades_are_counted_as_fades() {
    cat >fades.st4 <<'END'
film { size = <64, 64>  frames = 1..48  fps = 24 }
def Man {
    clip stand = 0s..1s
    clip wave = 1s..2s
    surface { fn at(u, v) = <u, v, sin(1turn*max(t, 1))> }
    surface { fn at(u, v) = <u, v + 2, 0> }
    sphere { radius = 0.2  translate <0, t, 0> }
}
for i in 0..1 {
    instance Man { clips = [stand, play(wave, at = 1s), play(stand, at = 1.5s)]  translate <2*i, 0, 0> }
}
END
    expect 0 "$ST4" info fades.st4
    has "$out" 'shapes    3, placed as 6 objects; 1 deform'
    has "$out" 'fades     2, in which'
    expect 0 "$ST4" check fades.st4
    has "$out" '2 of 3 shapes move in 48 frames, with 2 fades from clip to clip; 0 errors'
    sed -i 's/, play.*\]/]/' fades.st4
    expect 0 "$ST4" info fades.st4
    has "$out" 'shapes    3, placed as 6 objects; 1 deform'
    lacks "$out" fades
    expect 0 "$ST4" check fades.st4
    has "$out" 'of 3 shapes move in 48 frames; 0 errors'
}

test_clips_that_are_not_there() {
    a_gltf
    echo 'v 0 0 0 v 1 0 0 v 0 1 0 f 1 2 3' | sed 's/ \([vf]\)/\n\1/g' >a.obj
    cat >wrong.st4 <<'END'
mesh { file = "a.gltf"  clip = "Goo" }
mesh { file = "a.gltf"  clip = ["Go", "Wave"] }
mesh { file = "a.obj"  clip = "Go" }
END
    expect 1 "$ST4" check wrong.st4 --color never
    errors "$err" 3
    has "$err" "1:32: error: 'a.gltf' has no clip 'Goo'"
    has "$err" "did you mean 'Go'?"
    has "$err" "'a.gltf' has no clip 'Wave'"
    has "$err" "it has 'Go' (1s), 'Up' (2s)"
    has "$err" "'a.obj' has no clips"
    cat >wrong.st4 <<'END'
mesh { file = "a.gltf"  clip = 3 }
mesh { file = "a.gltf"  clip = ["Go", 3m] }
mesh { file = "a.gltf"  clip = [] }
mesh { file = "a.gltf"  clip = "Go"  cache = "a.mdd" }
END
    expect 1 "$ST4" check wrong.st4 --color never
    errors "$err" 4
    has "$err" 'clip is a string or a list of strings, this is a number'
    has "$err" 'clip is a list of strings, item 1 is a length'
    has "$err" 'clip is an empty list'
    has "$err" 'a mesh moves by its clip or by a cache, not by both'
}

# Other places, another picture: the hash that is kept with it says so.
test_clips_are_part_of_the_hash() {
    a_gltf
    echo 'mesh { file = "a.gltf"  clip = "Go" }' >scene.st4
    hash_of() {
        expect 0 "$ST4" info scene.st4
        grep '^hash' <<<"$out"
    }
    local before
    before=$(hash_of)
    [ "$before" = "$(hash_of)" ] || fail 'not the same twice'
    sed -i 's/"byteOffset": 76/"byteOffset": 72/; s/"byteOffset": 44/"byteOffset": 76/' a.gltf
    [ "$before" != "$(hash_of)" ] || fail 'the same hash of other keys'
}
