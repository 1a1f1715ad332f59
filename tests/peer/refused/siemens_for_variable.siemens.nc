(refused: 2:5 FOR counts an R parameter)
FOR X=1 TO 2
ENDFOR
M30
