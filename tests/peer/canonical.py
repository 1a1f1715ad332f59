"""The canonical path of a program, and two readers of it: LinuxCNC's `rs274 -g` and `vcnc interpret`.

What a canonical path is: every motion after parameters, cycles, offsets, tool length and cutter compensation,
before corner blending, in the machine frame, in mm and degrees. Two interpreters agree on a program when they
give the same sequence of motions of the same kind to the same ends, round the same centres with the same sense
and number of turns, at the same feed. Motions of no length say nothing and are dropped.

What `rs274` prints, found by experiment with LinuxCNC 2.9:

* Positions are in program units (USE_LENGTH_UNITS) with four decimals, so an inch program is known to 1.3 um.
  Without an INI file the machine starts in mm and has the axes X Y Z A B C.
* Positions are in the program frame. Machine = R(program + G92) + G5x + tool offset, where R is SET_XY_ROTATION
  about Z; every offset is printed in the unit that is active when it is set, in absolute numbers.
* ARC_FEED(first_end, second_end, first_centre, second_centre, rotation, axis_end, A, B, C): the axes are X, Y in
  XY; Y, Z in YZ; Z, X in XZ, so that counter-clockwise is positive about the third axis in each plane. rotation
  is the signed number of turns begun: 1 less than or equal to one turn counter-clockwise, -3 more than two clockwise.
* SET_FEED_RATE is in the program units of that moment a minute and stays when the units change; but rs274 takes F
  before G20 and G21 of the same block, a quirk corrected here: F counts in the units of its block. Under G93 it is
  F times the length of the motion (of X Y Z if they move, else of the rotary axes); under G95 it is the feed a
  revolution and SET_FEED_MODE(spindle, 1).
* It believes in a machine in inches: #5221 and the following, #5401 and the following are in inches.
* M6 makes it ask its dummy machine where it is, which knows no tool length: after M6 with G43 the axes not named in
  the next motion jump by the length. Programs name all three. M61 does not put the tool in: G43 is then of length 0.
  T0 M6 leaves the length of the last tool.
* The tool table given by -t is in inches whatever the program says; `tool_table_in_inches` converts.
* STRAIGHT_PROBE never trips: #5061 is the programmed end, #5070 is 0, but the axes stand 0.01 inch short of it.
* Quirks that programs here step around: an active tool length is not converted by G20 and G21; the place in a system
  that is being turned (G10 L2 R) is worked out without G92; a do ... while loop may end after its first pass when other O words are around or in it;
  corners of less than 0.05 rad count as straight in cutter compensation.
* NURBS_FEED prints no coordinates: G5 and G5.2 cannot be compared.
* Block delete is off (`/` lines run) unless -b is given.
* The second column is the N word of the block, not the line of the file.
* A program without M2, M30 or enclosing % is refused at its end with exit code 1.
* Loops have no bound; a WHILE without end runs until it is killed.
* The tool table in use lies in ~/.tool.mmap: two runs at the same time need two homes.
"""

import dataclasses
import json
import math
import re

AXES = ("X", "Y", "Z", "A", "C")
INCH = 25.4

# In-plane axes (first, second) and normal of each plane, as indices of X Y Z.
PLANES = {"XY": (0, 1, 2), "YZ": (1, 2, 0), "XZ": (2, 0, 1)}


@dataclasses.dataclass
class Segment:
    kind: str  # rapid, line, arc, probe
    end: tuple  # X Y Z [mm] A C [deg], machine frame
    centre: tuple | None = None  # X Y Z [mm]; its place along the normal means nothing
    normal: tuple | None = None  # of the plane, unit vector, machine frame
    turns: int = 0  # begun, counter-clockwise about the normal positive
    feed: float | None = None  # mm/min (deg/min when only rotary axes move), or mm/rev
    per_revolution: bool = False
    feed_resolution: float = 0  # of the printed number
    line: int | None = None  # of the file; rs274 knows only the N word of the block
    where: str = ""  # for messages: a line number or the printed text


@dataclasses.dataclass
class Path:
    segments: list
    error: str | None = None  # what the interpreter said when it refused


def _add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def _turned(vector, degrees):
    """Turned about Z; A and C (if any) stay."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]) + tuple(vector[2:])


def still(a, b, tolerance=2e-3):
    return all(abs(x - y) < tolerance for x, y in zip(a, b))


_CALL = re.compile(r"^ *\d+ N(\S+) +([A-Z0-9_]+)\((.*)\)$")


def _numbers(text):
    return [float(n) for n in re.findall(r"-?\d+\.?\d*(?:e[-+]?\d+)?|-?nan|-?inf", text)]


class Rs274Reader:
    """Folds the printed calls into segments."""

    def __init__(self):
        self.unit = 1.0
        self.plane = "XY"
        self.g5x = self.g92 = self.tool = (0.0,) * 5
        self.rotation = 0.0
        self.at = (0.0,) * 5
        self.line, self.feed_before = None, False
        self.feed, self.feed_unit, self.per_revolution = 0.0, 1.0, False
        self.path = Path([])

    def _five(self, xyzabc):
        x, y, z, a, _, c = xyzabc
        return (x * self.unit, y * self.unit, z * self.unit, a, c)

    def _machine(self, program):
        return _add(_add(_turned(_add(program, self.g92), self.rotation), self.g5x), self.tool)

    def _move(self, kind, program, text, **arc):
        end = self._machine(program)
        rounding = 2e-3 if self.unit == 1.0 else 8e-3
        if kind != "arc" and still(end, self.at, rounding):
            return
        segment = Segment(kind, end, where=text, line=self.line, **arc)
        if kind in ("line", "arc"):
            rotary_only = kind == "line" and still(end[:3], self.at[:3], rounding)
            unit = 1.0 if rotary_only else self.feed_unit
            segment.feed = self.feed * unit
            segment.feed_resolution = 0.5e-4 * unit
            segment.per_revolution = self.per_revolution
        self.path.segments.append(segment)
        self.at = end

    def call(self, block, name, text):
        self.line = int(block) if block.isdigit() else None
        n = _numbers(text)
        feed_before = self.feed_before
        self.feed_before = name == "SET_FEED_RATE" or (feed_before and name == "SELECT_PLANE")
        if name == "USE_LENGTH_UNITS":
            self.unit = INCH if "INCHES" in text else 1.0
            if feed_before:
                self.feed_unit = self.unit
        elif name == "SET_G5X_OFFSET":
            self.g5x = self._five(n[1:7])
        elif name == "SET_G92_OFFSET":
            self.g92 = self._five(n[:6])
        elif name == "SET_XY_ROTATION":
            self.rotation = n[0]
        elif name == "USE_TOOL_LENGTH_OFFSET":
            self.tool = self._five(n[:6])
        elif name == "SELECT_PLANE":
            self.plane = text[-2:]
        elif name == "SET_FEED_RATE":
            self.feed, self.feed_unit = n[0], self.unit
        elif name == "SET_FEED_MODE":
            self.per_revolution = n[1] != 0
        elif name.startswith("START_SPEED_FEED_SYNC"):
            self.synchronised = (self.feed, self.feed_unit, self.per_revolution)
            self.feed, self.feed_unit, self.per_revolution = n[0], self.unit, True
        elif name == "STOP_SPEED_FEED_SYNCH":
            self.feed, self.feed_unit, self.per_revolution = self.synchronised
        elif name == "STRAIGHT_TRAVERSE":
            self._move("rapid", self._five(n), text)
        elif name == "STRAIGHT_FEED":
            self._move("line", self._five(n), text)
        elif name == "STRAIGHT_PROBE":
            self._move("probe", self._five(n), text)
        elif name == "RIGID_TAP":
            back, rotary = self.at, self.at[3:]
            self._move("line", tuple(v * self.unit for v in n[:3]) + rotary, text)
            self.path.segments.append(dataclasses.replace(self.path.segments[-1], end=back))
            self.at = back
        elif name == "ARC_FEED":
            self._arc(n, text)
        elif name == "NURBS_FEED":
            self.path.error = "NURBS_FEED prints no coordinates"

    def _arc(self, n, text):
        first, second, third = PLANES[self.plane]
        end, centre = [0.0] * 3, [0.0] * 3
        end[first], end[second], end[third] = n[0], n[1], n[5]
        centre[first], centre[second], centre[third] = n[2], n[3], n[5]
        normal = [0.0] * 3
        normal[third] = 1.0
        self._move("arc", self._five(end + n[6:9]), text,
                   centre=self._machine(self._five(centre + [0, 0, 0]))[:3],
                   normal=_turned(normal, self.rotation), turns=int(n[4]))


LINES_NUMBERED = "(N words are the lines of the file)"


def read_rs274(output, errors, code):
    reader = Rs274Reader()
    for line in output.splitlines():
        match = _CALL.match(line)
        if match:
            reader.call(*match.groups())
    if code != 0:
        said = [line for line in errors.splitlines() if line and line != "executing"]
        reader.path.error = " | ".join(said) or f"exit code {code}"
    return reader.path


def tool_table_in_inches(table):
    """Lengths of a tool table in mm as rs274 wants them; angles stay."""
    def word(match):
        letter, number = match.groups()
        return f"{letter}{float(number) / INCH:.15g}" if letter in "XYZD" else match.group(0)
    lines = (line.split(";")[0] for line in table.splitlines())
    return "\n".join(re.sub(r"([A-Z])(\S+)", word, line) for line in lines) + "\n"


def _inverse_time_feed(segment, start, f):
    """F of G93 as the feed rs274 gives the motion."""
    d = [e - s for e, s in zip(segment.end, start)]
    if segment.kind == "arc":
        return f * arc_length(segment, start)
    linear = math.dist(segment.end[:3], start[:3])
    return f * (linear if linear > 2e-3 else math.hypot(d[3], d[4]))


def arc_length(segment, start):
    sweep, radius, climb = arc_sweep(segment, start)
    return math.hypot(radius * sweep, climb)


def arc_sweep(segment, start):
    """(signed angle [rad], radius, way along the normal)"""
    n = segment.normal

    def split(point):
        v = [p - c for p, c in zip(point, segment.centre)]
        along = sum(a * b for a, b in zip(v, n))
        return [a - along * b for a, b in zip(v, n)], along

    (u, at), (v, to) = split(start[:3]), split(segment.end[:3])
    cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    angle = math.atan2(sum(a * b for a, b in zip(cross, n)), sum(a * b for a, b in zip(u, v)))
    radius = math.hypot(*u)
    chord = math.dist(u, v)
    if chord < 2e-3:
        angle = 0.0
    if segment.turns > 0:
        sweep = (angle if angle > 0 else angle + 2 * math.pi) + 2 * math.pi * (segment.turns - 1)
    else:
        sweep = (angle if angle < 0 else angle - 2 * math.pi) + 2 * math.pi * (segment.turns + 1)
    return sweep, radius, to - at


def distance_to(point, segment, start):
    """From a point to a line, or to an arc in a plane of the axes (its ends aside: an arc is its circle here)."""
    if segment.kind == "arc":
        radius = math.dist(start[:3], segment.centre)
        return abs(math.dist(point, segment.centre) - radius)
    way = [e - s for e, s in zip(segment.end[:3], start[:3])]
    to = [p - s for p, s in zip(point, start[:3])]
    length = sum(w * w for w in way)
    share = min(max(sum(w * t for w, t in zip(way, to)) / length, 0), 1) if length > 0 else 0
    return math.dist(to, [share * w for w in way])


def read_vcnc(text):
    """Segments of the JSON of `vcnc interpret`."""
    document = json.loads(text)
    items = document if isinstance(document, list) else document["segments"]
    path, at = Path([]), (0.0,) * 5
    for item in items:
        kind = item["type"]
        if kind not in ("rapid", "line", "arc", "probe"):
            continue
        end = tuple(float(item["end"][axis]) for axis in AXES)
        if kind != "arc" and still(end, at):
            continue
        segment = Segment(kind, end, where=f"line {item['line']}", line=int(item["line"]))
        if kind == "arc":
            if still(end, at) and abs(float(item["turns"])) < 0.5:
                continue
            segment.centre = _point(item["centre"])
            segment.normal = _normal(item["plane"])
            segment.turns = _turns_begun(float(item["turns"]))
        if kind in ("line", "arc"):
            mode = item["feed_mode"]
            segment.per_revolution = mode == "per_turn"
            segment.feed = float(item["feed"])
            if mode == "inverse_time":
                segment.feed = _inverse_time_feed(segment, at, segment.feed)
        path.segments.append(segment)
        at = end
    return path


def _point(value):
    return tuple(float(value[a]) for a in "XYZ") if isinstance(value, dict) else tuple(map(float, value))


def _normal(plane):
    """Of plane 17, 18 or 19, or a vector."""
    if isinstance(plane, (dict, list)):
        return _point(plane)
    third = {17: 2, 18: 1, 19: 0}[int(plane)]
    return tuple(1.0 if axis == third else 0.0 for axis in range(3))


def _turns_begun(turns):
    """2.25 turns are the third, begun: 3. Rounding does not begin another."""
    return int(math.copysign(math.ceil(abs(turns) - 1e-5), turns))


# Half a digit of an inch program is 1.27 um; sums of rounded offsets add to it.
TOLERANCE_MM = 1e-3
TOLERANCE_INCH_MM = 4e-3


# Where two motions meet at hardly any angle, rounded coordinates move their point of intersection along both.
SLIDE_MM = 0.5


def difference(expected, got, tolerance=TOLERANCE_MM, lines=False, slide=False):
    """None when the paths are the same, else one sentence on the first place where they are not. With `slide` the
    ends of motions may lie elsewhere on the same path."""
    at, got_at = (0.0,) * 5, (0.0,) * 5
    for index, (a, b) in enumerate(zip(expected.segments, got.segments)):
        if slide and a.kind == b.kind and a.end[3:] == b.end[3:] and math.dist(a.end, b.end) < SLIDE_MM:
            near = [(b, got_at)] + [(s, b.end) for s in got.segments[index + 1:index + 2]]
            if min(distance_to(a.end[:3], *pair) for pair in near) < tolerance:
                a = dataclasses.replace(a, end=b.end)
        text = _segment_difference(a, b, at, tolerance)
        got_at = b.end
        if lines and not text and a.line != b.line:
            text = f"expected it from line {a.line}"
        if text:
            return f"motion {index + 1} ({b.where}; rs274 {a.kind} {a.where}): {text}"
        at = a.end
    if len(expected.segments) != len(got.segments):
        longer = expected if len(expected.segments) > len(got.segments) else got
        extra = longer.segments[min(len(expected.segments), len(got.segments))]
        return (f"rs274 has {len(expected.segments)} motions, vcnc {len(got.segments)}; the first too many: "
                f"{extra.kind} to {_show(extra.end)} ({extra.where})")
    return None


def _show(values):
    return "(" + ", ".join(f"{v:.4f}" for v in values) + ")"


def _segment_difference(a, b, at, tolerance):
    if a.kind != b.kind:
        return f"expected a {a.kind} to {_show(a.end)}, got a {b.kind} to {_show(b.end)}"
    for axis, x, y in zip(AXES, a.end, b.end):
        if not abs(x - y) <= tolerance:
            return f"expected {axis}{x:.4f}, got {axis}{y:.4f}; ends {_show(a.end)} and {_show(b.end)}"
    if a.kind == "arc":
        if sum(x * y for x, y in zip(a.normal, b.normal)) < 1 - 1e-9:
            return f"expected the plane with normal {_show(a.normal)}, got {_show(b.normal)}"
        if a.turns != b.turns:
            return f"expected {a.turns} turns, got {b.turns}"
        off = [y - x for x, y in zip(a.centre, b.centre)]
        along = sum(x * n for x, n in zip(off, a.normal))
        if math.hypot(*(x - along * n for x, n in zip(off, a.normal))) > tolerance:
            return f"expected the centre {_show(a.centre)}, got {_show(b.centre)}"
    if a.feed is not None:
        if a.per_revolution != b.per_revolution:
            return f"expected a feed a {'revolution' if a.per_revolution else 'minute'}"
        if abs(a.feed - b.feed) > 2 * a.feed_resolution + 1e-4 * abs(a.feed):
            return f"expected F{a.feed:.4f}, got F{b.feed:.4f}"
    return None
