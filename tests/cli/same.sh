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
    render scalar -f 12 --cpu scalar
    render best -f 12
    same scalar/frame.0012.exr best/frame.0012.exr
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
