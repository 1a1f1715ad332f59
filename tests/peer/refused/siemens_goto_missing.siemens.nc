(refused: 3:1 GOTOF THERE: there is no such label behind it)
THERE: G0 X1
GOTOF THERE
M30
