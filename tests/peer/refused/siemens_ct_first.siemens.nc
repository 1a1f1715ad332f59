(refused: 2:6 CT: no motion)
F500 CT X10 Y10
M30
