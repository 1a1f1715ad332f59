#!/usr/bin/env python3
"""What `vcnc interpret`, `check` and `plan` say to a shell: exit codes, one error, the keys of what they write.

    command_line.py [--vcnc PATH]
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import interpreters

HERE = pathlib.Path(__file__).resolve().parent
MACHINE = HERE.parents[1] / "configs/machines/trunnion.toml"
MOTION_KEYS = {"type", "line", "end", "feed", "feed_mode"}
ARC_KEYS = MOTION_KEYS | {"centre", "plane", "turns"}

# name: text, what the error has behind the file's name
REFUSED = {
    "empty": (b"", ": the program is empty"),
    "no end": (b"G0 X1\n", ":1:1: the program does not end with M2 or M30"),
    "nul": (b"G0 X1\n\0M2\n", ":2:1: NUL byte"),
    "two bytes a letter": ("G0 X1\nM2\n".encode("utf-16"), ":1:4: NUL byte"),
    "long line": (b"G0 X1" + b" " * 1_000_000 + b"\nM2\n", ":1:4097: line longer than"),
    "old Mac": (b"G0 X1\rM2\r", ":1:6: unexpected byte 0x0d"),
    "calls itself": (b"o1 sub\no1 call\no1 endsub\no1 call\nM2\n", ":2:1: calls nested deeper than"),
    "M98 to itself": (b"O1\nM98 P1\nM30\n", ":2:1: calls nested deeper than"),
    "endless": (b"o1 while [1]\no1 endwhile\nM2\n", ":2:1: more than 2000000 passes"),
    "huge": (b"G0 X99999999\nM2\n", ":1:5: X: number too large: 99999999"),
    "huge value": (b"G0 X[9999999*9999999]\nM2\n", ":1:4: number too large"),
    "radius too small": (b"G1 F100 X0\nG2 X10 R4\nM2\n", ":2:8: R4 is shorter than half the chord"),
    "radius zero": (b"G1 F100 X0\nG2 X0 Y0 I0 J0\nM2\n", ":2:10: arc of radius 0"),
    "unknown": (b"G1 F100 X0\n  G12.7 X1\nM2\n", ":2:3: unknown G12.7"),
    "last line": (b"G1 F100 X0\n" + b"X1\nX0\n" * 5000 + b"W1\nM2\n", ":10002:1: unknown word W1"),
}

# name: text, ends (X, Y, Z, A, C) of its motions
ACCEPTED = {
    "no line end": (b"G0 X1\nM2", [(1, 0, 0, 0, 0)]),
    "crlf": (b"G0 X1\r\nM2\r\n", [(1, 0, 0, 0, 0)]),
    "byte order mark": (b"\xef\xbb\xbfG0 X1\nM2\n", [(1, 0, 0, 0, 0)]),
    "units": (b"G20 G0 X1\nG21 X1\nG20 G91 X1\nM2\n", [(25.4, 0, 0, 0, 0), (1, 0, 0, 0, 0), (26.4, 0, 0, 0, 0)]),
    "offset turned": (b"G10 L2 P1 X10 R90\nG54 G0 X5\nG10 L20 P1 X0 Y0\nX1 A30\nM2\n",
                      [(0, 5, 0, 0, 0), (0, 6, 0, 30, 0)]),
    "G53 under G92": (b"G0 X5\nG92 X1\nG0 X0\nG53 G0 X0\nX1\nM2\n",
                      [(5, 0, 0, 0, 0), (4, 0, 0, 0, 0), (0, 0, 0, 0, 0), (5, 0, 0, 0, 0)]),
    "G28 under G91": (b"G0 X10 Y5\nG91 G28 X5\nX1\nM2\n",
                      [(10, 5, 0, 0, 0), (15, 5, 0, 0, 0), (0, 5, 0, 0, 0), (1, 5, 0, 0, 0)]),
    "arc under G68": (b"G1 F100\nG68 X0 Y0 R90\nX10 Y0\nG3 X0 Y10 R10\nM2\n",
                      [(0, 10, 0, 0, 0), (-10, 0, 0, 0, 0)]),
}


class Checks:
    def __init__(self, vcnc, folder):
        self.vcnc, self.folder, self.wrong, self.made = vcnc, pathlib.Path(folder), [], 0

    def run(self, *arguments):
        done = subprocess.run([self.vcnc, *map(str, arguments)], capture_output=True, timeout=120, check=False,
                              stdin=subprocess.DEVNULL)
        return done.returncode, done.stdout.decode(), done.stderr.decode()

    def expect(self, true, name, what):
        self.made += 1
        if not true:
            self.wrong.append(f"{name}: {what}")

    def program(self, text):
        path = self.folder / "program.ngc"
        path.write_bytes(text)
        return path

    def refused(self, name, text, error):
        path = self.program(text)
        for command, wanted in (("interpret", 1), ("check", 2)):
            code, out, said = self.run(command, path)
            self.expect(code == wanted, name, f"{command} ends with {code}, not {wanted}")
            self.expect(said.startswith(f"vcnc: {path}{error}") and said.count("\n") == 1, name, said)
            if command == "interpret":
                self.expect(json.loads(out)["refused"] == said.strip().removeprefix("vcnc: "), name, out[-200:])

    def accepted(self, name, text, ends):
        path = self.program(text)
        code, out, said = self.run("interpret", path)
        self.expect((code, said) == (0, ""), name, f"{code} {said}")
        segments = [s for s in json.loads(out)["segments"] if "end" in s]
        got = [tuple(s["end"][axis] for axis in "XYZAC") for s in segments]
        self.expect(len(got) == len(ends) and all(abs(a - b) < 1e-6 for x, y in zip(got, ends) for a, b in zip(x, y)),
                    name, got)
        self.expect(self.run("check", path)[0] == 0, name, "check refuses it")

    def keys(self):
        path = self.program(b"G0 X1\nG1 F200 X0\nG93 F2 A5\nG94 F60 C9\nG2 F90 X0 Y0 Z4 I5 P2\nG18 G3 X6 Z4 I3\n"
                            b"S600 G95 F0.1 G1 X0\nM2\n")
        target = self.folder / "path.json"
        code, out, said = self.run("interpret", path, "--json", target)
        self.expect((code, out, said) == (0, "", ""), "keys", (code, out, said))
        segments = json.loads(target.read_text())["segments"]
        self.expect([s["type"] for s in segments] == ["rapid", "line", "line", "line", "arc", "arc", "line"], "keys",
                    "types")
        self.expect([s["line"] for s in segments] == [1, 2, 3, 4, 5, 6, 7], "keys", "lines")
        self.expect(set(segments[0]) == {"type", "line", "end"}, "keys", segments[0])
        for s in segments[1:]:
            self.expect(set(s) == (ARC_KEYS if s["type"] == "arc" else MOTION_KEYS), "keys", s)
        self.expect([s.get("feed_mode") for s in segments] == [
            None, "per_minute", "inverse_time", "rotary_per_minute", "per_minute", "per_minute", "per_turn"], "keys",
            "feed modes")
        self.expect([s.get("feed") for s in segments] == [None, 200, 2, 60, 90, 90, 0.1], "keys", "feeds")
        helix, half = segments[4:6]
        self.expect((helix["plane"], helix["turns"], helix["centre"]) == (17, -2, {"X": 5, "Y": 0, "Z": 4}), "keys",
                    helix)
        self.expect((half["plane"], half["turns"], half["centre"]) == (18, 0.5, {"X": 3, "Y": 0, "Z": 4}), "keys", half)

    def files(self):
        for name, arguments, wanted in (("missing", [self.folder / "none.ngc"], 1), ("a folder", [self.folder], 1),
                                        ("no program", [], 2), ("no such dialect", ["p", "--dialect", "x"], 2)):
            code, _, said = self.run("interpret", *arguments)
            self.expect(code == wanted and said != "", name, (code, said))
        path = self.program(b"G1 F100 X1\nM2\n")
        for target in (self.folder / "none/path.json", "/dev/full"):
            code, _, said = self.run("interpret", path, "--json", target)
            self.expect(code == 2 and said == f"vcnc: {target}: cannot be written\n", target, (code, said))

    def dialects(self):
        text = b"R1=10\nG0 X=R1\nM30\n"
        path = self.folder / "part.mpf"
        path.write_bytes(text)
        self.expect(self.run("check", path)[0] == 0, "by its ending", "refused")
        path = self.program(text)
        self.expect(self.run("check", path)[0] == 2, "of no dialect", "accepted")
        for command in (["check"], ["check", "--machine", MACHINE], ["plan", "--machine", MACHINE]):
            code, _, said = self.run(command[0], path, *command[1:], "--dialect", "siemens")
            self.expect(code == 0, "of Siemens", said)

    def plan(self):
        path = self.program(b"G0 X10\nG1 F6000 X60 Y20\nG4 P0.25\nM2\n")
        target = self.folder / "plan.csv"
        code, out, said = self.run("plan", path, "--machine", MACHINE, "--csv", target)
        self.expect((code, said) == (0, ""), "plan", said)
        with target.open() as file:
            rows = list(csv.DictReader(file))
        self.expect(list(rows[0]) == ["time_s", "X_mm", "Y_mm", "Z_mm", "A_deg", "C_deg", "tip_X_mm", "tip_Y_mm",
                                      "tip_Z_mm", "feed_mm_min", "line"], "plan", list(rows[0]))
        times = [float(row["time_s"]) for row in rows]
        self.expect(all(abs(t - 1e-3 * (i + 1)) < 1e-9 for i, t in enumerate(times)), "plan", "a row each cycle")
        self.expect(f"total time {times[-1]:.3f} s, of which 0.250 s waiting" in out, "plan", out)
        self.expect((float(rows[-1]["X_mm"]), float(rows[-1]["Y_mm"])) == (60, 20), "plan", rows[-1])
        self.expect(abs(max(float(row["feed_mm_min"]) for row in rows if row["line"] == "2") - 6000) < 0.5 or
                    max(float(row["feed_mm_min"]) for row in rows if row["line"] == "2") < 6000, "plan", "feed")
        far = self.program(b"G0 X4000\nM2\n")
        code, _, said = self.run("plan", far, "--machine", MACHINE)
        self.expect(code == 2 and said.startswith(f"vcnc: {far}:1:1: X would reach 4000.000 mm"), "plan", said)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vcnc", default=interpreters.default_vcnc(), help="the vcnc program (VCNC_PEER_VCNC)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="vcnc-peer-") as folder:
        checks = Checks(options.vcnc, folder)
        for name, case in REFUSED.items():
            checks.refused(name, *case)
        for name, case in ACCEPTED.items():
            checks.accepted(name, *case)
        for more in (checks.keys, checks.files, checks.dialects, checks.plan):
            more()
    for text in checks.wrong:
        print(text)
    print(f"{checks.made} expectations, {len(checks.wrong)} not met")
    return 1 if checks.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
