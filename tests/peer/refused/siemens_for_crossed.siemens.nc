(refused: 4:1 ENDFOR while WHILE of line 3 is open)
FOR R1=1 TO 2
WHILE R1<2
ENDFOR
ENDWHILE
M30
