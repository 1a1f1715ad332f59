(refused: 2:1 IF)
IF R1==1 X10
G0 X1
M30
