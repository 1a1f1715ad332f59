(refused: 2:1 G54.1 without P)
G54.1
M30
