(refused: 3:1 R|angle)
G1 X0 F500
G68 X5 Y5
M30
