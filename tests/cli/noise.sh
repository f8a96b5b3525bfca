# SPDX-License-Identifier: Apache-2.0
# Samples where they are needed: noise, time, and what they must not change.

make_scene() {
    cat >ball.st4 <<'END'
film { size = <48, 32>  frames = 1..3 }
shutter { angle = 360deg }
sky { color = <0.2, 0.3, 0.5> }
sun { power = 2 }
render { bounces = 1  spp = 3 }
sphere { radius = 0.4  material = gloss(<0.8, 0.3, 0.2>)  translate <1.5*sin(8turn*t), 0, 0> }
sphere { radius = 0.04  material = glow(<9, 8, 6>)  translate <2 - 90*t, 0.8, 0> }
plane { offset = -0.5 }
camera { from = <0, 1, 5> }
END
}

# header PICTURE NAME: what a header says.
header() {
    "$ST4" info "$1" | awk -v name="$2" '$1 == name { $1 = ""; print substr($0, 2) }'
}

# The true error is at most 1.25 times what was asked for, and the error that is told is within a
# quarter of the true one, against a reference with the same number of samples everywhere.
test_noise_is_reached() {
    make_scene
    local x error told
    expect 0 "$ST4" ball.st4 -f 2 -s 4096 --seed 7 -o long.exr -q
    for x in 0.1 0.05 0.03; do
        expect 0 "$ST4" ball.st4 -f 2 --noise $x -o short.exr --stats stats.json
        has "$err" 'ended by noise'
        has "$(cat stats.json)" '"ended_by_noise": 1'
        [ "$(header short.exr stopped)" = "noise $x" ] || fail "$(header short.exr stopped)"
        told=$(header short.exr noise)
        error=$("$ST4" compare short.exr long.exr --metric relrmse -q)
        below "$told" $x
        below "$error" "$(awk "BEGIN { print 1.25 * $x }")"
        awk -v a="$told" -v b="$error" 'BEGIN { exit !(a < 1.25*b && b < 1.25*a) }' ||
            fail "the error is $error, $told was told"
    done
}

# Where most of the picture is calm, the error is less than with as many samples in each pixel.
test_samples_go_where_they_are_needed() {
    local even adaptive head="$ROOT/examples/head.st4 -f 6 --size 48x48 -q"
    # shellcheck disable=SC2086
    {
        expect 0 "$ST4" $head -s 512 --noise 0 --seed 7 -o long.exr
        expect 0 "$ST4" $head -s 64 -o even.exr
        expect 0 "$ST4" $head -s 64 --noise 0 -o adaptive.exr
    }
    even=$("$ST4" compare even.exr long.exr --metric rmse -q)
    adaptive=$("$ST4" compare adaptive.exr long.exr --metric rmse -q)
    below "$adaptive" "$(awk "BEGIN { print 0.8 * $even }")"
}

test_noise_is_the_same_bytes() {
    make_scene
    local j n
    expect 0 "$ST4" ball.st4 --noise 0.06 -j 1 -o whole.####.exr -q
    for j in 2 5; do
        expect 0 "$ST4" ball.st4 -f 2 --noise 0.06 -j $j -o part.exr -q
        same part.exr whole.0002.exr
    done
    # By itself, as by what the header says.
    # shellcheck disable=SC2046
    (set -f && cd "$PWD" && expect 0 "$ST4" $(header whole.0002.exr command | cut -d ' ' -f 2-) \
        -f 2 -o part.exr -q) || exit 1
    same part.exr whole.0002.exr
}

test_noise_goes_on() {
    make_scene
    local n=0
    expect 0 "$ST4" ball.st4 -f 2 --noise 0.03 -o whole.exr -q
    RANDOM=5
    until timeout --preserve-status -s INT "0.$((RANDOM % 30 + 10))" "$ST4" ball.st4 -f 2 \
        --noise 0.03 -o part.exr --resume --checkpoint 0.05 -j $((n % 3 + 1)) -q >.out 2>.err; do
        n=$((n + 1))
        [ $n -lt 1000 ] || fail "no end: $(cat .err)"
    done
    same part.exr whole.exr
    # It is finished, and known to be.
    expect 0 "$ST4" ball.st4 -f 2 --noise 0.03 -o part.exr --resume --stats stats.json
    has "$(cat stats.json)" '"frames": 0,'
    expect 0 "$ST4" ball.st4 -f 2 --noise 0.2 -o part.exr --resume --stats stats.json
    has "$(cat stats.json)" '"frames": 1,'
}

test_noise_resumes_only_its_own() {
    make_scene
    "$ST4" ball.st4 -f 1 --noise 0.001 -o part.exr --checkpoint 0.05 -q &
    until [ -e part.exr.checkpoint ]; do
        sleep 0.05
    done
    kill -KILL $!
    wait $! 2>/dev/null
    expect 3 "$ST4" ball.st4 -f 1 -s 100000 -o part.exr --resume
    has "$err" 'its adaptive is 1, where 0 is asked for'
    expect 3 "$ST4" ball.st4 -f 1 --noise 0.001 --spp 2 -o part.exr --resume
    has "$err" 'samples per pixel, where 2 are asked for'
    expect 0 "$ST4" info part.exr.checkpoint
    has "$out" 'not finished'
}

# What ends it, and what the header says of that; not when, as machines differ.
test_time_ends_frames() {
    make_scene
    expect 0 "$ST4" ball.st4 -f 1-2 --time 0.3 -o short.####.exr --stats stats.json
    has "$err" 'ended by time (2)'
    has "$(cat stats.json)" '"ended_by_time": 2'
    [ "$(header short.0001.exr stopped)" = 'time 0.3' ] || fail "$(header short.0001.exr stopped)"
    expect 0 "$ST4" ball.st4 -f 1-2 --time 0.3 -o short.####.exr --resume --stats stats.json
    has "$(cat stats.json)" '"frames": 0,'
    # The same pixels again, by the samples that there was time for.
    local again
    again=$(header short.0001.exr command)
    has "$again" "--noise 0 --spp $(header short.0001.exr samples)"
    # shellcheck disable=SC2046
    expect 0 "$ST4" $(cut -d ' ' -f 2- <<<"$again") -f 1 -o again.exr -q
    [ "$("$ST4" compare again.exr short.0001.exr --layer samples --metric max -q)" = 0 ] ||
        fail 'other samples'
    [ "$("$ST4" compare again.exr short.0001.exr --metric max -q)" = 0 ] || fail 'other pixels'
    # However little there is.
    expect 0 "$ST4" ball.st4 -f 1 --time 0.001 -o short.exr --size 320x200
    [ "$(header short.exr samples)" = 2 ] || fail "$(header short.exr samples)"
    # The first of three.
    expect 0 "$ST4" ball.st4 -f 1 --time 1000 --noise 10 -s 5000 -o short.exr
    has "$err" '512 samples per pixel; ended by noise'
    expect 0 "$ST4" ball.st4 -f 1 --time 1000 --noise 0.0001 -s 37.5 -o short.exr
    has "$err" '37.5 samples per pixel; ended by samples'
}

test_scenes_ask_for_noise() {
    make_scene
    sed 's/spp = 3/noise = 0.2/' ball.st4 >noise.st4
    sed 's/spp = 3/time = 100ms  spp = 20/' ball.st4 >time.st4
    expect 0 "$ST4" noise.st4 -f 1 -o a.exr
    has "$err" 'ended by noise'
    # One of the options takes the place of all that the scene says.
    expect 0 "$ST4" noise.st4 -f 1 -s 4 -o a.exr
    lacks "$err" 'ended by'
    expect 0 "$ST4" time.st4 -f 1 --noise 0.2 -o a.exr
    has "$err" 'ended by noise'
    expect 0 "$ST4" time.st4 -f 1 -o a.exr
    has "$err" 'ended by'
    expect 0 "$ST4" ball.st4 -f 1 --noise 0.2 -o a.exr
    has "$err" 'ended by noise'
}

test_noise_is_refused() {
    make_scene
    local args what
    while IFS=: read -r args what; do
        # shellcheck disable=SC2086
        expect 2 "$ST4" ball.st4 -f 1 -o no.exr $args
        has "$err" "$what"
    done <<'END'
--noise 0.1 --samples 1-3:--samples are of a number that is the same for all pixels
--time 5 --samples 1-3:--samples are of a number that is the same for all pixels
--noise 0.1 --method accumulate:--method accumulate shares out a number of samples
--noise 0:a noise of 0 is never reached
-s 2.5:--spp is a whole number without --noise and --time
--noise 0.1 -o no.st4film:a file of sums
--noise -1:out of range
--time 0:out of range
END
    [ ! -e no.exr ] || fail 'a picture was written'
}

test_noise_is_told() {
    make_scene
    expect 0 "$ST4" ball.st4 -f 1 --size 160x120 --noise 0.02 -s 60 -o a.exr --progress json
    has "$err" '"event":"end"'
    ! grep '"noise"' .err | grep -qvE '"seconds_left":[0-9.]+,"noise":0\.[0-9]+\}$' || fail "$err"
}
