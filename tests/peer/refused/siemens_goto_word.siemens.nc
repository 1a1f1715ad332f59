(refused: 2:1 unknown word GOTOS)
GOTOS
M30
