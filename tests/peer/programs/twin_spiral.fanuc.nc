(GOTO backwards)
F500
G0 X1 Y0
#1=1
N5 G3 X[-#1-0.5] Y0 R[#1+0.25]
#1=#1+0.5
G3 X[#1+0.5] Y0 R[#1+0.25]
#1=#1+0.5
IF[#1 LT 7] GOTO 5
M30
