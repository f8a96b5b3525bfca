# SPDX-License-Identifier: Apache-2.0
# Scenes that ask for too much, or for what is none of theirs: a clear message, soon, in little
# memory. Bounds of time are generous, since machines differ: without a bound these never end.

# bounded STATUS TEXT [ARGUMENT...]: of the scene of standard input, `check` says TEXT.
bounded() {
    local status=$1 text=$2
    shift 2
    cat >bad.st4
    expect "$status" timeout 20 bash -c 'ulimit -v 8000000; exec "$@"' - \
        "$ST4" check "${@:-bad.st4}" --color never
    has "$err" "$text"
}

# many N TEXT: TEXT, so many times.
many() {
    awk -v n="$1" -v text="$2" 'BEGIN { for (i = 0; i < n; i++) printf "%s", text }'
}

test_bounds_of_loops() {
    bounded 1 '1e+18 values' <<<'for i in 0..1e18 { sphere { } }'
    bounded 1 '1e+18 values' <<<'let a = [for i in 0..1e18: i] sphere { radius = a[0] }'
    bounded 1 '1e+300 values' <<<'for i in 0..1 by 1e-300 { sphere { } }'
    bounded 1 'a range goes from' <<<'for i in 0..1/0 { sphere { } }'
    bounded 1 'copies' <<<'for i in 0..9999 { for j in 0..9999 { for k in 0..9999 { sphere { } } } }'
    bounded 1 'steps' <<<'let a = [for i in 0..9999: [for j in 0..9999: [for k in 0..9999: i]]]
        sphere { radius = a[1][1][1] }'
}

test_bounds_of_recursion() {
    bounded 1 '256 deep' <<<'fn f(n) = f(n + 1)  sphere { radius = f(0) }'
    bounded 1 'steps' <<<'fn f(n) = n < 2 ? n : f(n - 1) + f(n - 2)  sphere { radius = f(60) }'
    bounded 1 '1048576 bytes' <<<'fn f(s, n) = n > 0 ? f(s + s, n - 1) : s  print f("ab", 99)'
    bounded 1 '256 deep' <<<'def A { A { } }  A { }'
    local twice='def A(n) { if n > 0 { A(n - 1) { } A(n - 1) { translate x } } else { sphere { } } }'
    bounded 1 'copies of defs' <<<"$twice A(20) { }"
    bounded 0 '' <<<"$twice A(12) { }"
}

test_bounds_of_nesting() {
    bounded 1 '256' < <(echo "sphere { radius = $(many 100000 '(')1")
    bounded 1 '256' < <(echo "sphere { radius = $(many 100000 '[')1")
    bounded 1 '256' < <(echo "sphere { radius = $(many 100000 '- ')1 }")
    bounded 1 '256' < <(many 100000 'group { ')
    bounded 1 '1000' < <(echo "sphere { radius = $(many 100000 '1+')1 }")
    bounded 1 'nested too deeply' < <(
        seq 0 5000 | awk '{ print "let a" $1 " = a" $1 + 1 }'
        echo 'let a5001 = 1  sphere { radius = a0 }'
    )
}

# Lists that share their items are small, and have more of them than can be looked at.
test_bounds_of_lists() {
    local lists
    lists=$(seq 0 59 | awk '{ print "let a" $1 " = [a" $1 + 1 ", a" $1 + 1 "]" }')
    bounded 1 'steps' <<<"$lists let a60 = 1  sphere { visible = a0 == a0 }"
    bounded 0 '' <<<"$lists let a60 = t  print a0  sphere { }"
    echo "$lists let a60 = t  sphere { }" >lists.st4
    expect 0 timeout 20 "$ST4" eval lists.st4 a0
}

test_bounds_of_meshes() {
    bounded 1 'more than 16777216' <<<'mesh { points = [x, y, z]  subdivide = 8
        faces = [for i in 0..999: [0, 1, 2]] }'
    bounded 1 '16777216' <<<'surface { res = <65536, 65536>  fn at(u, v) = <u, v, 0> }'
}

# A line of any length is one line: the time that reports take does not grow with it.
test_bounds_of_lines() {
    bounded 1 'raduis' < <(many 100000 'sphere { raduis = 1 } ')
    bounded 1 'raduis' < <(printf 'sphere { /*'; many 1000000 $'\xcc\x81'; echo '*/ raduis = 1 }')
    [ "${#err}" -lt 10000 ] || fail "${#err} characters"
}

test_files_stay_within_their_folder() {
    mkdir in out
    echo 'sphere { }' >out/other.st4
    ln -s ../out/other.st4 in/link.st4
    ln -s ../out in/folder
    ln -s /dev/zero in/zero.st4
    ln -s self.st4 in/self.st4
    mkfifo in/pipe.st4 in/pipe.csv in/pipe.obj
    truncate -s 5G in/large.st4
    local name
    for name in link.st4 folder/other.st4 ../out/other.st4 /etc/passwd zero.st4; do
        echo "include \"$name\"" >in/scene.st4
        bounded 3 'lies outside' in/scene.st4 </dev/null
    done
    for name in 'include "pipe.st4"' 'sphere { radius = table("pipe.csv", t) }' \
        'mesh { file = "pipe.obj" }'; do
        echo "$name" >in/scene.st4
        bounded 3 'not a regular file' in/scene.st4 </dev/null
    done
    echo 'include "large.st4"' >in/scene.st4
    bounded 3 'too large' in/scene.st4 </dev/null
    for name in out/s no-folder/s; do
        touch out/s0001.obj
        echo "mesh { frames = \"../$name%04d.obj\" }" >in/scene.st4
        bounded 3 'lies outside' in/scene.st4 </dev/null
        echo "mesh { file = \"../$name.obj\" }" >in/scene.st4
        bounded 3 'lies outside' in/scene.st4 </dev/null
    done
    echo 'include "self.st4"' >in/scene.st4
    bounded 3 'there is no file' in/scene.st4 </dev/null
    bounded 1 'NUL byte' /dev/zero </dev/null
    truncate -s 100M in/large.st4
    bounded 3 'memory' --memory 64M in/large.st4 </dev/null
    bounded 1 "without '..'" <<<'film { out = "../a.png" }  sphere { }'
    bounded 1 "without '..'" <<<'film { out = "/tmp/a.png" }  sphere { }'
}
