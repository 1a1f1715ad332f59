(refused: 2:4 unknown .P_TOOLNO)
R1=$P_TOOLNO
M30
