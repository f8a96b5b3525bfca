# SPDX-License-Identifier: Apache-2.0
# st4 measure: what it leaves, how it goes on, what it finds where that is known.

# A bright square that crosses the picture while the shutter is open: four subframes strobe.
crossing() {
    cat >crossing.st4 <<'END'
film { size = <32, 24>  frames = 1..1 }
shutter { angle = 360deg  phase = start }
camera { from = <0, 0, 5>  fov = 28deg  kind = orthographic }
sky { color = <0.1, 0.1, 0.1> }
surface {
  u = -0.2..0.2  v = -0.8..0.8  res = <2, 2>
  fn at(u, v) = <u, v, 0>
  material = glow(<1, 1, 1>, 1)
  translate <-1 + 2*24*t, 0, 0>
}
END
}

# column NAME ARGUMENTS: of the line of results.csv with these arguments.
column() {
    awk -F, -v name="$1" -v arguments="$2" '
        NR == 1 { for (i = 1; i <= NF; i++) if ($i == name) at = i }
        $NF == arguments { print $at; exit }' crossing.measure/results.csv
}

test_measure_finds_strobing() {
    crossing
    expect 0 "$ST4" measure crossing.st4 --budget 15 -s 16 -j 1
    has "$out" 'The front'
    has "$out" 'Best for an error'
    has "$err" 'reference, half 2 of 2'
    local four sixteen noise
    four=$(column bias '-s 16 --method accumulate --subframes 4')
    sixteen=$(column bias_at_most '-s 64')
    [ -n "$four" ] && [ -n "$sixteen" ] || fail "$(cat crossing.measure/results.csv)"
    # Four copies in place of a ramp: far more than samples in time leave as bias.
    below 0.1 "$four"
    below "$sixteen" 0.05
    noise=$(column noise '-s 64')
    below "$noise" "$(column noise '-s 16')"
    has "$(cat crossing.measure/report.html)" '</svg>'
    lacks "$(cat crossing.measure/report.html)" 'http'
    lacks "$(cat crossing.measure/report.html)" nan
    if command -v python3 >/dev/null; then
        python3 -m json.tool crossing.measure/results.json >/dev/null || fail 'no JSON'
    fi
    local lines
    lines=$(wc -l <crossing.measure/results.csv)
    expect 0 "$ST4" measure crossing.st4 --budget 1 -s 16 -j 1
    lacks "$err" 'reference, half'
    # It has them all, and what a second more allows.
    [[ $out =~ \ ([0-9]+)\ settings ]] || fail "$out"
    below $((lines - 2)) "${BASH_REMATCH[1]}"
    # Another scene has nothing of this one.
    sed -i 's/0.8..0.8/0.7..0.7/' crossing.st4
    expect 0 "$ST4" measure crossing.st4 --budget 3 -s 16 -j 1
    has "$err" 'reference, half'
}

test_measure_takes_references() {
    crossing
    expect 0 "$ST4" crossing.st4 -s 256 -q -o a.exr --seed 7
    expect 0 "$ST4" crossing.st4 -s 256 -q -o b.exr --seed 8
    expect 0 "$ST4" measure crossing.st4 --budget 3 --ref a.exr --ref b.exr --work two -q
    has "$out" 'the mean of a.exr and b.exr'
    [ -z "$err" ] || fail "not quiet: $err"
    expect 0 "$ST4" measure crossing.st4 --budget 3 --ref a.exr --work one -q -j 1
    has "$out" 'st4 render crossing.st4 --threads 1 -s '
    has "$out" 'does not tell its own error'
    expect 3 "$ST4" measure crossing.st4 --budget 3 --ref a.exr --size 8x8
    has "$err" '32x24 pixels, the scene is measured at 8x8'
    expect 3 "$ST4" measure crossing.st4 --ref missing.exr
    expect 3 "$ST4" measure crossing.st4 --work nosuch/folder
    printf 'film { size = <16, 12> }\nsphere {}\ncamera { from = <0, 0, 5> }\nsky { color = <0, 0, 0> }\n' >black.st4
    expect 3 "$ST4" measure black.st4 --budget 3
    has "$err" 'the reference is black'
}
