# SPDX-License-Identifier: Apache-2.0
# Warnings: each by its name, with its place, and as -W asks.

# raises NAME TEXT: the scene of standard input has this warning, whose message says TEXT; without
# it, and by -Wno-NAME, there is none.
raises() {
    cat >warned.st4
    seen="$seen $1"
    expect 0 "$ST4" check warned.st4 --color never
    is_one "$1"
    has "$err" "$2"
    expect 0 "$ST4" check warned.st4 -Wno-"$1"
    [ -z "$err" ] || fail "-Wno-$1: $err"
    expect 1 "$ST4" check warned.st4 -Werror="$1" --color never
    has "$err" "error: "
    has "$err" "[-Werror=$1]"
    expect 1 "$ST4" check warned.st4 -Werror
    expect 0 "$ST4" check warned.st4 -Werror -Wno-"$1"
    expect 0 "$ST4" check warned.st4 -q
    [ -z "$err" ] || fail "-q: $err"
    expect 0 "$ST4" check warned.st4 -q -W"$1" --diag json
    has "$err" "\"name\":\"$1\""
}

is_one() {
    [ "$(grep -c 'warning:' <<<"$err")" = 1 ] || fail "not one warning: $err"
    has "$err" "[-W$1]"
}

# Every name of the table has a scene here that raises it.
test_every_warning_is_raised() {
    local seen='' name
    raises not-finite 'not finite' <<'END'
sphere { translate <sqrt(t - 100), 0, 0> }
END
    raises tolerance-missed 'px' <<'END'
film { size = <200, 200> }
shutter { phase = start }
surface { fn at(u, v) = <u, v, 0>  fn deform(p) = p + <0, 500*t^2, 0>*p.x  samples = 1 }
END
    raises fast-rotation 'quarter turn' <<'END'
film { size = <200, 200> }
surface { fn at(u, v) = <u, v, 0>  fn deform(p) = turned(p, z, 24turn*t)  samples = 2  tolerance = 1000px }
END
    raises zero-shutter 'no time' <<<'shutter { angle = 0deg }  sphere {}'
    raises light-never-visible 'lamp' <<<'sun {}  lamp { power = t > 1s ? 100 : 0 }  sphere {}'
    raises light-never-visible 'sun' <<<'lamp {}  sun { visible = false }  sphere {}'
    raises light-never-visible 'sky' <<<'lamp {}  sky { color = x*step(1, t) }  sphere {}'
    raises light-never-visible 'its power is 0' <<<'sun {}  area { power = 0 }  sphere {}'
    raises light-never-visible 'its color is black' <<<'sun {}  lamp { color = 0*x }  sphere {}'
    raises albedo-above-one 'above 1' <<<'sphere { material = matte(<1, 1.2, 0.5>) }'
    raises albedo-above-one 'above 1' <<<'sphere { material = mix(matte(x), metal(2*x, 0.5), 0.1) }'
    raises albedo-above-one 'at some instant' <<'END'
film { frames = 1..48 }  sphere { material = gloss(t*<1, 1, 0.5>) }
END
    raises prototypes 'need 65 vertex arrays' <<'END'
def Flag(k = 1) { surface { res = <2, 2>  fn at(u, v) = <u, v, sin(k*1rad + 1turn*t)> } }
for i in 0..129 { instance Flag(i % 65) { cycle = 1s  translate <i, 0, 0> } }
END
    raises unused-let "'loose'" <<<'let loose = 1  sphere {}'
    printf 'v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n' >flat.obj
    raises degenerate 'the transform of sphere@1 leaves it no extent' <<<'sphere { scale <1, 0, 1> }'
    raises degenerate '1 of the 2 triangles' <<<'mesh { file = "flat.obj" }'
    raises degenerate 'no triangle with an area' <<<'surface { fn at(u, v) = <u, u, u> }'
    raises degenerate 'leaves it no area' <<<'surface { fn at(u, v) = <u, v, 0>  fn deform(p) = p.x*y }'
    raises degenerate 'sphere has no surface' <<<'box {}  sphere { radius = 0 }'
    raises degenerate 'points has no surface' <<<'box {}  points { at = [x]  radius = 0 }'
    raises degenerate 'torus has no surface' <<<'box {}  torus { minor = 0 }'
    raises keys-outside 'after the film' <<<'sphere { radius = keys { 1s: 1, 2s: 2 } }'
    raises read-outside 'the list' <<<'film { frames = 1..9 }  sphere { radius = [1, 2][9*t] }'
    raises estimated-rate 'estimated' <<<'sphere { radius = 2 + d(noise(t)) }'
    raises empty 'visible' <<<'sphere { visible = t > 100 }'
    raises empty 'no shapes' <<<'sun {}'
    seen="$seen checkpoint-not-used checkpoint-not-saved frame-locked" # by tests/cli/keep.sh
    seen="$seen sim-rests" # by tests/cli/simulations.sh
    for name in $(sed -nE 's/^WARNING\([A-Z_]+, "([a-z-]+)".*/\1/p' "$ROOT/lang/warnings.def"); do
        [[ " $seen " == *" $name "* ]] || fail "nothing raises $name"
        grep -qx ".It Cm $name" "$ROOT/man/st4.5" || fail "st4.5 does not explain $name"
    done
}

# A flash much shorter than the shutter is a light; so is one in the last frame.
test_flashes_are_lights() {
    echo 'film { frames = 1..48 }  lamp { visible = t > 1.9605s and t < 1.9615s }  sphere {}' >flash.st4
    expect 0 "$ST4" check flash.st4
    lacks "$err" light-never-visible
    echo 'lamp { visible = t < 1s }  sky { color = <0, 0, 0> }  sphere {}' >dark.st4
    expect 0 "$ST4" check dark.st4 -Werror
    expect 0 "$ST4" check flash.st4 -f 1-40
    has "$err" light-never-visible
}

# Light of its own may be above 1, and what is not where colors are.
test_bright_things_are_not_albedos() {
    cat >bright.st4 <<'END'
film { frames = 1..24 }
sphere { material = glow(<2, 3, 4>, 5) }
sphere { material = matte(<1, 1, 1>, bump = 3) }
sphere { material = glass(ior = 2.4) }
sphere { material = gloss(<1, 1, 1>*sin(1turn*t)^2, ior = 1.5 + t) }
END
    expect 0 "$ST4" check bright.st4 -Werror
}

test_warnings_of_noise_are_for_check_alone() {
    echo 'sphere { radius = 2 + d(noise(t)) }' >rate.st4
    expect 0 "$ST4" rate.st4 --size 8x8 -s 1 -o a.exr -q
    expect 0 "$ST4" rate.st4 --size 8x8 -s 1 -o a.exr
    lacks "$err" 'warning:'
}

test_check_tells_of_memory() {
    echo 'film { frames = 1..12 }  surface { fn at(u, v) = <u, v, 0>  fn deform(p) = p + <0, sin(9turn*t), 0>*p.x }' >wave.st4
    expect 0 "$ST4" check wave.st4
    [[ $out =~ ([0-9.]+)\ MB\ of\ vertex\ arrays ]] || fail "$out"
    local all=${BASH_REMATCH[1]} n
    below 0 "$all"
    expect 0 "$ST4" check wave.st4 -f 1-2
    [[ $out =~ ([0-9.]+)\ MB\ of\ vertex\ arrays ]] || fail "$out"
    below "${BASH_REMATCH[1]}" "$all"
    expect 0 "$ST4" check wave.st4 --memory 64K
    [[ $out =~ in\ ([0-9]+)\ blocks ]] || fail "$out"
    n=${BASH_REMATCH[1]}
    below 1 "$n"
}

test_include_chain() {
    mkdir parts
    echo 'include "parts/a.st4"  sphere {}' >scene.st4
    printf '\ninclude "b.st4"\n' >parts/a.st4
    printf 'def Ball {\n  sphere { raduis = 1 }\n}\nBall {}\n' >parts/b.st4
    expect 1 "$ST4" check scene.st4 --color never
    errors "$err" 1
    has "$err" 'scene.st4:1:9: in the file included here:'
    has "$err" 'parts/a.st4:2:9: in the file included here:'
    has "$err" 'parts/b.st4:2:12: error:'
    [ "$(grep -n 'scene.st4:1:9' <<<"$err" | cut -d: -f1)" -lt "$(grep -n 'parts/a.st4:2:9' <<<"$err" | cut -d: -f1)" ] ||
        fail "the chain is out of order: $err"
    expect 1 "$ST4" check scene.st4 --diag json
    has "$err" '"included_from":[{"file":"parts/a.st4","line":2,"column":9},{"file":"scene.st4","line":1,"column":9}]'
}

test_clash_shows_both_places() {
    printf 'let radius_of_all = 1\n' >a.st4
    printf 'fn radius_of_all(k) = k\n' >b.st4
    printf 'include "a.st4"\ninclude "b.st4"\nsphere {}\n' >scene.st4
    expect 1 "$ST4" check scene.st4 --color never
    errors "$err" 1
    has "$err" "b.st4:1:4: error: 'radius_of_all' is defined twice"
    has "$err" 'a.st4:1:5: note: first defined here'
    printf 'include "a.st4" as a\ninclude "b.st4" as b\nsphere { radius = a.radius_of_all + b.radius_of_all(1) }\n' >scene.st4
    expect 0 "$ST4" check scene.st4
    printf 'camera {}\nsphere {}\ncamera {}\n' >two.st4
    expect 1 "$ST4" check two.st4 --color never
    has "$err" 'two.st4:3:1: error:'
    has "$err" 'two.st4:1:1: note:'
}

test_cycle_of_includes() {
    echo 'include "b.st4"' >a.st4
    echo 'include "a.st4"' >b.st4
    expect 1 "$ST4" check a.st4 --color never
    errors "$err" 1
    has "$err" "includes itself"
}

# Each word of the table is answered with what the table says, as a node and as a property.
test_words_of_povray_are_answered() {
    local word answer n=0
    while IFS=$'\t' read -r word answer; do
        echo "$word { }" >word.st4
        expect 1 "$ST4" check word.st4 --color never
        errors "$err" 1
        has "$err" "${answer//\\\"/\"}"
        n=$((n + 1))
    done < <(sed -nE 's/^WORD\("([a-z0-9_]+)", "(.*)"\)$/\1\t\2/p' "$ROOT/lang/words.def")
    below 30 $n
    echo 'sphere { pigment = 1 }' >word.st4
    expect 1 "$ST4" check word.st4
    has "$err" 'write material'
    echo '#declare a = 1;' >word.st4
    expect 1 "$ST4" check word.st4
}

# The surfaces that the table tells to write show their outside: along u crossed with along v.
test_words_of_povray_face_outwards() {
    local word
    for word in lathe sor height_field; do
        {
            echo 'fn r(v) = 2'
            echo 'fn h(v) = v'
            echo 'fn height(u, v) = 1'
            sed -nE "s/^WORD\(\"$word\".*(fn )at(\(u, v\) = <.*>) \}\"\)\$/\1hinted\2/p" "$ROOT/lang/words.def"
            case $word in
            height_field) echo 'let e = 0.01  let outwards = y' ;;
            *) echo 'let e = 1deg  let outwards = hinted(0deg, 0)' ;;
            esac
            echo 'let o = 0*e'
            echo 'let along_u = hinted(e, 0) - hinted(o, 0)'
            echo 'let along_v = hinted(o, 0.01) - hinted(o, 0)'
            echo 'assert dot(cross(along_u, along_v), outwards) > 0'
            echo 'sphere { }'
        } >hinted.st4
        expect 0 "$ST4" check hinted.st4
    done
}
