# SPDX-License-Identifier: Apache-2.0
# Bad input: one clear message, the stated exit status, nothing left behind.

# refuses STATUS TEXT: the scene of standard input is refused, with one error that says TEXT.
refuses() {
    cat >bad.st4
    expect "$1" "$ST4" bad.st4 --size 8x8 -s 1 -o bad.exr --color never
    errors "$err" 1
    has "$err" "$2"
    [ ! -e bad.exr ] || fail 'a picture was written'
}

test_unknown_property() {
    refuses 1 "sphere has no property 'raduis'" <<<'sphere { raduis = 2cm }'
    has "$err" 'bad.st4:1:10: error:'
    has "$err" "did you mean 'radius'?"
    has "$err" '^~~~~~'
}

test_empty_file() {
    : >empty.st4
    expect 1 "$ST4" empty.st4
    errors "$err" 1
    refuses 1 '' <<<'// nothing but a comment'
}

test_deep_nesting() {
    refuses 1 '256' < <(printf 'let a = '; printf '(%.0s' {1..300}; printf '1'; printf ')%.0s' {1..300})
    refuses 1 '256' < <(printf 'group { %.0s' {1..300}; printf '}%.0s' {1..300})
}

test_constant_nan() {
    refuses 1 'finite' <<<'sphere { radius = sqrt(-1) }'
}

test_not_supported_yet() {
    refuses 1 'not supported yet' <<<'box { size = <0, t, 1> }'
}

test_missing_mesh() {
    refuses 3 'nosuch.obj' <<<'mesh { file = "nosuch.obj" }'
    mkdir folder.obj
    refuses 3 'folder.obj' <<<'mesh { file = "folder.obj" }'
}

test_damaged_mesh() {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' >bad.obj
    refuses 3 'line 4' <<<'mesh { file = "bad.obj" }'
    printf 'ply\nformat binary_little_endian 1.0\nelement vertex 99999999\nend_header\n' >bad.ply
    refuses 3 'bad.ply' <<<'mesh { file = "bad.ply" }'
}

test_missing_scene() {
    expect 3 "$ST4" nosuch.st4
    [ "$(wc -l <<<"$err")" = 1 ] || fail "$err"
    has "$err" 'nosuch.st4'
    expect 3 "$ST4" .
}

test_unwritable_output() {
    echo 'sphere {}' >ok.st4
    expect 3 "$ST4" ok.st4 --size 8x8 -s 1 -o nosuch/picture.exr
    has "$err" 'nosuch/picture.exr'
    mkdir folder.exr
    expect 3 "$ST4" ok.st4 --size 8x8 -s 1 -o folder.exr
    expect 3 "$ST4" ok.st4 --size 8x8 -s 1 -o picture.nosuch
    expect 3 "$ST4" ok.st4 --size 8x8 -s 1 -o picture.exr --stats nosuch/stats.json
    has "$err" 'nosuch/stats.json'
    [ ! -e picture.exr ] || fail 'rendered before it was known that the counts cannot be written'
}

test_zero_area_mesh_warns() {
    printf 'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n' >line.obj
    echo 'mesh { file = "line.obj" }  sphere { radius = 0.1 }' >line.st4
    expect 0 "$ST4" line.st4 --size 8x8 -s 1 -o line.exr --color never
    errors "$err" 0
    has "$err" 'warning:'
    has "$err" 'degenerate'
    expect 0 "$ST4" line.st4 --size 8x8 -s 1 -o line.exr -Wno-degenerate
    lacks "$err" 'warning:'
}

test_motion_that_is_not_finite_warns() {
    cat >pole.st4 <<'END'
film { frames = 1..2 }
sphere { radius = 0.1 }
surface { fn at(u, v) = <u, v, 0>  res = <4, 4>
          fn deform(p) = p + <0, sqrt(1/24 - t), 0> }
END
    expect 0 "$ST4" pole.st4 --size 8x8 -s 1 -o pole.####.exr --color never
    errors "$err" 0
    has "$err" 'not-finite'
    expect 1 "$ST4" check pole.st4 -Werror --color never
}

test_several_errors_at_once() {
    printf 'sphere { a = 1 }\nbox { b = 1 }\nplane { c = 1 }\n' >three.st4
    expect 1 "$ST4" check three.st4 --color never
    errors "$err" 3
}

test_diagnostics_as_json() {
    echo 'sphere { raduis = 2cm }' >bad.st4
    expect 1 "$ST4" check bad.st4 --diag json
    [ "$(wc -l <<<"$err")" = 1 ] || fail "$err"
    [[ $err == '{'*'}' ]] || fail "$err"
    has "$err" '"version":1'
    has "$err" '"severity":"error"'
    has "$err" '"line":1'
    has "$err" '"column":10'
}

test_check_loads_no_image_library() {
    cp "$ROOT/examples/hello.st4" .
    LD_DEBUG=files LD_DEBUG_OUTPUT=libraries "$ST4" check hello.st4 >/dev/null || fail "status $?"
    grep -q 'libc.so' libraries.* || fail 'the loader says nothing'
    ! grep -qiE 'OpenImageIO|st4-image|assimp' libraries.* || fail 'an image library was loaded'
}

test_default_names_of_pictures() {
    echo 'film { frames = 1..3 }  sphere {}' >ball.st4
    expect 0 "$ST4" ball.st4 --size 8x8 -s 1
    [ -e ball.0001.exr ] && [ -e ball.0003.exr ] || fail "$(ls)"
    expect 0 "$ST4" ball.st4 --size 8x8 -s 1 -f 2
    [ -e ball.exr ] || fail "$(ls)"
    expect 0 "$ST4" ball.st4 --size 8x8 -s 1 -o out.exr
    [ -e out.0002.exr ] || fail "$(ls)"
    [ -z "$(find . -name '*tmp*')" ] || fail "$(ls)"
}

test_interrupt_keeps_finished_pictures() {
    echo 'sphere { translate <t/100, 0, 0> }' >long.st4
    # A shell's background jobs ignore interrupts; timeout does not, and passes them on.
    timeout --preserve-status -s INT 100 "$ST4" long.st4 -f 1-50000 --size 32x32 -s 16 \
        -o long.####.exr 2>.err &
    local pid=$! status
    until [ -e long.0002.exr ] || ! kill -0 $pid; do
        sleep 0.1
    done
    kill -INT $pid
    wait $pid
    status=$?
    [ $status = 130 ] || fail "exit status $status instead of 130: $(cat .err)"
    expect 0 "$ST4" info long.0001.exr
    [ -z "$(find . -name '*tmp*')" ] || fail "left behind: $(find . -name '*tmp*' | head -3)"
}

# Memory for what a script asks for is bounded; a little is always there.
test_memory_bounds_loading() {
    echo 'let a = [for i in 0..2999999: [i, i + 1]] sphere { radius = a[7][0] }' >big.st4
    expect 3 "$ST4" check --memory 64M big.st4
    has "$err" 'error: out of memory'
    has "$err" '--memory'
    echo 'sphere { }' >small.st4
    expect 0 "$ST4" check --memory 64K small.st4
}

# Every file of a circle of includes is named.
test_include_cycles_are_named() {
    echo 'include "b.st4"' >a.st4
    echo 'include "c.st4"' >b.st4
    echo 'include "b.st4"' >c.st4
    expect 1 "$ST4" check a.st4
    has "$err" 'c.st4:1:9: error:'
    has "$err" 'b.st4 -> c.st4 -> b.st4'
}

# What is to be replaced is what is marked.
test_marks_what_to_replace() {
    local line marked
    while IFS="|" read -r line marked; do
        printf 'include "colors.st4" as colors\n%s\n' "$line" >mark.st4
        expect 1 "$ST4" check mark.st4 --color never
        errors "$err" 1
        has "$err" "$(printf '      | %*s^' "$(($(awk -v a="$line" -v b="$marked" \
            'BEGIN { print index(a, b) }') - 1))" '')"
        has "$err" "^$(printf '%*s' $((${#marked} - 1)) '' | tr ' ' '~') "
    done <<'END'
print <1, 2, 3> + 1.5|1.5
print 1.5 - <1, 2, 3>|1.5
print 90deg + 500|500
print 500 - 90deg|500
print 90deg ^ 2|90deg
print 2 ^ 90deg|90deg
print colors.cora|cora
sphere { rotate x 90deg }|90deg
film { size = 640x480 }|x480
END
}
