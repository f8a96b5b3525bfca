# SPDX-License-Identifier: Apache-2.0
# st4 compare: layers, pictures of differences, films, what is refused.

# Even grey pictures: shade [name].
grey() {
    cat >even.st4 <<'END'
film { size = <16, 12> }
param shade = 0.5
sky { color = <shade, shade, shade> }
sphere { radius = 0.001  translate <0, -1000, 0> }
camera { from = <0, 0, 5>  to = <0, 0, 9> }
END
    expect 0 "$ST4" even.st4 -s 1 -o "$2" -q -D "shade=$1"
}

test_compare_prints_what_is_seen() {
    grey 0.5 a.exr
    grey 0.625 b.exr
    expect 0 "$ST4" compare a.exr a.exr
    has "$out" 'ssim    1'
    has "$out" 'flip    0'
    expect 0 "$ST4" compare a.exr b.exr -q --metric relrmse
    [ "$out" = 0.2 ] || fail "relrmse $out"
    expect 1 "$ST4" compare a.exr b.exr --metric ssim --fail-above 0.999
    expect 0 "$ST4" compare a.exr b.exr --metric ssim --fail-above 0.9
    expect 1 "$ST4" compare a.exr b.exr --metric flip --fail-above 0.01
    expect 0 "$ST4" compare a.exr b.exr --metric hdrflip
    has "$out" hdrflip
    expect 0 "$ST4" compare a.exr b.exr --json
    has "$out" '"relrmse": 0.2'
    if command -v python3 >/dev/null; then
        python3 -m json.tool <<<"$out" >/dev/null || fail "no JSON: $out"
    fi
}

test_compare_knows_layers() {
    cat >ball.st4 <<'END'
film { size = <16, 12> }
sphere {}
sky {}
camera { from = <0, 0, 5> }
END
    expect 0 "$ST4" ball.st4 -s 4 -o a.exr -q
    expect 0 "$ST4" ball.st4 -s 4 --seed 7 -o b.exr -q
    expect 0 "$ST4" compare a.exr b.exr --layer normal
    has "$out" 'in normal.'
    expect 0 "$ST4" compare a.exr b.exr --layer all -q --json
    has "$out" '"layer": "normal"'
    has "$out" '"layer": "Z"'
    expect 3 "$ST4" compare a.exr b.exr --layer nosuch
    has "$err" 'no channel nosuch; it has'
    expect 2 "$ST4" compare a.exr b.exr --layer Z --channel Z
}

test_compare_draws_differences() {
    grey 0.5 a.exr
    grey 0.625 b.exr
    expect 0 "$ST4" compare a.exr b.exr -q --diff d.exr
    expect 0 "$ST4" compare d.exr a.exr -q --metric max
    [ "$out" = 0.625 ] || fail "the difference is no -0.125: $out"
    expect 0 "$ST4" compare a.exr b.exr -q --diff d.png
    [ "$(head -c 4 d.png | tail -c 3)" = PNG ] || fail 'not a PNG'
    expect 3 "$ST4" compare a.exr b.exr -q --diff nosuch/d.png
}

# The error is 0, 1/8, 0, 1/8: its deviation is 1/16, each step 1/8.
test_compare_measures_flicker() {
    local i
    for i in 0001 0002 0003 0004; do
        grey 0.5 "b.$i.exr"
        grey 0.5 "a.$i.exr"
    done
    grey 0.625 a.0002.exr
    grey 0.625 a.0004.exr
    expect 0 "$ST4" compare 'a.####.exr' 'b.####.exr'
    has "$out" 'frames  4'
    has "$out" 'flicker 0.0625,'
    has "$out" 'change  0.125,'
    expect 1 "$ST4" compare a.%04d.exr b.%04d.exr -q --metric flicker --fail-above 0.06
    [ "$out" = 0.0625 ] || fail "flicker $out"
    expect 0 "$ST4" compare 'a.####.exr' 'b.####.exr' --json
    has "$out" '"n_frames": 4, "flicker": 0.0625'
    rm b.0003.exr
    expect 3 "$ST4" compare 'a.####.exr' 'b.####.exr'
    has "$err" 'frame 3: there is a picture of a.####.exr, but none of b.####.exr'
    expect 2 "$ST4" compare 'a.####.exr' b.0001.exr
    expect 3 "$ST4" compare 'a.####.exr' 'c.####.exr'
    has "$err" 'no such file for any frame'
}

# Depth is infinite where there is nothing, so it has no SSIM, and the command says where.
test_compare_refuses_what_is_not_finite() {
    grey 0.5 a.exr
    expect 3 "$ST4" compare a.exr a.exr -q --channel Z --metric rmse
    has "$err" 'no value is finite in both'
    cat >ball.st4 <<'END'
film { size = <16, 12> }
sphere {}
sky {}
camera { from = <0, 0, 5> }
END
    expect 0 "$ST4" ball.st4 -s 1 -o b.exr -q
    expect 0 "$ST4" compare b.exr b.exr --channel Z
    expect 3 "$ST4" compare b.exr b.exr --channel Z -q --metric ssim
    has "$err" 'is not finite at pixel 0, 0 in Z'
}
