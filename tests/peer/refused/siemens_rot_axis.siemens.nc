(refused: 2:5 ROT about X)
ROT X90
M30
