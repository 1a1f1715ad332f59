(refused: 3:1 straight behind)
G1 F500 X10
CT X5
M30
