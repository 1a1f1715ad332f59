#!/usr/bin/env python3
"""A ball bar on a machine of the generator: what a user would bring, and what is wrong with it.

    ball_bar.py OUT [--fault X.backlash.gap_um=6 ...] [--seed N] [--laps 1] [--radius 100] [--feed 3000]

OUT gets machine.toml (declared), healthy.csv and test.csv, each a counter-clockwise and a clockwise circle in the plane of
X and Y with its time and the length of the bar, and map.toml, which tells the arcs. The axes come into a circle and leave it by half a turn at a tangential
acceleration of 0.3 m/s^2, of which nothing is told. The individual's masses and friction are off by their tolerances, and the
ball on the table is set anew for every test. The bar: 1 kHz, 0.1 um steps, 0.1 um noise, zero off by 0.5 um.
"""

import argparse
import pathlib

import numpy as np

import drives
import effects
import files
import kinematics
import machine

CENTRE = np.array([0.05, 0.08, 0.3])  # X Y Z of the machine
TURN = 2 * np.pi
ACCELERATION, RUN, STANDING = 0.3, np.pi, 0.7
STEP, NOISE, ZERO, CLAMPED = 0.1e-6, 0.1e-6, 0.5e-6, 20e-6


def angles(start, sweep, speed, acceleration):
    """Angle at every tick of an arc with its run-in and run-out, and the index at which it begins."""
    ramp = speed / acceleration
    steady = (abs(sweep) + 2 * RUN - speed * ramp) / speed
    t = np.arange(0, 2 * ramp + steady, drives.kTick)
    up = 0.5 * acceleration * np.minimum(t, ramp) ** 2
    even = speed * np.clip(t - ramp, 0, steady)
    down = t - ramp - steady
    way = up + even + np.where(down > 0, speed * down - 0.5 * acceleration * down**2, 0)
    return start + np.sign(sweep) * (way - RUN), 0.5 * ramp + RUN / speed


def course(radius, feed, laps):
    """Commands (ticks, 5) and the time at which each of the two arcs begins."""
    speed, acceleration = feed / radius, ACCELERATION / radius
    parts, begins, tick = [], [], 0
    for sweep in (TURN * laps, -TURN * laps):
        angle, into = angles(0.0 if sweep > 0 else TURN * laps, sweep, speed, acceleration)
        stand = np.full(round(STANDING / drives.kTick), angle[0])
        if parts:  # from where the one ended to where the other begins
            u = np.linspace(0, 1, round(1 / drives.kTick))
            parts.append(parts[-1][-1] + (angle[0] - parts[-1][-1]) * u**3 * (10 - 15 * u + 6 * u**2))
            tick += len(parts[-1])
        parts += [stand, angle]
        begins.append((tick + len(stand)) * drives.kTick + into)
        tick += len(stand) + len(angle)
    angle = np.concatenate(parts)
    commands = np.zeros((len(angle), 5))
    commands[:, :3] = CENTRE
    commands[:, 0] += radius * np.cos(angle)
    commands[:, 1] += radius * np.sin(angle)
    return commands, begins


def lengths(m, series, commands, radius, rng):
    """What the bar reads [m]: distance of the ball in the spindle from that on the table, less the nominal one."""
    t, _, p, _ = machine.tip(commands, m, series)
    ideal = kinematics.Geometry()
    ideal.piece = machine.PIECE
    there = np.zeros((1, 5))
    there[0, :3] = CENTRE
    table, _ = kinematics.tip_in_piece(ideal, there)
    off = CLAMPED * rng.standard_normal(3)
    read = np.linalg.norm(p - table[0] - off, axis=1) - radius
    read += ZERO * rng.standard_normal() + NOISE * rng.standard_normal(len(t))
    return t, np.round(read / STEP) * STEP


def map_toml(begins, radius, feed, laps):
    out = ['machine = "machine.toml"', "", "[time]", 'column = "time_s"', 'unit = "s"', "", "[[signals]]",
           'column = "bar_um"', 'kind = "bar"', 'unit = "um"', "", "[bar]",
           f"centre_mm = [{', '.join(f'{c * 1e3:g}' for c in CENTRE)}]", f"radius_mm = {radius * 1e3:g}",
           f"feed_mm_min = {feed * 6e4:g}", ""]
    for begin, start, sweep in zip(begins, (0, 360 * laps), (360 * laps, -360 * laps)):
        out += ["[[arcs]]", f"from_s = {begin:.6f}", f"start_deg = {start}", f"sweep_deg = {sweep}", ""]
    return "\n".join(out)


def healthy_and_faulty(tests, rng):
    """The same individual healthy and, with the faults (name, place, parameters) of each of the tests, once more; what is on
    the table is set by itself."""
    individual = machine.tolerated(rng)
    machines = [machine.healthy(individual, rng) for _ in range(1 + len(tests))]
    for m, faults in zip(machines[1:], tests):
        for name, place, parameters in faults:
            effects.inject(m, name, place, parameters)
    for m in machines:
        m.geometry.piece, m.geometry.piece_turn = machine.PIECE, np.zeros(3)
    return machines


def generate(out, tests, seed=1, laps=1, radius=0.1, feed=0.05):
    """tests: by its name, the faults of each; NAME.csv beside healthy.csv."""
    out.mkdir(parents=True, exist_ok=True)
    toml = files.machine_toml().replace('piece = "piece.toml"\n', "")
    (out / "machine.toml").write_text(toml)
    commands, begins = course(radius, feed, laps)
    rng = np.random.default_rng(seed)
    machines = healthy_and_faulty(tests.values(), rng)
    runs = simulated(commands, machines, seed)
    inside = np.zeros(len(commands), bool)
    for begin in begins:
        first, last = round(begin / drives.kTick), round((begin + TURN * laps * radius / feed) / drives.kTick)
        inside[first:last + 1] = True
    for name, m, series in zip(("healthy", *tests), machines, runs):
        t, read = lengths(m, series, commands, radius, rng)
        rows = np.stack([t[inside], read[inside] * 1e6], axis=1)
        np.savetxt(out / f"{name}.csv", rows, fmt=("%.3f", "%.1f"), delimiter=",", header="time_s,bar_um", comments="")
    (out / "map.toml").write_text(map_toml(begins, radius, feed, laps))


def simulated(commands, machines, seed):
    series = drives.simulate(commands, machine.drives_of(machines), seed)
    return [{k: s[:, :, r].astype(float) for k, s in series.items()} for r in range(len(machines))]


def fault(text):
    key, value = text.split("=")
    place, name, parameter = key.split(".")
    return name, place, {parameter: float(value)}


def merged(faults):
    """Parameters of one effect at one place, together."""
    of = {}
    for name, place, parameters in faults:
        of.setdefault((name, place), {}).update(parameters)
    return [(name, place, parameters) for (name, place), parameters in of.items()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--fault", type=fault, action="append", default=[], help="PLACE.EFFECT.PARAMETER=VALUE")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--laps", type=int, default=1)
    parser.add_argument("--radius", type=float, default=100, help="mm")
    parser.add_argument("--feed", type=float, default=3000, help="mm/min")
    a = parser.parse_args()
    generate(a.out, {"test": merged(a.fault)}, a.seed, a.laps, a.radius * 1e-3, a.feed / 6e4)


if __name__ == "__main__":
    main()
