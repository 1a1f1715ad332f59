(functions)
F500
G1 X[SIN[30]] Y[ATAN[1]/[2]]
X[SQRT[2]] Y[ABS[-3]]
X[ROUND[2.6]] Y[FIX[2.7]] Z[FUP[2.1]]
X[7 MOD 4] Y[EXP[1]] Z[LN[5]]
M30
