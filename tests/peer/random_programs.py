"""Seeded random programs for the comparison: the same seed gives the same text for ever.

Seven kinds, each stressing one part of the language, and macro programs in two dialects. Every program is valid by construction, except that a
compensated contour may need a smaller tool; then both interpreters have to refuse it.
"""

import math
import random

import canonical

PLANE_AXES = {17: "XY", 18: "ZX", 19: "YZ"}
CENTRE = {"X": "I", "Y": "J", "Z": "K"}


def program(kind, seed):
    source = random.Random(f"{kind}/{seed}")
    return f"({kind} {seed})\n" + "\n".join(KINDS[kind](source)) + "\nM2\n"


def fanuc_twin(seed):
    """A random macro program twice: as LinuxCNC writes it and as Fanuc does."""
    r = random.Random(f"fanuc/{seed}")
    ngc, fanuc = _Ngc(), _Fanuc()
    for variable in range(110, 126):  # one never set is vacant on Fanuc, and that is not 0 to EQ and NE
        for writer in (ngc, fanuc):
            writer.assign(f"#{variable}", "0")
    _macro_block(r, [ngc, fanuc], depth=3, counters=[], subs=3)
    return tuple(f"({writer.name} {seed})\n" + "\n".join(writer.program()) + "\n" for writer in (ngc, fanuc))


def _macro_block(r, writers, depth, counters, subs):
    """The same statements to each writer. Loops count in #100 and above, one per depth."""
    def each(method, *arguments):
        for writer in writers:
            getattr(writer, method)(*arguments)

    def value():
        terms = [f"{r.uniform(0.1, 20):.2f}"] + [f"#{c}*{r.randint(1, 9)}" for c in counters]
        r.shuffle(terms)
        return r.choice((" + ", " - ", "+")).join(terms)

    def condition():
        left = f"#{r.choice(counters)}" if counters else "#120"
        return f"{left} {r.choice(('EQ', 'NE', 'GT', 'GE', 'LT', 'LE'))} {r.randint(0, 3)}"

    for _ in range(r.randint(2, 5)):
        kind = r.random()
        if kind < 0.4 or depth == 0:
            each("line", f"G{r.choice((0, 1))} {r.choice('XYZ')}[{value()}]")
        elif kind < 0.5:
            each("assign", f"#{r.randint(110, 125)}", value())
        elif kind < 0.65 and len(counters) < 3:
            counter = 100 + len(counters)
            each("begin_while", counter, r.randint(0, 3))
            _macro_block(r, writers, depth - 1, counters + [counter], subs)
            each("end_while", counter)
        elif kind < 0.8:
            where = condition()
            each("begin_skip", where)
            _macro_block(r, writers, depth - 1, counters, subs)
            each("end_skip")
        elif kind < 0.88:
            each("if_assign", condition(), f"#{r.randint(110, 125)}", f"{r.uniform(-9, 9):.2f}")
        elif subs:
            number, repeat = r.randint(1, subs), r.randint(1, 3)
            if r.random() < 0.5:
                each("call", number, repeat, r)
            else:
                each("macro", number, [round(r.uniform(-9, 9), 2) for _ in range(3)])


class _Ngc:
    name = "ngc"

    def __init__(self):
        self.lines, self.labels, self.open = ["F1000 G1 X0"], iter(range(500, 10000)), []

    def line(self, text):
        self.lines.append(text)

    def assign(self, name, value):
        self.lines.append(f"{name}=[{value}]")

    def begin_while(self, counter, times):
        self.open.append(next(self.labels))
        self.lines += [f"#{counter}=0", f"o{self.open[-1]} while [#{counter} LT {times}]"]

    def end_while(self, counter):
        self.lines += [f"#{counter}=[#{counter}+1]", f"o{self.open.pop()} endwhile"]

    def begin_skip(self, condition):
        self.open.append(next(self.labels))
        self.lines.append(f"o{self.open[-1]} if [{condition}]")

    def end_skip(self):
        self.lines.append(f"o{self.open.pop()} endif")

    def if_assign(self, condition, name, value):
        label = next(self.labels)
        self.lines += [f"o{label} if [{condition}]", f"{name}={value}", f"o{label} endif"]

    def call(self, number, repeat, _):
        self.lines += [f"o{number} call"] * repeat

    def macro(self, number, values):
        self.lines.append(f"o{10 + number} call " + " ".join(f"[{v}]" for v in values))

    def program(self):
        subs = []
        for i in (1, 2, 3):
            subs += [f"o{i} sub", f"G91 G1 X{i}", "Y-1", "G90", f"#{120 + i}=[#{120 + i}+1]", f"o{i} endsub",
                     f"o1{i} sub", f"G1 X[#1+{i}] Y[#2*2]", "Z[#3-#1]", "#1=7", "X[#1]", f"o1{i} endsub"]
        return subs + self.lines + ["M2"]


class _Fanuc:
    name = "fanuc"

    _NOT = {"EQ": "NE", "NE": "EQ", "GT": "LE", "LE": "GT", "LT": "GE", "GE": "LT"}

    def __init__(self):
        self.lines, self.numbers, self.open, self.depth = ["F1000. G01 X0."], iter(range(10, 9999, 10)), [], 0

    def line(self, text):
        self.lines.append(text)

    def assign(self, name, value):
        self.lines.append(f"{name}={value}")

    def begin_while(self, counter, times):
        self.depth += 1
        self.lines += [f"#{counter}=0", f"WHILE[#{counter}LT{times}]DO{self.depth}"]

    def end_while(self, counter):
        self.lines += [f"#{counter}=#{counter}+1", f"END{self.depth}"]
        self.depth -= 1

    def begin_skip(self, condition):
        """Jumps over the block when the condition does not hold."""
        left, operator, right = condition.split()
        self.open.append(next(self.numbers))
        self.lines.append(f"IF[{left} {self._NOT[operator]} {right}]GOTO{self.open[-1]}")

    def end_skip(self):
        self.lines.append(f"N{self.open.pop()}")

    def if_assign(self, condition, name, value):
        self.lines.append(f"IF [{condition}] THEN {name}={value}")

    def call(self, number, repeat, r):
        self.lines.append(f"M98 P{number} L{repeat}" if repeat > 1 or r.random() < 0.2 else f"M98 P{number}")

    def macro(self, number, values):
        self.lines.append(f"G65 P{10 + number} " + " ".join(f"{a}{v}" for a, v in zip("ABC", values)))

    def program(self):
        subs = []
        for i in (1, 2, 3):
            subs += [f"O{i}", f"G91 G1 X{i}.", "Y-1.", "G90", f"#{120 + i}=#{120 + i}+1", "M99",
                     f"O1{i}", f"G1 X[#1+{i}] Y[#2*2]", "Z[#3-#1]", "#1=7", "X#1", "M99"]
        return self.lines + ["M30"] + subs


def _n(value, digits=4):
    """A number in one of the ways people write it."""
    text = f"{value:.{digits}f}".rstrip("0")
    if text in ("-0.", "0."):
        return "0"
    return text.rstrip(".") if len(text) % 2 else text


def _arc(r, plane, unit):
    """End and centre of an arc, as distances from its start."""
    radius, start = r.uniform(0.5, 40) / unit, r.uniform(0, 2 * math.pi)
    sense = r.choice((2, 3))
    sweep = r.uniform(0.2, 2 * math.pi - 0.2) * (1 if sense == 3 else -1)
    centre = (-radius * math.cos(start), -radius * math.sin(start))
    end = tuple(c + radius * f(start + sweep) for c, f in zip(centre, (math.cos, math.sin)))
    return sense, end, centre, radius, abs(sweep) > math.pi


def motion(r):
    """Modes, units, offsets, arcs of all forms in all planes."""
    unit, plane, incremental = 1.0, 17, False
    lines = ["G21 G90 G17 G94 F500"]
    for _ in range(r.randint(20, 80)):
        what = r.random()
        if what < 0.30:
            axes = r.sample("XYZAC", r.randint(1, 4))
            words = [a + _n(r.uniform(-100, 100) / (unit if a in "XYZ" else 1)) for a in axes]
            words.append(r.choice(("G0", "G1", "G1")))
            r.shuffle(words)
            lines.append(" ".join(words))
        elif what < 0.60:
            first, second = PLANE_AXES[plane]
            third = next(a for a in "XYZ" if a not in (first, second))
            sense, end, centre, radius, long_way = _arc(r, plane, unit)
            where, back = ("", "") if incremental else ("G91 ", " G90")
            helix = f" {third}{_n(r.uniform(-5, 5) / unit)}" if r.random() < 0.3 else ""
            form = r.random()
            if form < 0.5:
                turns = f" P{r.randint(1, 4)}" if r.random() < 0.3 else ""
                lines.append(f"{where}G{sense} {first}{_n(end[0], 7)} {second}{_n(end[1], 7)}"
                             f" {CENTRE[first]}{_n(centre[0], 7)} {CENTRE[second]}{_n(centre[1], 7)}{helix}{turns}")
            elif form < 0.8:
                lines.append(f"{where}G{sense} {first}{_n(end[0], 7)} {second}{_n(end[1], 7)}"
                             f" R{_n(-radius if long_way else radius, 7)}{helix}")
            else:
                lines.append(f"{where}G{sense} {CENTRE[first]}{_n(centre[0])} {CENTRE[second]}{_n(centre[1])}{helix}")
            if back:
                lines.append(back.strip())
        elif what < 0.66:
            plane = r.choice((17, 18, 19))
            lines.append(f"G{plane}")
        elif what < 0.71:
            incremental = not incremental
            lines.append("G91" if incremental else "G90")
        elif what < 0.76:
            unit = 25.4 if unit == 1.0 else 1.0
            # rs274 forgets to convert an active tool length.
            lines += ["G49", f"G20 F{_n(r.uniform(5, 80))}" if unit != 1.0 else f"G21 F{_n(r.uniform(50, 3000))}"]
        elif what < 0.82:
            lines.append(f"F{_n(r.uniform(10, 3000) / unit, 3)}")
        elif what < 0.88:
            words = " ".join(a + _n(r.uniform(-50, 50) / (unit if a in "XYZ" else 1))
                             for a in r.sample("XYZAC", r.randint(1, 3)))
            lines.append(f"G10 L{r.choice((2, 2, 20))} P{r.randint(0, 9)} {words}")
        elif what < 0.92:
            lines.append(r.choice(("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")))
        elif what < 0.95:
            axes = r.sample("XYZ", r.randint(1, 2))
            lines.append("G92 " + " ".join(a + _n(r.uniform(-30, 30) / unit) for a in axes))
        elif what < 0.97:
            lines.append(r.choice(("G92.1", "G92.2", "G92.3")))
        elif what < 0.985:
            lines.append(r.choice(("G43 H1", "G43 H3", "G43 H5", "G43.1 Z" + _n(r.uniform(0, 100) / unit), "G49")))
        else:
            # rs274 forgets G92 when it works out where it is in the turned system: to a point in both axes.
            lines += [f"G90 G10 L2 P0 R{_n(r.uniform(-180, 180), 2)}", f"G1 X{_n(r.uniform(-9, 9))} Y1",
                      "G10 L2 P0 R0", f"G1 X1 Y{_n(r.uniform(-9, 9))}", "G91" if incremental else "G90"]
    return lines


def cycles(r):
    """Drilling cycles with repeats, planes, retract modes."""
    lines = ["G21 G90 G17 G94 G99 F300 S500 M3", "G0 X0 Y0 Z50"]
    for _ in range(r.randint(3, 9)):
        plane = r.choice((17, 17, 17, 18, 19))
        first, second = PLANE_AXES[plane]
        third = next(a for a in "XYZ" if a not in (first, second))
        incremental = r.random() < 0.3
        code = r.choice((81, 81, 82, 83, 73, 85, 86, 89))
        start = r.uniform(5, 30)
        lines += [f"G80 G90 G{plane} G0 {third}{_n(start)}", "G91" if incremental else "G90"]
        retract = r.choice(("G98 ", "G99 ", ""))
        clear, bottom = (r.uniform(-4, -1), r.uniform(-9, -1)) if incremental else (r.uniform(0, 4), r.uniform(-9, -1))
        extra = {82: " P0.2", 86: " P0.1", 89: " P0.3"}.get(code, "")
        if code in (83, 73):
            extra = f" Q{_n(r.uniform(0.8, 5), 2)}"
        repeat = f" L{r.randint(1, 4)}" if r.random() < 0.4 else ""
        lines.append(f"{retract}G{code} {first}{_n(r.uniform(-50, 50))} {second}{_n(r.uniform(-50, 50))}"
                     f" {third}{_n(bottom, 2)} R{_n(clear, 2)}{extra}{repeat}")
        for _ in range(r.randint(0, 4)):
            lines.append(" ".join(a + _n(r.uniform(-50, 50)) for a in r.sample((first, second), r.randint(1, 2))))
            if r.random() < 0.2:
                lines[-1] += f" L{r.randint(2, 3)}"
            if r.random() < 0.2:
                lines[-1] = r.choice(("G98 ", "G99 ")) + lines[-1]
    return lines + ["G80 G90"]


class _Expression:
    """Grows an expression and knows its value, so that it stays defined and of moderate size."""

    def __init__(self, r, known):
        self.r, self.known = r, known

    def grow(self, depth):
        r = self.r
        if depth == 0 or r.random() < 0.15:
            if self.known and r.random() < 0.5:
                name = r.choice(sorted(self.known))
                return name, self.known[name]
            value = round(r.uniform(-20, 20), r.randint(0, 3))
            return (f"[{value}]" if value < 0 else f"{value}"), value
        kind = r.random()
        if kind < 0.3:
            return self._function(depth)
        a, x = self.grow(depth - 1)
        b, y = self.grow(depth - 1)
        operator = r.choice("+ - * / MOD GT LT AND OR".split())
        value = self._apply(operator, x, y)
        if value is None or abs(value) > 1e4:
            operator, value = "+", x + y
        text = f"[{a} {operator} {b}]" if operator.isalpha() or r.random() < 0.5 else f"[{a}{operator}{b}]"
        return text, value

    @staticmethod
    def _apply(operator, x, y):
        if operator in ("/", "MOD") and abs(y) < 0.05:
            return None
        if operator in ("GT", "LT") and abs(x - y) < 1e-6:
            return None
        if operator in ("AND", "OR") and min(abs(x), abs(y)) < 1e-6:
            return None
        if operator == "MOD":
            rest = math.fmod(x, y)
            if min(abs(rest), abs(abs(rest) - abs(y))) < 1e-6:
                return None
            return rest + abs(y) if rest < 0 else rest
        return {"+": lambda: x + y, "-": lambda: x - y, "*": lambda: x * y, "/": lambda: x / y,
                "GT": lambda: float(x > y), "LT": lambda: float(x < y),
                "AND": lambda: 1.0, "OR": lambda: 1.0}[operator]()

    def _function(self, depth):
        a, x = self.grow(depth - 1)
        name = self.r.choice("ABS SIN COS ATAN SQRT EXP LN FIX FUP ROUND".split())
        argument = a if a.startswith("[") else f"[{a}]"
        near = abs(x * 2 - round(x * 2)) < 1e-6
        if name == "ATAN":
            b, y = self.grow(depth - 1)
            if abs(x) + abs(y) < 1e-3 or (abs(x) < 1e-6 and y < 0):
                return a, x
            second = b if b.startswith("[") else f"[{b}]"
            return f"ATAN{argument}/{second}", math.degrees(math.atan2(x, y))
        if name in ("SQRT", "LN"):
            return f"{name}[ABS{argument}+1]", (math.sqrt if name == "SQRT" else math.log)(abs(x) + 1)
        if name == "EXP" and abs(x) > 5 or name in ("FIX", "FUP", "ROUND") and near:
            return f"ABS{argument}", abs(x)
        value = {"ABS": abs, "SIN": lambda v: math.sin(math.radians(v)), "COS": lambda v: math.cos(math.radians(v)),
                 "EXP": math.exp, "FIX": math.floor, "FUP": math.ceil, "ROUND": round}[name](x)
        return f"{name}{argument}", float(value)


def expressions(r):
    """Deep expressions of all operators and functions, numbered and named parameters."""
    lines, known = ["F1000 G1 X0"], {}
    for _ in range(r.randint(15, 50)):
        text, value = _Expression(r, known).grow(r.randint(1, 4))
        if r.random() < 0.5:
            name = r.choice((f"#{r.randint(1, 30)}", f"#{r.randint(100, 140)}", f"#<v{r.randint(1, 9)}>",
                             f"#<_g{r.randint(1, 9)}>"))
            lines.append(f"{name} = {text}")
            known[name] = value
        else:
            word = text if text.startswith(("[", "#")) else f"[{text}]"
            lines.append(f"{r.choice('XYZAC')}{word}")
    return lines


def flow(r):
    """Nested loops, branches, calls with arguments and results; no do loops, which rs274 leaves early when nested."""
    labels = iter(range(100, 10000))
    subs = [(f"<s{i}>", r.randint(0, 4)) for i in range(r.randint(1, 4))]
    lines = ["F1000"]

    def condition(counter):
        return f"[#{counter} {r.choice(('LT', 'GT', 'EQ', 'NE', 'LE', 'GE'))} {r.randint(0, 4)}]"

    def block(depth, counters, callable_subs, indent):
        pad = "  " * indent
        for _ in range(r.randint(1, 3)):
            kind = r.random()
            if depth == 0 or kind < 0.35:
                value = " + ".join([f"{_n(r.uniform(-9, 9), 2)}"] + [f"#{c}*{r.randint(1, 9)}" for c in counters])
                lines.append(f"{pad}G{r.choice((0, 1, 1))} {r.choice('XYZ')}[{value}]")
            elif kind < 0.5:
                label, counter = next(labels), r.choice(range(20, 30))
                while counter in counters:
                    counter = 20 + (counter - 19) % 10
                lines.append(f"{pad}#{counter} = 0")
                form = r.random()
                loop = counters + [counter]
                if form < 0.5:
                    lines.append(f"{pad}o{label} while [#{counter} LT {r.randint(0, 3)}]")
                    lines.append(f"{pad}  #{counter} = [#{counter} + 1]")
                    if r.random() < 0.3:
                        leave = next(labels)
                        lines.append(f"{pad}  o{leave} if {condition(counter)}")
                        lines.append(f"{pad}    o{label} {r.choice(('break', 'continue'))}")
                        lines.append(f"{pad}  o{leave} endif")
                    block(depth - 1, loop, callable_subs, indent + 1)
                    lines.append(f"{pad}o{label} endwhile")
                else:
                    lines.append(f"{pad}o{label} repeat [{r.randint(0, 3)}]")
                    lines.append(f"{pad}  #{counter} = [#{counter} + 1]")
                    block(depth - 1, loop, callable_subs, indent + 1)
                    lines.append(f"{pad}o{label} endrepeat")
            elif kind < 0.75:
                label = next(labels)
                counter = r.choice(counters) if counters else 1
                lines.append(f"{pad}o{label} if {condition(counter)}")
                block(depth - 1, counters, callable_subs, indent + 1)
                for _ in range(r.randint(0, 2)):
                    lines.append(f"{pad}o{label} elseif {condition(counter)}")
                    block(depth - 1, counters, callable_subs, indent + 1)
                if r.random() < 0.5:
                    lines.append(f"{pad}o{label} else")
                    block(depth - 1, counters, callable_subs, indent + 1)
                lines.append(f"{pad}o{label} endif")
            elif callable_subs:
                name, arguments = r.choice(callable_subs)
                values = " ".join(f"[{_n(r.uniform(-5, 5), 1)}]" for _ in range(arguments))
                lines.append(f"{pad}o{name} call {values}".rstrip())
                if r.random() < 0.4:
                    lines.append(f"{pad}G1 Z[#<_value> + 0.5]")
    for i, (name, arguments) in enumerate(subs):
        lines.append(f"o{name} sub")
        block(2, list(range(1, arguments + 1)), subs[:i], 1)
        lines.append(f"o{name} endsub [{_n(r.uniform(-9, 9), 2)}]")
    block(3, [], subs, 0)
    block(3, [], subs, 0)
    lines.append("G1 X0 Y0 Z0")
    return lines


def contours(r):
    """Compensated contours of lines and arcs; corners of every kind; the tool may be too large."""
    side = r.choice((41, 42))
    radius = r.choice((0.5, 1.0, 2.0, 4.0))
    plane = r.choice((17, 17, 17, 18))
    first, second = PLANE_AXES[plane]
    at, heading = [0.0, 0.0], r.uniform(-math.pi, math.pi)
    lines = [f"G21 G90 G{plane} F600"]
    back = (-30 * math.cos(heading), -30 * math.sin(heading))
    lines.append(f"G0 {first}{_n(back[0])} {second}{_n(back[1])}")
    lines.append(f"G{side}.1 D{_n(2 * radius)} G1 {first}0 {second}0")
    lines.append(f"G1 {first}{_n(15 * math.cos(heading))} {second}{_n(15 * math.sin(heading))}")
    at = [15 * math.cos(heading), 15 * math.sin(heading)]
    for _ in range(r.randint(2, 12)):
        if r.random() < 0.25:
            pass  # tangent
        else:
            heading += r.choice((1, -1)) * r.uniform(0.05, 2.4)
        if r.random() < 0.55:
            length = r.uniform(6, 40)
            end = (at[0] + length * math.cos(heading), at[1] + length * math.sin(heading))
            lines.append(f"G1 {first}{_n(end[0])} {second}{_n(end[1])}")
        else:
            sense, bend = r.choice(((2, -1), (3, 1)))
            bow, sweep = r.uniform(3, 25), r.uniform(0.3, 3.5)
            centre = (-bend * bow * math.sin(heading), bend * bow * math.cos(heading))
            angle = math.atan2(-centre[1], -centre[0]) + bend * sweep
            end = (at[0] + centre[0] + bow * math.cos(angle), at[1] + centre[1] + bow * math.sin(angle))
            climb = ""
            lines.append(f"G{sense} {first}{_n(end[0])} {second}{_n(end[1])} {CENTRE[first]}{_n(centre[0])}"
                         f" {CENTRE[second]}{_n(centre[1])}{climb}")
            heading += bend * sweep
        at = [float(f"{v:.4f}") for v in end]
    lines.append(f"G40 G1 {first}{_n(at[0] + 60 * math.cos(heading))} {second}{_n(at[1] + 60 * math.sin(heading))}")
    return lines


def surface(r):
    """A finishing program of thousands of short lines over a wavy surface, rotary axes along in some."""
    waves = [(r.uniform(0.02, 0.1), r.uniform(0.02, 0.1), r.uniform(0.5, 4)) for _ in range(3)]
    five_axes, inches = r.random() < 0.4, r.random() < 0.3
    unit = 25.4 if inches else 1.0
    digits = 5 if inches else 4
    lines = [f"{'G20' if inches else 'G21'} G90 G17 G94", f"G0 X0 Y0 Z{_n(50 / unit)}"]
    for row in range(r.randint(10, 25)):
        y = row * 1.5
        columns = range(0, 200)
        for i in columns if row % 2 == 0 else reversed(columns):
            x = i * 0.5
            z = sum(h * math.sin(p * x) * math.cos(q * y) for p, q, h in waves)
            words = f"X{_n(x / unit, digits)} Y{_n(y / unit, digits)} Z{_n(z / unit, digits)}"
            if five_axes:
                words += f" A{_n(10 * math.sin(x / 20), 3)} C{_n(x * 2 + row, 3)}"
            if i in (0, 199):
                words += f" F{_n(r.uniform(500, 5000) / unit, 2)}"
            lines.append(("G1 " if len(lines) < 4 else "") + words)
    # The name of the program is line 1, this remark line 2.
    return [canonical.LINES_NUMBERED] + [f"N{i} {line}" for i, line in enumerate(lines, 3)]


def modes(r):
    """Feed modes, machine frame, home, tool lengths, probing, and the ways a block can be written."""
    lines, feed_mode, tool = ["G21 G90 G17 G94 F500 S800 M3"], 94, False

    def point(axes, reach=80):
        return [a + _n(r.uniform(-reach, reach)) for a in axes]

    def block(words):
        """Words in any order, case, spacing, with N word, comment and slash."""
        r.shuffle(words)
        text = r.choice((" ", "", "  ", "\t")).join(words)
        if r.random() < 0.2:
            text = text.lower()
        if r.random() < 0.2:
            text += r.choice((" (note)", " ; note", "(x1 y2)"))
        if r.random() < 0.2:
            text = f"N{r.randint(0, 99999)} {text}"
        return "/" + text if r.random() < 0.05 else text

    def feed():
        return {93: f"F{_n(r.uniform(0.5, 50), 2)}", 94: f"F{_n(r.uniform(20, 5000), 2)}",
                95: f"F{_n(r.uniform(0.02, 2), 3)}"}[feed_mode]

    for _ in range(r.randint(20, 70)):
        what = r.random()
        if what < 0.3:
            words = [r.choice(("G1", "G01", "G1."))] + point(r.sample("XYZAC", r.randint(1, 5)))
            if feed_mode == 93 or r.random() < 0.3:
                words.append(feed())
            lines.append(block(words))
        elif what < 0.42:
            lines.append(block([r.choice(("G0", "G00"))] + point(r.sample("XYZAC", r.randint(1, 5)))))
        elif what < 0.54:
            sense, end, centre, _, _ = _arc(r, 17, 1.0)
            words = [f"G{sense}", "G91", f"X{_n(end[0], 6)}", f"Y{_n(end[1], 6)}", f"I{_n(centre[0], 6)}",
                     f"J{_n(centre[1], 6)}"]
            if feed_mode == 93 or r.random() < 0.3:
                words.append(feed())
            lines += [block(words).lstrip("/"), "G90"]
        elif what < 0.64:
            feed_mode = r.choice((93, 94, 95))
            lines.append(block([f"G{feed_mode}", "G1", feed()] + point("XYZ")).lstrip("/"))
        elif what < 0.72:
            words = ["G53", r.choice(("G0", "G1"))] + point(r.sample("XYZ", r.randint(1, 3)))
            if feed_mode == 93:
                words.append(feed())
            lines.append(block(words))
        elif what < 0.78:
            lines.append(r.choice(("G28", "G30", "G28.1", "G30.1", "G28 Z" + _n(r.uniform(0, 50)),
                                   "G30 X" + _n(r.uniform(-9, 9)) + " Y" + _n(r.uniform(-9, 9)))))
        elif what < 0.86:
            lines.append(r.choice(("G49", "G43 H1", "G43 H5", "G43.2 H3", "G43.1 Z" + _n(r.uniform(-20, 90)),
                                   "G10 L1 P5 Z" + _n(r.uniform(0, 90)), "G10 L10 P3 Z" + _n(r.uniform(0, 20)))))
        elif what < 0.9 and feed_mode == 94:
            lines += ["G38.3 " + " ".join(point("XYZ")) + f" {feed()}", "G0 " + " ".join(point("XYZ"))]
        elif what < 0.95:
            lines.append("G10 L2 P1 " + " ".join(point(r.sample("XYZAC", 2), 20)))
        else:
            lines.append(r.choice(("M8", "M9", "G4 P0.01", "M3 S100", "(remark)", "G64 P0.01", "G61", "M1", "T4")))
    return lines


KINDS = {"motion": motion, "cycles": cycles, "expressions": expressions, "flow": flow, "contours": contours,
         "surface": surface, "modes": modes}
