(refused: ANY passes of loops)
LOOP
R1=R1+1
ENDLOOP
M30
