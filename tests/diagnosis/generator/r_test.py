#!/usr/bin/env python3
"""An R-test on a machine of the generator: a ball in the spindle is held where it is on the table while the rotary axes turn,
and a sensor on the table reads its place.

    r_test.py OUT [--fault geometry.c_axis_offset.x_um=12 ...] [--seed N]

OUT gets machine.toml (declared), healthy.csv and test.csv with the commands of all axes and the three readings, and map.toml.
C turns once and back, then A swings to both sides while C turns by a quarter, all twice; before that A swings once, so that
every axis comes to rest as it does later. The individual's masses and friction
are off by their tolerances, and the sensor is set anew for every test: 1 kHz, 0.1 um noise in steps of 10 nm.
"""

import argparse
import pathlib

import numpy as np

import drives
import files
import kinematics
import machine
from ball_bar import CLAMPED, fault, healthy_and_faulty, merged, simulated

BALL = np.array([0.03, 0.05, 0.06])  # in the frame of the table, from the piece's place
TURN = 2 * np.pi
REST, NOISE, STEP = 0.5, 0.1e-6, 10e-9


def eased(way, seconds):
    """From 0 to 1 and back to rest at every tick."""
    u = np.linspace(0, 1, round(seconds / drives.kTick))
    return way * u**3 * (10 - 15 * u + 6 * u**2)


def rotary():
    """Angles of A and C at every tick, and (begin, end, condition) of every lap in ticks."""
    a, c, laps = [np.zeros(round(REST / drives.kTick))], [np.zeros(round(REST / drives.kTick))], []

    def section(condition, moves):
        begin = sum(len(x) for x in a)
        for of_a, of_c, seconds in moves:
            a.append(a[-1][-1] + eased(of_a, seconds))
            c.append(c[-1][-1] + eased(of_c, seconds))
        if condition:
            laps.append((begin, sum(len(x) for x in a), condition))
        for x in (a, c):
            x.append(np.full(round(REST / drives.kTick), x[-1][-1]))

    tilt = 35 * files.DEGREE
    swing = [(tilt, TURN / 4, 2.5), (-2 * tilt, -TURN / 4, 4), (tilt, 0, 2.5)]
    section("", swing)
    for _ in range(2):
        section("C turns", [(0, TURN, 7), (0, -TURN, 7)])
        section("A swings", swing)
    return np.concatenate(a), np.concatenate(c), laps


def holding(a, c):
    """Commands of all axes that keep the tool at the ball."""
    g = kinematics.Geometry()
    back_a, back_c = (np.swapaxes(kinematics.rotation(w, x), 1, 2) for w, x in ((g.a, a), (g.c, c)))
    seen_a = np.einsum("nij,j->ni", back_c, BALL + machine.PIECE - g.c_point) + g.c_point
    linear = np.einsum("nij,nj->ni", back_a, seen_a - g.a_point) + g.a_point - g.tool
    return np.concatenate([linear, a[:, None], c[:, None]], axis=1)


def readings(m, series, commands, rng):
    t, _, p, _ = machine.tip(commands, m, series)
    read = p - BALL - CLAMPED * rng.standard_normal(3) + NOISE * rng.standard_normal(p.shape)
    return t, np.round(read / STEP) * STEP


def map_toml(zero, laps):
    out = ['machine = "machine.toml"', "", "[time]", 'column = "time_s"', 'unit = "s"', ""]
    for i, axis in enumerate(machine.AXES):
        unit = "deg" if files.ROTARY[i] else "mm"
        out += ["[[signals]]", f'column = "{axis}"', 'kind = "command"', f'axis = "{axis}"', f'unit = "{unit}"', ""]
    for c in "xyz":
        out += ["[[signals]]", f'column = "{c}_um"', 'kind = "tool_position"', f'axis = "{c}"', 'unit = "um"', ""]
    out += ["[tool_position]", f"zero_mm = [{', '.join(f'{z * 1e3:.9g}' for z in zero)}]", ""]
    for begin, end, condition in laps:
        out += ["[[laps]]", f"from_s = {begin * drives.kTick:.3f}", f"to_s = {end * drives.kTick:.3f}", f'condition = "{condition}"', ""]
    return "\n".join(out)


def generate(out, tests, seed=1):
    """tests: by its name, the faults of each; NAME.csv beside healthy.csv."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "machine.toml").write_text(files.machine_toml().replace('piece = "piece.toml"\n', ""))
    a, c, laps = rotary()
    commands = holding(a, c)
    rng = np.random.default_rng(seed)
    machines = healthy_and_faulty(tests.values(), rng)
    for name, m, series in zip(("healthy", *tests), machines, simulated(commands, machines, seed)):
        t, read = readings(m, series, commands, rng)
        factors = [1 / files.DEGREE if r else 1e3 for r in files.ROTARY]
        rows = np.concatenate([t[:, None], commands * factors, read * 1e6], axis=1)
        np.savetxt(out / f"{name}.csv", rows, fmt=["%.3f"] + ["%.9f"] * 5 + ["%.2f"] * 3, delimiter=",",
                   header="time_s,X,Y,Z,A,C,x_um,y_um,z_um", comments="")
    (out / "map.toml").write_text(map_toml(commands[0, :3], laps))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--fault", type=fault, action="append", default=[], help="PLACE.EFFECT.PARAMETER=VALUE")
    parser.add_argument("--seed", type=int, default=1)
    a = parser.parse_args()
    generate(a.out, {"test": merged(a.fault)}, a.seed)


if __name__ == "__main__":
    main()
