(#1 of the program and of the macro)
F500
#100=1
#1=5
G65 P60 A10
G65 P60 A20
G1 X#1 Y#100
M30
O60
#100=#100+1
G1 X#1 Y#100
M99
