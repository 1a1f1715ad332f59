"""The bench's test program: circles in a ring gauge in both senses at two feeds, circles while C or A
turns, strokes of Z. Every section begins and ends at rest; all are run twice, all once
before any is run again, so that what grows in time differs between the repetitions.
"""

RADIUS = 15.0  # of the ball centre's path [mm]; ring radius 17.5 mm, ball 3 mm: 0.5 mm deep
HEIGHT = 8.0


def program():
    """Returns the G-code and its sections: (first line, last line, condition)."""
    lines = ["%", "G54 G90 G17 G21 G94 G40 G49", "G64 P0.0005", "M19", "G0 A0 C0", "G43.4 H1",
             "G0 X0 Y0 Z60", "G1 Z0 F5000", "G4 P0.3"]
    sections = []

    def section(condition, blocks):
        first = len(lines) + 1
        lines.extend(blocks)
        sections.append((first, len(lines), condition))
        lines.append("G4 P0.15")

    def circle(word, feed):
        r = RADIUS
        return [f"{word} X{r:g} Y0 I{r / 2:g} J0 F{feed}", f"{word} X{r:g} Y0 I{-r:g} J0",
                f"{word} X0 Y0 I{-r / 2:g} J0"]

    def turning(word):
        """Two rounds while a rotary axis goes there and back; the ball never comes to rest on the piece."""
        r, there = RADIUS, {"C": (120, 0), "A": (35, -35)}[word]
        return [f"G3 X{r:g} Y0 I{r / 2:g} J0 F6000", f"G3 X{r:g} Y0 I{-r:g} J0 {word}{there[0]}",
                f"G3 X{r:g} Y0 I{-r:g} J0 {word}{there[1]}", f"G3 X0 Y0 I{-r / 2:g} J0 {word}0"]

    for _ in range(2):
        for feed in (3000, 6000):
            section(f"circle F{feed} ccw", circle("G3", feed))
            section(f"circle F{feed} cw", circle("G2", feed))
        section("turn C", turning("C"))
        section("turn A", turning("A"))
        lines.append(f"G1 X0 Y0 Z{HEIGHT:g} F3000")
        lines.append(f"G3 X{RADIUS:g} Y0 I{RADIUS / 2:g} J0 F3000")
        section("stroke Z", [f"G1 Z{HEIGHT - 12:g} F1500", f"G1 Z{HEIGHT:g}"])
        lines.append(f"G3 X0 Y0 I{-RADIUS / 2:g} J0 F3000")
        lines.append("G1 Z0")
        lines.append("G4 P0.15")
    lines += ["G0 Z60", "G49", "M30"]
    return "\n".join(lines) + "\n", sections
