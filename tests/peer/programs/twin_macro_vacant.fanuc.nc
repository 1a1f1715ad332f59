(a parameter never set is not 0 to EQ and NE, but is to GE and sums; a word of it is left out)
F500
G1 X5
IF[#101 EQ 0] GOTO 1
Y5
N1 IF[#101 NE 0] GOTO 2
Z9
N2 IF[#101 EQ #0] GOTO 3
Z8
N3 IF[#101 GE 0] GOTO 4
Z7
N4 G1 X#101 Z3
X[#101+1]
M30
