#!/usr/bin/env python3
"""Tests of the comparison itself: each difference it is there to find must be found."""

import copy
import json
import math
import unittest

import canonical
import random_programs

HEADER = """    1 N..... USE_LENGTH_UNITS(CANON_UNITS_MM)
    2 N..... SET_G5X_OFFSET(1, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)
    3 N..... SET_FEED_MODE(0, 0)
"""


def read(*calls, code=0, errors=""):
    lines = [f"{i:5} N..... {call}" for i, call in enumerate(calls, 10)]
    return canonical.read_rs274(HEADER + "\n".join(lines), errors, code)


class Rs274(unittest.TestCase):
    def test_units(self):
        path = read("USE_LENGTH_UNITS(CANON_UNITS_INCHES)", "SET_FEED_RATE(10.0000)",
                    "STRAIGHT_FEED(1.0000, 2.0000, -0.5000, 30.0000, 0.0000, 40.0000)")
        for got, expected in zip(path.segments[0].end, (25.4, 50.8, -12.7, 30, 40)):
            self.assertAlmostEqual(got, expected, 9)
        self.assertAlmostEqual(path.segments[0].feed, 254)

    def test_offsets_in_order(self):
        # R(program + G92) + G5x + tool: 90 degrees turn (1 + 2, 5) into (-5, 3).
        path = read("SET_G5X_OFFSET(2, 10.0000, 20.0000, 30.0000, 1.0000, 0.0000, 2.0000)",
                    "SET_G92_OFFSET(2.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)", "SET_XY_ROTATION(90.0000)",
                    "USE_TOOL_LENGTH_OFFSET(0.5000 0.0000 100.0000, 0.0000 0.0000 0.0000, 0.0000 0.0000 0.0000)",
                    "STRAIGHT_TRAVERSE(1.0000, 5.0000, 7.0000, 3.0000, 0.0000, 4.0000)")
        for got, expected in zip(path.segments[0].end, (5.5, 23, 137, 4, 6)):
            self.assertAlmostEqual(got, expected, 9)
        self.assertEqual(path.segments[0].kind, "rapid")

    def test_offsets_move_nothing(self):
        path = read("STRAIGHT_TRAVERSE(1.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)",
                    "SET_G92_OFFSET(1.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)",
                    "STRAIGHT_TRAVERSE(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)")
        self.assertEqual(len(path.segments), 1)

    def test_planes(self):
        for plane, end, centre in (("XY", (3, 5, 7), (4, 6)), ("YZ", (7, 3, 5), (4, 6)), ("XZ", (5, 7, 3), (4, 6))):
            path = read(f"SELECT_PLANE(CANON_PLANE_{plane})",
                        "ARC_FEED(3.0000, 5.0000, 4.0000, 6.0000, -2, 7.0000, 0.0000, 0.0000, 0.0000)")
            arc = path.segments[0]
            self.assertEqual(arc.end[:3], end)
            first, second, third = canonical.PLANES[plane]
            self.assertEqual((arc.centre[first], arc.centre[second]), centre)
            self.assertEqual(arc.normal[third], 1)
            self.assertEqual(arc.turns, -2)

    def test_block_number(self):
        output = HEADER + "    9 N120   STRAIGHT_TRAVERSE(1.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\n"
        self.assertEqual(canonical.read_rs274(output, "", 0).segments[0].line, 120)

    def test_error(self):
        path = read(code=1, errors="executing\nUnknown word\nE5\n")
        self.assertEqual(path.error, "Unknown word | E5")

    def test_tool_table(self):
        self.assertEqual(canonical.tool_table_in_inches("T2 P2 Z50.8 D-25.4 A5 ;mill\n"), "T2 P2 Z2 D-1 A5 \n")


class Geometry(unittest.TestCase):
    def arc(self, end, turns):
        return canonical.Segment("arc", tuple(end) + (0, 0), centre=(0, 0, 0), normal=(0, 0, 1), turns=turns)

    def test_sweep(self):
        start = (1, 0, 0, 0, 0)
        quarter = (0, 1, 0)
        for turns, expected in ((1, 0.25), (2, 1.25), (-1, -0.75), (-3, -2.75)):
            sweep, radius, _ = canonical.arc_sweep(self.arc(quarter, turns), start)
            self.assertAlmostEqual(sweep, expected * 2 * math.pi)
            self.assertAlmostEqual(radius, 1)
        self.assertAlmostEqual(canonical.arc_sweep(self.arc((1, 0, 0), -1), start)[0], -2 * math.pi)

    def test_helix_length(self):
        self.assertAlmostEqual(canonical.arc_length(self.arc((1, 0, 3), 2), (1, 0, 0, 0, 0)),
                               math.hypot(4 * math.pi, 3))


class Difference(unittest.TestCase):
    def setUp(self):
        self.a = read("SET_FEED_RATE(500.0000)", "STRAIGHT_TRAVERSE(1.0000, 2.0000, 3.0000, 0.0000, 0.0000, 0.0000)",
                      "STRAIGHT_FEED(4.0000, 2.0000, 3.0000, 0.0000, 0.0000, 0.0000)",
                      "ARC_FEED(6.0000, 2.0000, 5.0000, 2.0000, -1, 3.0000, 0.0000, 0.0000, 0.0000)")
        self.b = copy.deepcopy(self.a)

    def differs(self, pattern):
        self.assertRegex(canonical.difference(self.a, self.b) or "", pattern)

    def test_none(self):
        self.assertIsNone(canonical.difference(self.a, self.b))

    def test_end(self):
        self.b.segments[1].end = (4, 2.0011, 3, 0, 0)
        self.differs("motion 2 .* expected Y2.0000, got Y2.0011")

    def test_not_a_number(self):
        self.b.segments[1].end = (4, math.nan, 3, 0, 0)
        self.differs("expected Y2.0000, got Ynan")

    def test_rotary(self):
        self.b.segments[0].end = (1, 2, 3, 0, 360)
        self.differs("C0.0000")

    def test_kind(self):
        self.b.segments[0].kind = "line"
        self.differs("expected a rapid")

    def test_centre(self):
        self.b.segments[2].centre = (5, 2.002, 3)
        self.differs("expected the centre")

    def test_centre_along_the_normal(self):
        self.b.segments[2].centre = (5, 2, 99)
        self.assertIsNone(canonical.difference(self.a, self.b))

    def test_plane(self):
        self.b.segments[2].normal = (0, 1, 0)
        self.differs("plane with normal")

    def test_turns(self):
        self.b.segments[2].turns = -2
        self.differs("expected -1 turns, got -2")

    def test_feed(self):
        self.b.segments[1].feed = 501
        self.differs("expected F500.0000, got F501.0000")

    def test_feed_mode(self):
        self.b.segments[1].per_revolution = True
        self.differs("feed a minute")

    def test_line(self):
        for path, line in ((self.a, 4), (self.b, 5)):
            for segment in path.segments:
                segment.line = line
        self.assertIsNone(canonical.difference(self.a, self.b))
        self.assertRegex(canonical.difference(self.a, self.b, lines=True), "from line 4")

    def test_missing(self):
        del self.b.segments[2]
        self.differs("3 motions, vcnc 2")

    def test_extra(self):
        self.b.segments.append(self.b.segments[0])
        self.differs("3 motions, vcnc 4")


    def test_slide_along_the_path(self):
        self.b.segments[1].end = (4.3, 2, 3, 0, 0)  # short of the arc, on the line
        self.assertRegex(canonical.difference(self.a, self.b), "X4.0000, got X4.3000")
        self.assertIsNone(canonical.difference(self.a, self.b, slide=True))
        self.b.segments[1].end = (4.3, 2.1, 3, 0, 0)
        self.assertRegex(canonical.difference(self.a, self.b, slide=True), "X4.0000, got X4.3000")


class Vcnc(unittest.TestCase):
    def test_segments(self):
        at = {"A": 0, "C": 0}
        text = json.dumps([
            {"type": "rapid", "line": 1, "end": {"X": 1, "Y": 2, "Z": 3, **at}},
            {"type": "dwell", "line": 2},
            {"type": "line", "line": 3, "end": {"X": 1, "Y": 2, "Z": 3, **at}, "feed": 5, "feed_mode": "per_minute"},
            {"type": "arc", "line": 4, "end": {"X": 3, "Y": 2, "Z": 3, **at}, "centre": {"X": 2, "Y": 2, "Z": 3},
             "plane": 17, "turns": -0.5, "feed": 2, "feed_mode": "inverse_time"}])
        path = canonical.read_vcnc(text)
        self.assertEqual([s.kind for s in path.segments], ["rapid", "arc"])
        self.assertAlmostEqual(path.segments[1].feed, 2 * math.pi)
        self.assertEqual(path.segments[1].normal, (0, 0, 1))

    def test_turns_begun(self):
        for turns, begun in ((0.25, 1), (1, 1), (1.0000001, 1), (1.01, 2), (-0.5, -1), (-2.5, -3)):
            self.assertEqual(canonical._turns_begun(turns), begun)


class RandomPrograms(unittest.TestCase):
    def test_same_seed_same_text(self):
        for kind in random_programs.KINDS:
            self.assertEqual(random_programs.program(kind, 3), random_programs.program(kind, 3))
            self.assertNotEqual(random_programs.program(kind, 3), random_programs.program(kind, 4))


if __name__ == "__main__":
    unittest.main()
