(exact stop in one block, high-speed words)
G5 P10000
G8 P1
F500
G9 G1 X10
Y5
G9 X0
G8 P0
G5 P0
M30
