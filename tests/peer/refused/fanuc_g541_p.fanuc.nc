(refused: 2:7 P49)
G54.1 P49
M30
