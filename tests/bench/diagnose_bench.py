#!/usr/bin/env python3
"""What `vcnc diagnose` costs, against one simulation of the same record by `vcnc run --in-process`, in the same run.

    diagnose_bench.py VCNC MACHINE PIECE [CASE]...

Three laps of a circle in the ring PIECE on MACHINE with converter noise, absolute, the whole library: `clean`, as declared;
`single`, with 20 urad of squareness; `pair`, with 8 um of backlash and 40 N of dry friction on X. All three unless told.
Processor time of all threads, user and system; other work on the machine still shows in it where two threads share a core.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

NOISE = "probe.adc_noise.noise_mV=2"
CASES = {
    "clean": [],
    "single": ["geometry.squareness.xy_urad=20"],
    "pair": ["X.backlash.gap_um=8", "X.coulomb.level_N=40"],
}


def cost(command):
    """Processor time and wall time."""
    begin = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    complaint = process.stderr.read().decode()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit code {process.returncode}\n{complaint}")
    return used.ru_utime + used.ru_stime, time.monotonic() - begin


def main():
    if len(sys.argv) < 4 or any(case not in CASES for case in sys.argv[4:]):
        sys.exit(__doc__)
    vcnc, machine, piece = sys.argv[1:4]
    with tempfile.TemporaryDirectory(prefix="vcnc-bench-") as folder:
        home = pathlib.Path(folder)
        program, ring = str(home / "laps.ngc"), ["--set", f"setup.piece={piece}"]
        cost([vcnc, "program", "circle", "--machine", machine, *ring, "--feed-mm-min", "2700", "--laps", "3", "--out", program])

        def run(name, injected):
            inject = [word for key in [NOISE, *injected] for word in ("--inject", key)]
            return cost([vcnc, "run", program, "--machine", machine, *ring, "--in-process", "--no-report", *inject,
                         "--out", str(home / name)])

        simulation, _ = run("declared", [])
        print(f"diagnose: one simulation {simulation:6.2f} s of processor")
        for case in sys.argv[4:] or CASES:
            run(case, CASES[case])
            out = home / f"why-{case}"
            processor, wall = cost([vcnc, "diagnose", str(home / case), "--model", str(home / "declared" / "machine.toml"),
                                    "--out", str(out)])
            found = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
            effects = " ".join(f"{e['axis']}.{e['name']}" for e in found["effects"]) or "-"
            print(f"diagnose {case:6} {processor:7.1f} s of processor  {wall:6.1f} s wall  {processor / simulation:6.1f} simulations  "
                  f"{found['verdict']}: {effects}")


if __name__ == "__main__":
    main()
