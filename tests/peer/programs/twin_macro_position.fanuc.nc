(#5001: end of the last block in the system of work; #5021: machine)
F500
G10 L2 P1 X5 Y6 Z7
G1 X10 Y20 Z30
X[#5001+1] Y[#5002+2] Z[#5003+3]
X[#5021]
M30
