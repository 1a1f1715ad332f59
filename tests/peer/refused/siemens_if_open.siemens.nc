(refused: 2:1 IF without its end)
IF R1==1
G0 X1
M30
