# SPDX-License-Identifier: Apache-2.0
# A picture depends on the scene and its settings alone: not on threads, neighbours or memory.

# render NAME OPTIONS...: the propeller, small, to NAME/.
render() {
    local name=$1
    shift
    mkdir -p "$name"
    expect 0 "$ST4" "$ROOT/examples/${SCENE:-propeller}.st4" --size 64x40 -s 4 --tolerance 1 \
        -o "$name/frame.####.exr" "$@"
}

test_same_bytes_for_any_threads() {
    SCENE=head
    render one -j 1 -f 12
    render two -j 2 -f 12
    render five -j 5 -f 12
    same one/frame.0012.exr two/frame.0012.exr
    same one/frame.0012.exr five/frame.0012.exr
}

test_same_bytes_alone_and_among_others() {
    local SCENE
    for SCENE in propeller head bunny; do
        render alone -f 2
        render among -f 1-3
        same alone/frame.0002.exr among/frame.0002.exr
        differ among/frame.0001.exr among/frame.0002.exr
    done
}

test_same_bytes_for_any_memory() {
    SCENE=head
    render much -f 11-12 --stats much.json
    render little -f 11-12 --memory 1M --stats little.json --validate
    same much/frame.0011.exr little/frame.0011.exr
    same much/frame.0012.exr little/frame.0012.exr
    [ "$(grep -o '"blocks": *[0-9]*' much.json)" != "$(grep -o '"blocks": *[0-9]*' little.json)" ] ||
        fail 'the frames were sampled in the same blocks'
}

test_same_bytes_scalar_and_wide() {
    SCENE=head
    render best -f 12 --stats best.json
    for cpu in scalar avx2 avx512; do
        case $cpu in
        scalar) flag=fpu ;;
        avx512) flag=avx512bw ;;
        *) flag=$cpu ;;
        esac
        grep -qw "$flag" /proc/cpuinfo || continue
        render $cpu -f 12 --cpu $cpu --stats $cpu.json
        has "$(cat $cpu.json)" "\"cpu\": \"$cpu\""
        same $cpu/frame.0012.exr best/frame.0012.exr
        best=$cpu
    done
    has "$(cat best.json)" "\"cpu\": \"$best\"" # as if it had been named
}

test_same_picture_through_any_structure() {
    SCENE=head
    render tree -f 12
    render brute -f 12 --accel brute
    same tree/frame.0012.exr brute/frame.0012.exr
}

test_seeds_differ() {
    render a -f 1
    render b -f 1 --seed 1
    differ a/frame.0001.exr b/frame.0001.exr
}

# instructions ARGUMENTS...: how many the program takes, of its own and of its libraries.
instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$ST4" "$@" 2>&1 |
        sed -nE 's/.*Collected : ([0-9]+).*/\1/p'
}

# What can move costs nothing where nothing does: against a tree that knows no time, on a scene that
# stands still.
test_still_scenes_pay_for_no_motion() {
    local run=(render still.st4 --size 24x18 -s 16 --threads 1 -q -o still.exr) still none
    command -v valgrind >/dev/null || {
        echo 'skipped: it counts instructions with valgrind, which is not installed'
        return
    }
    cat >still.st4 <<'END'
camera { from = <0, 1, 4>  to = <0, 0, 0> }
sun {}
surface {
    u = 0turn..1turn  v = 0turn..0.5turn  res = <60, 40>
    fn at(u, v) = <sin(v)*cos(u), cos(v), sin(v)*sin(u)>
}
for i in 0..99 {
    box {
        size = <0.1, 0.1, 0.1>  rotate y, 37deg*i
        translate <2*rand(i, 0) - 1, 2*rand(i, 1) - 1, 1.5*rand(i, 2)>
    }
}
plane { offset = -1 }
END
    still=$(instructions "${run[@]}")
    none=$(instructions "${run[@]}" --accel kd3)
    below 1e6 "$still"
    below "$still" "$(awk -v n="$none" 'BEGIN { print 1.02 * n }')"
}
