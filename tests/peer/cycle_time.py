#!/usr/bin/env python3
"""Cycle times of the planner's three-axis programs on a real LinuxCNC and on vcnc.

    cycle_time.py [--vcnc PATH] [--bench PATH] [--only REGEX] [--keep FOLDER]

LinuxCNC (trapezoidal planner, motmod and tpmod with three ideal axes, not in real time) plays each program; the servo
periods from the first to the last movement are counted, so a busy host changes nothing. vcnc plans the same file with
the same velocities and accelerations and with a jerk that LinuxCNC does not limit; no planner that limits it can be quicker than the bound
(tests/bench/jerk_bound.hpp). 77: LinuxCNC is not installed.
"""

import argparse
import os
import pathlib
import pwd
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SKIPPED = 77
PERIOD_S = 1e-3
AXES = "XYZ"
VELOCITY, ACCELERATION, JERK = 500, 5000, 50_000  # mm and s, of each axis
MOVED = 1e-9  # mm
HEADER = "G21 G90 G17 G94\n"
MACHINE = "".join(f"\n[axes.{axis}]\nmin_mm = -1000\nmax_mm = 1000\nstart_mm = 0\nvelocity_mm_s = {VELOCITY}\n"
                  f"acceleration_mm_s2 = {ACCELERATION}\njerk_mm_s3 = {JERK}\n" for axis in AXES) + \
    "\n[setup]\ng54_mm = [0, 0, 0]\n\n[probe]\nin_spindle = false\n"


def play_on_linuxcnc(folder):
    """LinuxCNC does not run as root; the folder then belongs to nobody for a while."""
    for file in ("cycle_time.ini", "cycle_time.hal", "play_all.py"):
        shutil.copy(HERE / "linuxcnc" / file, folder)
    (folder / "tool.tbl").touch()
    owner = {}
    if os.geteuid() == 0:
        nobody = pwd.getpwnam("nobody")
        owner = {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}
        for path in (folder, *folder.iterdir()):
            os.chown(path, nobody.pw_uid, nobody.pw_gid)
    done = subprocess.run(["linuxcnc", "-r", "cycle_time.ini"], cwd=folder, env={**os.environ, "HOME": str(folder)},
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **owner)
    if list(folder.glob("*.ngc")) and not list(folder.glob("*.samples")):
        sys.exit(f"LinuxCNC played nothing:\n{done.stdout}")


class Samples:
    """Commanded positions, one row per servo period."""

    def __init__(self, file):
        lines = file.read_text().splitlines()
        if lines[:1] == ["overrun"]:  # counted on from the program before
            lines.pop(0)
        rows = [[float(word) for word in line.split() if word != "overrun"] for line in lines]
        if any(len(row) != 4 for row in rows) or any(b[0] - a[0] != 1 for a, b in zip(rows, rows[1:])):
            sys.exit(f"{file.name}: samples are missing")
        self.positions = [row[1:] for row in rows]

    def time_s(self):
        moving = [i for i, (a, b) in enumerate(zip(self.positions, self.positions[1:]))
                  if max(abs(p - q) for p, q in zip(a, b)) > MOVED]
        return (moving[-1] - moving[0] + 1) * PERIOD_S if moving else 0.0

    def largest(self, order):
        """Largest difference of this order on any axis, per period."""
        largest = 0.0
        for axis in range(3):
            values = [row[axis] for row in self.positions]
            for _ in range(order):
                values = [(b - a) / PERIOD_S for a, b in zip(values, values[1:])]
            largest = max(largest, max(map(abs, values)))
        return largest


def plan(vcnc, machine, program, dynamics):
    done = subprocess.run([vcnc, "plan", str(program), "--machine", str(machine), "--dynamics", dynamics],
                          capture_output=True, text=True, check=False)
    found = re.search(r"total time ([\d.]+) s", done.stdout)
    if done.returncode != 0 or not found:
        sys.exit(f"vcnc plan {program.name}: {done.stderr.strip()}")
    return float(found[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vcnc", default=str(ROOT / "build/release/bin/vcnc"))
    parser.add_argument("--bench", default=str(ROOT / "build/bench/bin/bench_planner"),
                        help="bench_planner, which writes the programs")
    parser.add_argument("--only", default="", help="regex of the programs to play")
    parser.add_argument("--keep", help="a folder for programs and samples")
    options = parser.parse_args()
    if shutil.which("linuxcnc") is None:
        print("linuxcnc is not installed (Debian package linuxcnc-uspace)")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="vcnc-cycle-time-") as name:
        folder = pathlib.Path(name)
        subprocess.run([options.bench, "--programs", name], check=True)
        for program in folder.glob("*.ngc"):
            if re.search(options.only, program.stem):
                program.write_text(HEADER + program.read_text())
            else:
                program.unlink()
        machine = folder / "three_axes.toml"
        machine.write_text(MACHINE)
        play_on_linuxcnc(folder)
        print(f"{'':<20}{'LinuxCNC s':>12}{'a':>7}{'j':>7}{'bound s':>9}{'bound / LinuxCNC':>18}{'smooth s':>10}{'fast s':>9}"
              f"{'fast / bound':>14}{'fast / LinuxCNC':>17}")
        peer_sum = fast_sum = bound_sum = 0.0
        for program in sorted(folder.glob("*.ngc")):
            samples = Samples(program.with_suffix(".samples"))
            peer = samples.time_s()
            bound = float(program.with_suffix(".bound").read_text())
            smooth, fast = (plan(options.vcnc, machine, program, dynamics) for dynamics in ("smooth", "fast"))
            print(f"{program.stem:<20}{peer:12.3f}{samples.largest(2) / ACCELERATION:7.2f}"
                  f"{samples.largest(3) / JERK:7.1f}{bound:9.3f}{bound / peer:18.3f}{smooth:10.3f}{fast:9.3f}"
                  f"{fast / bound:14.3f}{fast / peer:17.3f}")
            peer_sum, fast_sum, bound_sum = peer_sum + peer, fast_sum + fast, bound_sum + bound
        print(f"{'all':<20}{peer_sum:12.3f}{'':14}{bound_sum:9.3f}{bound_sum / peer_sum:18.3f}{'':10}{fast_sum:9.3f}"
              f"{fast_sum / bound_sum:14.3f}{fast_sum / peer_sum:17.3f}")
        print("a, j: LinuxCNC's largest acceleration and jerk, in shares of the limits of vcnc")
        if options.keep:
            shutil.copytree(folder, options.keep, dirs_exist_ok=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
