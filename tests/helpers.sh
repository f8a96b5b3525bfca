# SPDX-License-Identifier: Apache-2.0
# What the tests of tests/cli may use. Each runs in an empty folder, with ROOT (the tree) and ST4
# (the program) set; it passes when its function returns without fail() having been called.
set -u
export XDG_CACHE_HOME=$PWD/.cache

fail() {
    echo "$*" >&2
    exit 1
}

# expect STATUS COMMAND...: runs it; its output is in $out, its errors are in $err.
expect() {
    local wanted=$1 status
    shift
    "$@" >.out 2>.err </dev/null
    status=$?
    out=$(cat .out) err=$(cat .err)
    [ $status = "$wanted" ] && return
    printf '%s\n' "$err" | head -n 20 >&2
    fail "exit status $status instead of $wanted: $*"
}

# has TEXT PART: the part stands in the text.
has() {
    [[ $1 == *"$2"* ]] || fail "no '$2' in: $1"
}

lacks() {
    [[ $1 != *"$2"* ]] || fail "'$2' in: $1"
}

# errors TEXT N: so many diagnostics are errors.
errors() {
    local n
    n=$(grep -c 'error:' <<<"$1")
    [ "$n" = "$2" ] || fail "$n errors instead of $2: $1"
}

same() {
    cmp "$1" "$2" >&2 || fail "$1 and $2 differ"
}

differ() {
    ! cmp -s "$1" "$2" || fail "$1 and $2 are the same"
}

# below X Y: X < Y, as numbers.
below() {
    awk -v x="$1" -v y="$2" 'BEGIN { exit !(x + 0 < y + 0) }' || fail "$1 is not below $2"
}

# at SCENE TIMES EXPR...: the table, without its header, columns separated by spaces.
at() {
    local scene=$1 times=$2
    shift 2
    expect 0 "$ST4" eval "$scene" "$@" --at "$times"
    out=$(tail -n +2 <<<"$out" | tr '\t' ' ')
}

# all_below BOUND: every number of $out but the times, without its sign.
all_below() {
    awk -v most="$1" '{ for (i = 2; i <= NF; i++) if (!($i < most && $i > -most)) bad = bad " " $i }
        END { if (bad) { print "not below " most ":" substr(bad, 1, 300); exit 1 } }' <<<"$out" ||
        fail "too large"
}
