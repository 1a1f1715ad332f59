(refused: 3:1 ENDFOR without its begin)
G0 X1
ENDFOR
M30
