(refused: 2:1 G51.1 without X)
G51.1
M30
