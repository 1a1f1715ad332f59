(refused: 2:10 two blocks)
TRANS X1 G0
M30
