(refused: ANY recurs|depth|deep|level|call|nest)
G1 X0 F500
M98 P10
M30
O10
M98 P10
M99
