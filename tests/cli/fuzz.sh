# SPDX-License-Identifier: Apache-2.0
# The language under the fuzzer (tests/fuzz): each bug that was found, and what it thinks of now.
#
# STRESS=1 in the environment: 10 million executions instead of 100,000.

test_bugs_stay_mended() {
    (cd "$ROOT" && build/fuzz/fuzz -timeout=20 -rss_limit_mb=512 tests/bugs/* tests/fuzz/corpus/*) \
        >output 2>&1 || fail "$(tail -n 60 output)"
}

test_language_under_fuzzing() {
    local n=100000
    [ -z "${STRESS-}" ] || n=10000000
    "$ROOT/tests/fuzz/run" --jobs 2 --runs $n >output 2>&1 || fail "$(cat output)"
    has "$(cat output)" 'no report'
}
