" SPDX-License-Identifier: Apache-2.0
" Vim syntax of st4 scenes. Written by stdlib/editors/update; do not edit.
" Put it into ~/.vim/syntax, and into ~/.vim/ftdetect/st4.vim the line
"   autocmd BufNewFile,BufRead *.st4 setfiletype st4
if exists('b:current_syntax')
  finish
endif
syntax case match
syntax match st4Name /\<\h\w*\>/
syntax match st4Constant /\<\%(true\|false\|pi\|x\|y\|z\|t\|T\)\>/
syntax match st4Mode /\<\%(step\|linear\|smooth\|ease\|bezier\|spring\|hold\|loop\|pingpong\|offset\|before\|after\)\>/
syntax match st4Function /\<\%(sin\|cos\|tan\|asin\|acos\|atan\|atan2\|sqrt\|exp\|log\|pow\|abs\|sign\|floor\|ceil\|round\|min\|max\|hypot\|clamp\|mix\|step\|smoothstep\|length\|dot\|cross\|normalize\|turned\|slerp\|trapezoid\|d\|at\|near\|play\|rand\|randn\|randdir\|noise\|fbm\|checker\|image\|image_alpha\|table\|str\|rgb\|srgb\|hsv\|kelvin\|translate\|scale\|rotate\|matte\|metal\|gloss\|glass\|glow\)\>\ze\s*(/
syntax match st4Property /\<\%(size\|fps\|frames\|out\|aov\|filter\|filter_width\|transparent\|exposure\|view\|half\|compression\|angle\|length\|phase\|curve\|roll\|readout\|delay\|bounces\|spp\|noise\|time\|clamp\|seed\|freeze\|from\|to\|up\|fov\|kind\|aperture\|focus\|blades\|shift\|center\|radius\|top\|major\|minor\|normal\|offset\|u\|v\|res\|at\|deform\|smooth\|tolerance\|samples\|file\|points\|faces\|normals\|uvs\|cache\|clip\|subdivide\|fit\|ground\|color\|dir\|power\|cone\|edge\|two_sided\|gradient\|image\|rotate\|count\|span\|stiff\|born\|dies\|step\|gravity\|iterations\|density\|mass\|friction\|bounce\|convex\|vel\|spin\|force\|a\|b\|axis\|range\|strength\|speed\|cycle\|clock\|clips\|visible\|material\|bake\|pose\|camera\|shadow\|reflection\|catcher\)\>\ze\s*=[^=]/
syntax match st4Node /\<\%(film\|shutter\|render\|camera\|sphere\|box\|cylinder\|capsule\|cone\|torus\|plane\|disc\|quad\|surface\|mesh\|points\|group\|sun\|lamp\|area\|sky\)\>\ze\%(\s\+\w\+\)\=\%(\[[^]]*\]\)\=\s*{/
syntax match st4Statement /\<\%(let\|param\|fn\|def\|for\|if\|include\|assert\|print\|translate\|scale\|rotate\|matrix\|sim\|joint\|when\|clip\|instance\|else\|in\|as\|by\|and\|or\|not\|keys\|st4\)\>/
syntax match st4Number /\%(\<\d[0-9_]*\%(\.\d\+\)\=\|\.\d\+\)\%([eE][-+]\=\d\+\)\=\%(deg\|rad\|turn\|rpm\|s\|ms\|us\|f\|m\|cm\|mm\|km\|kg\|Hz\|px\|fps\)\=\>/
syntax match st4Escape /\\["\\nt]/ contained
syntax region st4String start=/"/ skip=/\\./ end=/"/ oneline contains=st4Escape
syntax match st4Comment /\/\/.*/
syntax region st4Comment start=/\/\*/ end=/\*\//
syntax match st4Comment /\%^#!.*/
highlight default link st4Number Number
highlight default link st4String String
highlight default link st4Escape SpecialChar
highlight default link st4Comment Comment
highlight default link st4Statement Keyword
highlight default link st4Node Type
highlight default link st4Property Identifier
highlight default link st4Function Function
highlight default link st4Mode PreProc
highlight default link st4Constant Constant
setlocal commentstring=//\ %s
let b:current_syntax = 'st4'
