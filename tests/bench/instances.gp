# SPDX-License-Identifier: Apache-2.0
# Memory and seconds against the number of instances: gnuplot -e "table='X.tsv'; plot='X.png'" THIS
set terminal pngcairo size 720,340 font "sans,10"
set output plot
set logscale xy 10
set format x "10^{%T}"
set xlabel "instances"
set grid lc rgb "#dddddd"
set border 3 lc rgb "#888888"
set tics nomirror
set key left top reverse Left samplen 2
set multiplot layout 1,2
set title "memory at the first ray"
set format y "%.0s %cB"
plot table using 1:6 skip 1 with lines lw 2 dt 2 lc rgb "#999999" title "duplicated data", \
     table using 1:4 skip 1 with linespoints lw 2 pt 7 ps 0.5 lc rgb "#b5532c" title "instances"
set title "seconds"
set format y "%g"
plot table using 1:($2+$3) skip 1 with linespoints lw 2 pt 7 ps 0.5 lc rgb "#2c6fb5" title "script to first ray", \
     table using 1:(1e6/$7) skip 1 with linespoints lw 2 pt 7 ps 0.5 lc rgb "#3b8a4a" title "a million rays"
unset multiplot
