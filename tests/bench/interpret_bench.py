#!/usr/bin/env python3
"""Blocks per second of `vcnc interpret` and of LinuxCNC's rs274 on the same three-axis program, in the same run.

    interpret_bench.py VCNC [LINES]

The program is a finishing path of G1 blocks of three words with four decimals, a million lines unless told. Both write
every motion as text: rs274 -g to /dev/null, vcnc its JSON to /dev/null. Processor time, so that other work on the
machine does not count; best of three, alternating.
"""

import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile


def write_program(path, lines):
    with open(path, "w", encoding="ascii") as file:
        file.write("G21 G90 G17 G94\nG1 X0 Y0 Z10 F3000\n")
        for i in range(lines - 3):
            row, column = divmod(i, 1000)
            x = 0.2 * (column if row % 2 == 0 else 999 - column)
            y = 0.2 * row
            file.write(f"X{x:.4f} Y{y:.4f} Z{3 * math.sin(0.05 * x) * math.cos(0.03 * y):.4f}\n")
        file.write("M2\n")


def seconds(command, home):
    """Processor time, user and system."""
    with open(os.devnull, "wb") as sink:
        process = subprocess.Popen(command, stdout=sink, stderr=sink, cwd=home, env={**os.environ, "HOME": str(home)})
        _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit code {process.returncode}")
    return used.ru_utime + used.ru_stime


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    vcnc, lines = sys.argv[1], int(sys.argv[2]) if len(sys.argv) == 3 else 1_000_000
    with tempfile.TemporaryDirectory(prefix="vcnc-bench-") as folder:
        home = pathlib.Path(folder)
        program = home / "surface.ngc"
        write_program(program, lines)
        commands = {"vcnc": [vcnc, "interpret", str(program), "--json", os.devnull]}
        if shutil.which("rs274"):
            commands["rs274"] = ["rs274", "-g", str(program)]
        best = {name: min(times) for name, times in
                zip(commands, zip(*[[seconds(c, home) for c in commands.values()] for _ in range(3)]))}
    for name, time_s in best.items():
        print(f"interpret {lines} lines: {name:6} {time_s:7.2f} s  {lines / time_s:12,.0f} blocks/s")
    if "rs274" in best:
        print(f"interpret: vcnc / rs274 = {best['rs274'] / best['vcnc']:.1f}")
    else:
        print("interpret: no rs274 (package linuxcnc-uspace) to compare with")


if __name__ == "__main__":
    main()
