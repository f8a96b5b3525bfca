# SPDX-License-Identifier: Apache-2.0
# Movies: what the encoder is given, and what comes of its failures. The real one is asked where it
# is installed.

a_film() {
    cat >film.st4 <<'END2'
film { size = <15, 9>  fps = 23.976  frames = 1..3 }
sphere { translate <5*t, 0, 0> }
END2
}

# An encoder that notes its arguments and writes what it was fed into its output.
an_encoder() {
    mkdir -p bin
    cat >bin/ffmpeg <<'END2'
#!/bin/sh
for last; do :; done
printf '%s\n' "$@" >"$NOTES"
cat >"${last#file:}"
END2
    chmod +x bin/ffmpeg
    export NOTES=$PWD/notes
}

test_movie_is_fed_frames() {
    a_film
    an_encoder
    PATH=$PWD/bin:$PATH expect 0 "$ST4" film.st4 -q -s 2 -o '####.exr' -o '####.bmp' --movie film.mp4
    # Three frames of 16x10 pixels: sides are made even.
    [ "$(wc -c <film.mp4)" = $((3 * 16 * 10 * 3)) ] || fail "$(wc -c <film.mp4) bytes"
    has "$(tr '\n' ' ' <notes)" '-video_size 16x10 -framerate 2997/125 '
    has "$(tr '\n' ' ' <notes)" ' -f mp4 file:'
    [ "$(ls -A | grep -c tmp)" = 0 ] || fail "$(ls -A)"
    # The first line is that of the picture. BMP files end with it, blue first, padded to 48 bytes.
    head -c 45 film.mp4 | od -An -tu1 -v | tr -s ' \n' '\n\n' | sed '/^$/d' | paste -d ' ' - - - >got
    tail -c 48 0001.bmp | head -c 45 | od -An -tu1 -v | tr -s ' \n' '\n\n' | sed '/^$/d' |
        paste -d ' ' - - - | awk '{ print $3, $2, $1 }' >wanted
    [ "$(wc -l <wanted)" = 15 ] || fail "$(wc -l <wanted) pixels in a line"
    same got wanted
}

test_movie_failures_are_told() {
    a_film
    an_encoder
    printf '#!/bin/sh\necho the encoder is broken >&2\nexit 7\n' >bin/ffmpeg
    echo before >film.mp4
    PATH=$PWD/bin:$PATH expect 3 "$ST4" film.st4 -q -s 2 --movie film.mp4
    has "$err" 'film.mp4: ffmpeg failed (exit status 7): the encoder is broken'
    [ "$(cat film.mp4)" = before ] || fail 'the old movie is gone'
    [ -s film.0003.exr ] || fail 'the pictures are gone'
    [ "$(ls -A | grep -c tmp)" = 0 ] || fail "$(ls -A)"
    rm film.0003.exr
    expect 3 env PATH=/nowhere "$ST4" film.st4 -q -s 2 --movie film.mp4
    has "$err" 'movies are made by the program ffmpeg, which is not installed'
    [ ! -e film.0003.exr ] || fail 'rendered before it was known'
    PATH=$PWD/bin:$PATH expect 3 "$ST4" film.st4 -q --movie film.mpg
    has "$err" "the name's ending is none of .mp4, .mov, .mkv, .webm, .avi"
    PATH=$PWD/bin:$PATH expect 2 "$ST4" film.st4 -q -o '#.png' --movie film.mp4
    has "$err" 'a movie is made from pictures with the ending .exr'
}

test_movie_interrupted_leaves_nothing() {
    a_film
    an_encoder
    printf '#!/bin/sh\ntouch "$NOTES"\nexec sleep 60\n' >bin/ffmpeg
    # Interrupts of what runs in the background are ignored: SIGTERM is not.
    PATH=$PWD/bin:$PATH "$ST4" film.st4 -q -s 2 --movie film.mp4 &
    local pid=$! status i
    for i in $(seq 600); do
        [ -e notes ] && break
        sleep 0.1
    done
    [ -e notes ] || fail 'the encoder was not started'
    kill -TERM $pid
    wait $pid
    status=$?
    [ $status = 130 ] || fail "exit status $status"
    [ ! -e film.mp4 ] || fail 'a broken movie is there'
    [ "$(ls -A | grep -c tmp)" = 0 ] || fail "$(ls -A)"
}

test_movie_plays() {
    command -v ffmpeg >/dev/null || return 0
    a_film
    expect 0 "$ST4" film.st4 -q -s 2 --movie film.mp4
    expect 0 ffmpeg -v error -i film.mp4 -f rawvideo -pix_fmt rgb24 -y frames
    [ "$(wc -c <frames)" = $((3 * 16 * 10 * 3)) ] || fail "$(wc -c <frames) bytes"
}
