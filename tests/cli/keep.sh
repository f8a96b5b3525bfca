# SPDX-License-Identifier: Apache-2.0
# No work is lost: checkpoints, slices, several runs in one folder.

# A scene that takes a while for its few pixels, in three frames.
make_scene() {
    cat >ball.st4 <<'END'
film { size = <48, 32>  frames = 1..3 }
sky {}
let up = 0.2*sin(1turn*t)
for i in 0..20 { sphere { radius = 0.3  center = <i % 5, i / 5, 0> + <0, up, 0>  material = gloss(<0.8, 0.3, 0.2>) } }
plane { offset = -0.5 }
END
}

# Seconds, from 0.0x to 0.4.
moment() {
    printf '0.%03d' $((RANDOM % 380 + 20))
}

# A run that is ended by a signal within a moment, or is not.
stopped() {
    local signal=$1
    shift
    timeout --preserve-status -s "$signal" "$(moment)" "$ST4" "$@" -q >.out 2>.err </dev/null
}

test_kills_cost_nothing_but_time() {
    make_scene
    RANDOM=${SEED:-1}
    local frame kills=$([ -n "${STRESS-}" ] && echo 1000 || echo 20) n=0 resumed=0 j
    expect 0 "$ST4" ball.st4 -s 400 -o whole.####.exr
    while [ $n -lt $kills ]; do
        j=$((n % 3 * 2 + 1))
        [ -e part.0001.exr.checkpoint ] && resumed=$((resumed + 1))
        stopped KILL ball.st4 -s 400 -j $j -o part.####.exr --checkpoint 0.01 --resume
        case $? in
        0) rm -f part.*.exr ;;
        137) n=$((n + 1)) ;;
        *) fail "exit status $?: $(cat .err)" ;;
        esac
        for frame in part.*.exr; do
            [ ! -e "$frame" ] || same "$frame" "whole${frame#part}"
        done
        find . -name '.part*.tmp' -delete
    done
    [ $resumed -gt 0 ] || fail 'no run went on from a checkpoint'
    expect 0 "$ST4" ball.st4 -s 400 -o part.####.exr --resume
    for frame in 1 2 3; do
        same part.000$frame.exr whole.000$frame.exr
        [ ! -e part.000$frame.exr.checkpoint ] || fail 'a checkpoint is left'
    done
}

test_interrupted_runs_go_on() {
    make_scene
    local j n
    expect 0 "$ST4" ball.st4 -f 2 -s 1000 -o whole.exr
    for j in 1 2 5; do
        n=0
        # One signal: a second, as timeout sends it to its group, ends st4 in whatever it is doing.
        until timeout --foreground --preserve-status -s INT 0.5 "$ST4" ball.st4 -f 2 -s 1000 \
            -j $j -o part.exr --resume >.out 2>.err; do
            n=$((n + 1))
            [ ! -e part.exr ] || fail 'a picture that is not finished'
            [ $n -lt 1000 ] || fail "no end: $(cat .err)"
        done
        same whole.exr part.exr
        [ -z "$(find . -name '*checkpoint*')" ] || fail 'a checkpoint is left'
        rm part.exr
    done
}

# begin OPTIONS...: an interrupted run of frame 1, which leaves part.exr.checkpoint. In the
# foreground timeout passes a signal on once; of two the second may end st4 before it has spoken.
begin() {
    timeout --foreground --preserve-status -s INT 20 "$ST4" ball.st4 -f 1 -s 1000000 -o part.exr \
        --checkpoint 0.05 "$@" >.out 2>.err &
    local pid=$!
    until [ -e part.exr.checkpoint ] || ! kill -0 $pid; do
        sleep 0.05
    done
    kill -INT $pid
    wait $pid
    [ $? = 130 ] || fail "not interrupted: $(cat .err)"
    has "$(cat .err)" "--resume goes on from 'part.exr.checkpoint'"
}

test_resume_refuses_other_runs() {
    make_scene
    begin
    local args what
    while IFS=: read -r args what; do
        # shellcheck disable=SC2086
        expect 3 "$ST4" ball.st4 -f 1 -s 1000000 -o part.exr --resume $args
        has "$err" "cannot resume from 'part.exr.checkpoint'"
        has "$err" "$what"
    done <<'END'
--seed 7:its seed is 0, where 7 is asked for
--size 32x32:its size is 48x32, where 32x32 is asked for
--tolerance 2:its tolerance is 0, where 2 is asked for
--shutter 0:its shutter is -0.25 to 0.25 frame periods, where
--fps 25:where
--bake:its bake is 0, where 1 is asked for
--aov z:its list of layers is z,normal,samples, where z is asked for
--aov none:its list of layers is z,normal,samples, where none is asked for
--crop 8,40,3,30:its size is 48x32, where 32x27 (crop 8,40,3,30 of 48x32) is asked for
-s 1:samples per pixel, where 1 are asked for
END
    sed 's/0\.3,/0.4,/' ball.st4 >other.st4
    expect 3 "$ST4" other.st4 -f 1 -s 1000000 -o part.exr --resume
    has "$err" 'its sceneHash is'
    # Of the wrong frame.
    cp part.exr.checkpoint part.0002.exr.checkpoint
    expect 3 "$ST4" ball.st4 -f 2 -s 1000000 -o part.####.exr --resume
    has "$err" 'its frame is 1, where 2 is asked for'
    [ ! -e part.exr ] || fail 'a picture was written'
}

test_resume_takes_more_samples() {
    make_scene
    begin --size 160x120 -s 60
    expect 0 "$ST4" ball.st4 -f 1 --size 160x120 -s 70 -o part.exr --resume
    expect 0 "$ST4" ball.st4 -f 1 --size 160x120 -s 70 -o whole.exr
    same part.exr whole.exr
    # Without --resume it is said to be there, and not replaced by one that has less.
    expect 0 "$ST4" ball.st4 -f 1 -s 40 -o all.st4film
    cp all.st4film part.exr.checkpoint
    rm part.exr
    stopped KILL ball.st4 -f 1 -s 40 -o part.exr --checkpoint 0.001
    [ -e part.exr ] || same part.exr.checkpoint all.st4film
    cp all.st4film part.exr.checkpoint
    expect 0 "$ST4" ball.st4 -f 1 -s 40 -o part.exr
    has "$err" 'Wcheckpoint-not-used'
    [ ! -e part.exr.checkpoint ] || fail 'a checkpoint is left'
}

# A finished picture of the same settings is not made again.
test_resume_leaves_finished_pictures() {
    make_scene
    expect 0 "$ST4" ball.st4 -s 4 -f 1-2 -o part.####.exr
    expect 0 "$ST4" ball.st4 -s 4 -o part.####.exr --resume --stats stats.json
    has "$(cat stats.json)" '"frames": 1,'
    expect 0 "$ST4" ball.st4 -s 4 -o whole.####.exr
    local frame
    for frame in 1 2 3; do
        same part.000$frame.exr whole.000$frame.exr
    done
    expect 0 "$ST4" ball.st4 -s 5 -o part.####.exr --resume --stats stats.json
    has "$(cat stats.json)" '"frames": 3,'
}

test_damaged_checkpoints_are_not_believed() {
    make_scene
    begin
    local size place
    size=$(wc -c <part.exr.checkpoint)
    mv part.exr.checkpoint kept
    resume() {
        expect 3 "$ST4" ball.st4 -f 1 -s 1000000 -o part.exr --resume
        has "$err" "cannot resume from 'part.exr.checkpoint': $1"
    }
    for place in 0 1 8 15 16 100 $((size - 1)); do
        head -c "$place" kept >part.exr.checkpoint
        resume ''
    done
    for place in 16 40 300 5000 $((size / 2)) $((size - 3)); do
        cp kept part.exr.checkpoint
        printf '\377\125' | dd of=part.exr.checkpoint bs=1 seek="$place" conv=notrunc 2>/dev/null
        resume damaged
    done
    (cat kept && echo) >part.exr.checkpoint
    resume damaged
    cp kept part.exr.checkpoint
    printf '\11' | dd of=part.exr.checkpoint bs=1 seek=8 conv=notrunc 2>/dev/null
    resume 'a file of sums of version 9, where this st4 reads version 3'
    echo 'nothing of the kind, and long enough' >part.exr.checkpoint
    resume 'not a file of sums'
    : >part.exr.checkpoint
    resume 'not a file of sums'
    rm part.exr.checkpoint
    mkdir part.exr.checkpoint
    resume 'cannot read'
}

# A checkpoint that cannot be written is no reason to stop.
test_runs_go_on_without_checkpoints() {
    make_scene
    mkdir part.exr.checkpoint
    expect 0 "$ST4" ball.st4 -f 1 --size 160x120 -s 60 -o part.exr --checkpoint 0.001 --color never
    [ "$(grep -c 'warning: cannot save the checkpoint' <<<"$err")" = 1 ] || fail "$err"
    has "$err" 'it is a folder'
    has "$err" 'Wcheckpoint-not-saved'
    [ -s part.exr ] || fail 'no picture'
}

slice() { # A B OPTIONS...: samples A to B to A-B.st4film
    expect 0 "$ST4" ball.st4 -f 2 -s 64 --samples "$1-$2" -o "$1-$2.st4film" -q "${@:3}"
}

test_slices_add_up_to_the_same_bytes() {
    make_scene
    local j
    expect 0 "$ST4" ball.st4 -f 2 -s 64 -o whole.exr -q
    expect 0 "$ST4" ball.st4 -f 2 -s 64 -o whole.st4film -q
    expect 0 "$ST4" ball.st4 -f 2 -s 64 -o whole.png -q
    for j in 1 2 5; do
        slice 1 32 -j $j
        slice 33 50 -j $j
        slice 51 64 -j $((j % 2 + 1))
        expect 0 "$ST4" merge 51-64.st4film 1-32.st4film 33-50.st4film -o merged.exr \
            -o merged.st4film -o merged.png
        has "$err" 'samples 1 to 64 of 64'
        same merged.exr whole.exr
        same merged.st4film whole.st4film
        same merged.png whole.png
    done
    # By way of a part of them, and with more samples later.
    expect 0 "$ST4" merge 51-64.st4film 33-50.st4film -o later.st4film -q
    expect 0 "$ST4" merge 1-32.st4film later.st4film -o merged.exr -q
    same merged.exr whole.exr
    expect 0 "$ST4" ball.st4 -f 2 -s 80 --samples 65-80 -o more.st4film -q
    expect 0 "$ST4" merge whole.st4film more.st4film -o merged.exr -q
    expect 0 "$ST4" ball.st4 -f 2 -s 80 -o more.exr -q
    same merged.exr more.exr
    expect 0 "$ST4" info later.st4film
    has "$out" '33 to 64 of 64'
}

test_slices_are_refused() {
    make_scene
    local args what
    slice 1 32
    slice 33 64
    cp 1-32.st4film a.st4film
    while IFS=: read -r args what; do
        # shellcheck disable=SC2086
        expect 0 "$ST4" ball.st4 -f 2 -s 64 --samples 33-64 -o other.st4film -q $args
        expect 3 "$ST4" merge a.st4film other.st4film -o no.exr
        has "$err" "a.st4film and other.st4film are not of one picture: the $what"
    done <<'END'
--seed 3:seed of one is 0, of the other 3
--size 32x32:size of one is 48x32, of the other 32x32
-f 3:frame of one is 2, of the other 3
--tolerance 2:tolerance of one is 0, of the other 2
--aov z,motion:list of layers of one is z,normal,samples, of the other z,motion
--crop 0,48,1,32:size of one is 48x32, of the other 48x31 (crop 0,48,1,32 of 48x32)
END
    sed 's/0\.3,/0.4,/' ball.st4 >other.st4
    expect 0 "$ST4" other.st4 -f 2 -s 64 --samples 33-64 -o other.st4film -q
    expect 3 "$ST4" merge a.st4film other.st4film -o no.exr
    has "$err" 'the sceneHash of one is'
    expect 3 "$ST4" merge a.st4film 1-32.st4film -o no.exr
    has "$err" 'overlap: samples 1 to 32 are in both'
    expect 3 "$ST4" merge a.st4film -o no.exr
    has "$err" 'samples 33 to 64 of 64 are missing'
    expect 3 "$ST4" merge 33-64.st4film -o no.exr
    has "$err" 'samples 1 to 32 of 64 are missing'
    slice 40 64
    expect 3 "$ST4" merge a.st4film 40-64.st4film -o no.st4film
    has "$err" 'samples 33 to 39 are missing, between a.st4film and 40-64.st4film'
    expect 3 "$ST4" merge a.st4film missing.st4film -o no.exr
    has "$err" 'missing.st4film: cannot read'
    head -c 5000 33-64.st4film >short.st4film
    expect 3 "$ST4" merge a.st4film short.st4film -o no.exr
    has "$err" 'short.st4film: damaged'
    expect 3 "$ST4" info short.st4film
    printf 'x' | dd of=33-64.st4film bs=1 seek=20000 conv=notrunc 2>/dev/null
    expect 3 "$ST4" merge a.st4film 33-64.st4film -o no.exr
    has "$err" '33-64.st4film: damaged: the checksum'
    expect 3 "$ST4" merge ball.st4 a.st4film -o no.exr
    has "$err" 'ball.st4: not a file of sums'
    expect 3 "$ST4" merge a.st4film -o none/no.st4film
    begin
    expect 3 "$ST4" merge part.exr.checkpoint -o no.exr
    has "$err" 'not finished: pixels have'
    expect 0 "$ST4" info part.exr.checkpoint
    has "$out" 'not finished'
    [ ! -e no.exr ] && [ ! -e no.st4film ] || fail 'something was written'
}

# With all that a film can hold, of the whole and of a part: stopped runs and slices, and runs of
# more samples later, give the bytes of one run.
test_all_layers_are_kept() {
    make_scene
    local all=z,normal,albedo,position,motion,object,material,samples,variance,time
    local crop kind n=0
    for crop in '' '--crop 5,41,3,30'; do
        # shellcheck disable=SC2086
        set -- --aov $all $crop
        for kind in exr st4film png; do
            expect 0 "$ST4" ball.st4 -f 2 -s 64 -o whole.$kind -q "$@"
        done
        slice 1 20 -j 2 "$@"
        slice 21 64 -j 1 "$@"
        expect 0 "$ST4" merge 21-64.st4film 1-20.st4film -q -o sum.exr -o sum.st4film -o sum.png
        for kind in exr st4film png; do
            same sum.$kind whole.$kind
        done
        expect 0 "$ST4" ball.st4 -f 2 -s 64 -o whole.exr --resume --stats stats.json "$@"
        has "$(cat stats.json)" '"frames": 0,'
        cp 1-20.st4film part.exr.checkpoint
        until stopped INT ball.st4 -f 2 -s 64 -j 2 -o part.exr --checkpoint 0.01 --resume "$@"; do
            n=$((n + 1))
            [ $n -lt 1000 ] || fail "no end: $(cat .err)"
        done
        same part.exr whole.exr
        rm part.exr
        expect 0 "$ST4" info whole.st4film
        has "$out" "$all"
        [ -z "$crop" ] || has "$out" '5,41,3,30 of 48x32'
    done
    expect 0 "$ST4" info sum.exr
    has "$out" '"gloss@4"'
    slice 1 20 --aov "$all" --crop 4,40,3,30
    expect 3 "$ST4" merge 1-20.st4film 21-64.st4film -o no.exr
    has "$err" '36x27 (crop 4,40,3,30 of 48x32), of the other 36x27 (crop 5,41,3,30 of 48x32)'
}

# A slice is a run like others: it can be interrupted.
test_slices_go_on() {
    make_scene
    expect 0 "$ST4" ball.st4 -f 2 -s 1000 --samples 401-1000 -o whole.st4film -q
    until timeout --preserve-status -s INT 0.5 "$ST4" ball.st4 -f 2 -s 1000 --samples 401-1000 \
        -o part.st4film --resume -q; do
        [ -e part.st4film.checkpoint ] || continue # it was interrupted before there was a sample
        expect 3 "$ST4" ball.st4 -f 2 -s 1000 --samples 400-1000 -o part.st4film --resume
        has "$err" 'it begins with sample 401, where sample 400 is asked for'
    done
    same whole.st4film part.st4film
}

# Five processes at ten frames, each of which is rendered by one, as their statistics say.
test_frames_are_shared_out() {
    make_scene
    local i pids=() total
    expect 0 "$ST4" ball.st4 -f 1-10 -s 40 -o whole.####.exr -q
    for i in 1 2 3 4 5; do
        "$ST4" ball.st4 -f 1-10 -s 40 -o part.####.exr -o part.####.png --skip-existing -j 1 \
            --stats stats$i.json -Wno-frame-locked 2>err$i </dev/null &
        pids+=($!)
    done
    for i in "${pids[@]}"; do
        wait "$i" || fail "$(cat err*)"
    done
    total=$(cat stats?.json | awk '/"frames"/ { n += $2 } END { print n }')
    [ "$total" = 10 ] || fail "$total frames were rendered: $(cat err*)"
    for i in 01 02 03 04 05 06 07 08 09 10; do
        same part.00$i.exr whole.00$i.exr
        [ -s part.00$i.png ] || fail "no part.00$i.png"
    done
    [ -z "$(ls ./*.lock 2>/dev/null)" ] || fail 'a lock is left'
}

test_pictures_that_exist_are_left() {
    make_scene
    echo mine >part.0002.exr
    expect 0 "$ST4" ball.st4 -s 4 -o part.####.exr --skip-existing
    has "$err" 'wrote 2 frames'
    has "$err" 'left 1'
    [ "$(cat part.0002.exr)" = mine ] || fail 'overwritten'
    # A kind of picture that is missing is made from what is there.
    expect 0 "$ST4" ball.st4 -s 4 -f 1 -o part.####.exr -o part.####.png --skip-existing
    [ -s part.0001.png ] || fail 'no PNG'
}

test_stale_locks_are_taken_over() {
    make_scene
    # Of a process of this machine that was killed.
    "$ST4" ball.st4 -f 1 -s 10000000 -o part.exr --skip-existing -q &
    local pid=$!
    until [ -s part.exr.lock ] || ! kill -0 $pid; do
        sleep 0.05
    done
    expect 0 "$ST4" ball.st4 -f 1 -s 4 -o part.exr --skip-existing --color never
    has "$err" "warning: frame 1 is left to process $pid on"
    has "$err" "'part.exr.lock'"
    [ ! -e part.exr ] || fail 'rendered twice at once'
    kill -KILL $pid
    wait $pid
    [ -e part.exr.lock ] || fail 'the lock is gone too early'
    expect 0 "$ST4" ball.st4 -f 1 -s 4 -o part.exr --skip-existing -Werror
    [ -s part.exr ] && [ ! -e part.exr.lock ] || fail 'not taken over'
    # Of another machine: until the file is removed.
    rm part.exr
    echo 'elsewhere.example 17 2026-01-02T03:04:05Z' >part.exr.lock
    expect 0 "$ST4" ball.st4 -f 1 -s 4 -o part.exr --skip-existing
    has "$err" 'process 17 on elsewhere.example since 2026-01-02T03:04:05Z'
    [ ! -e part.exr ] && [ -e part.exr.lock ] || fail 'the lock was not respected'
    # Made, but left without content for long.
    : >part.exr.lock
    expect 0 "$ST4" ball.st4 -f 1 -s 4 -o part.exr --skip-existing -Werror
    [ -s part.exr ] && [ ! -e part.exr.lock ] || fail 'not taken over'
}

# A process killed after its picture was there leaves nothing that stays.
test_leavings_of_the_dead_are_removed() {
    make_scene
    expect 0 "$ST4" ball.st4 -f 1-2 -s 4 -o part.####.exr -q
    expect 0 "$ST4" ball.st4 -f 1 -s 4 -o part.st4film -q
    cp part.st4film part.0001.exr.checkpoint
    echo "$(uname -n) 1 2026-01-02T03:04:05Z" >part.0001.exr.lock
    expect 0 "$ST4" ball.st4 -f 1-2 -s 4 -o part.####.exr --skip-existing --resume -Werror
    [ -z "$(ls ./*.lock ./*.checkpoint 2>/dev/null)" ] || fail "left: $(ls)"
}

# Two processes, killed again and again, in one folder: each frame comes out, once, whole.
test_kills_lose_no_frame_of_several_runs() {
    make_scene
    RANDOM=${SEED:-2}
    local n kills=$([ -n "${STRESS-}" ] && echo 500 || echo 10) frame
    expect 0 "$ST4" ball.st4 -f 1-4 -s 300 -o whole.####.exr -q
    for ((n = 0; n < kills; n++)); do
        for frame in 1 2; do
            (stopped KILL ball.st4 -f 1-4 -s 300 -j 1 -o part.####.exr --skip-existing --resume \
                --checkpoint 0.02) &
        done
        wait
        for frame in part.*.exr; do
            [ ! -e "$frame" ] || same "$frame" "whole${frame#part}"
        done
        [ -e part.0004.exr ] && rm part.*.exr
    done
    expect 0 "$ST4" ball.st4 -f 1-4 -s 300 -o part.####.exr --skip-existing --resume -Werror
    for frame in 1 2 3 4; do
        same part.000$frame.exr whole.000$frame.exr
    done
    [ -z "$(ls ./*.lock ./*.checkpoint 2>/dev/null)" ] || fail 'something is left'
}

# nothing_left FOLDER: no picture, whole or half, and nothing temporary.
nothing_left() {
    [ -z "$(ls -A "$1")" ] || fail "left behind: $(ls -A "$1")"
}

test_full_disks_leave_nothing_half_written() {
    make_scene
    local format
    mkdir small
    (
        ulimit -f 20
        expect 3 "$ST4" ball.st4 -f 1 --size 200x200 -s 1 -o small/a.exr --checkpoint 0.001
        has "$err" "cannot write 'small/a.exr': cannot write: File too large"
        nothing_left small
        expect 3 "$ST4" ball.st4 -f 1 --size 200x200 -s 1 -o small/a.st4film
        has "$err" 'File too large'
        nothing_left small
        for format in png jpg tif bmp tga webp; do
            expect 3 "$ST4" ball.st4 -f 1 --size 400x400 -s 1 -o small/a.$format --checkpoint 0
            has "$err" "cannot write 'small/a.$format': cannot write: File too large"
            nothing_left small
        done
    ) || exit 1
    # A disk of its own, where mounting is allowed.
    mount -t tmpfs -o size=64k none small 2>/dev/null || return 0
    (
        expect 3 "$ST4" ball.st4 -f 1 --size 200x200 -s 1 -o small/a.exr
        has "$err" "cannot write 'small/a.exr': cannot write: No space left on device"
        nothing_left small
        expect 3 "$ST4" ball.st4 -f 1 --size 200x200 -s 1 -o small/a.st4film
        has "$err" 'No space left on device'
        nothing_left small
        # What has room stays.
        expect 3 "$ST4" ball.st4 --size 60x40 -f 1-9 -s 1 -o small/a.####.exr
        expect 0 "$ST4" info small/a.0001.exr
        [ -z "$(find small -name '*.tmp')" ] || fail "$(ls -A small)"
    )
    local status=$?
    umount small
    return $status
}

test_folders_that_cannot_be_written_are_told_before_the_first_ray() {
    make_scene
    local path
    for path in none/a.exr none/a.st4film /proc/a.exr ball.st4/a.exr; do
        expect 3 "$ST4" ball.st4 -f 1 -s 10000000 -o "$path"
        has "$err" "cannot write '$path': cannot create"
    done
    mkdir locked
    chmod a-w locked
    [ -w locked ] || { # to the superuser it is
        expect 3 "$ST4" ball.st4 -f 1 -s 10000000 -o locked/a.exr --skip-existing
        has "$err" 'Permission denied'
    }
}

# What is in the way of a finished picture costs nothing but a second run.
test_pictures_that_cannot_be_written_keep_their_sums() {
    make_scene
    "$ST4" ball.st4 -f 1 --size 160x120 -s 60 -o part.exr --checkpoint 0.02 2>.err </dev/null &
    local pid=$!
    until [ -e part.exr.checkpoint ] || ! kill -0 $pid; do
        sleep 0.02
    done
    mkdir part.exr
    wait $pid
    [ $? = 3 ] || fail "no failure: $(cat .err)"
    has "$(cat .err)" "cannot write 'part.exr': cannot write: it is a folder; its checkpoint is kept"
    rmdir part.exr
    expect 0 "$ST4" ball.st4 -f 1 --size 160x120 -s 60 -o part.exr --resume --stats stats.json
    grep -q '"camera": 0,' stats.json || fail 'samples were traced again'
    expect 0 "$ST4" ball.st4 -f 1 --size 160x120 -s 60 -o whole.exr
    same part.exr whole.exr
}

test_progress_is_told() {
    make_scene
    expect 0 "$ST4" ball.st4 -s 40 --size 160x120 -o a.####.exr
    [ "$(wc -l <<<"$err")" = 1 ] || fail "not quiet where nobody watches: $err"
    expect 0 "$ST4" ball.st4 -s 40 --size 160x120 -o a.####.exr --progress json -q
    [[ $err == '{"version":1,"event":"begin","frames":3,"samples":2304000}'* ]] || fail "$err"
    has "$err" '"event":"progress","frame":1,"done":0.'
    has "$err" '{"version":1,"event":"frame","frame":2,"done":0.6667}'
    [[ $err == *'{"version":1,"event":"end","done":1.0000,"seconds":'*'}' ]] || fail "$err"
    if command -v python3 >/dev/null; then
        python3 -c 'import json, sys; [json.loads(line) for line in sys.stdin]' <<<"$err" || fail "$err"
    fi
    expect 0 "$ST4" ball.st4 -s 40 --size 160x120 -o a.####.exr --progress bar -q
    has "$err" 'Msamples/s'
    has "$err" ' left'
    # What was there before counts as done, not as fast.
    expect 0 "$ST4" ball.st4 -s 40 --size 160x120 -o a.####.exr --progress json -q --resume
    has "$err" '"event":"end","done":1.0000'
    lacks "$err" '"event":"frame"'
}
