(refused: ANY endless|loop|motion|block|GOTO|without|line)
G1 X0 F500
N10 #100=1
GOTO 10
M30
