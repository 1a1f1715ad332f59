#!/usr/bin/env python3
"""Draws machines with what is wrong with them, simulates them and writes what a diagnosis is given.

    generate.py VCNC OUT [--seed N] [--kinds clean=8,single=20,pair=4,triple=2,unknown=8] [--individuals 4]

OUT gets machine.toml (declared), piece.toml, program.ngc, map.toml, reference_I.csv (a healthy recording of
individual I), test_K.csv, and answer_K.json: which reference belongs to it and what was done. The
piece is clamped anew and the thermal state is another one in every recording. The hash of every answer is printed.
"""

import argparse
import pathlib
import subprocess
import sys

import numpy as np

import effects
import files
import machine
import program


def draw_effects(rng, count, names):
    """Different names; each with a place and parameters."""
    out = []
    for name in rng.choice(names, count, replace=False):
        place = str(rng.choice(effects.places_of(name)))
        out.append({"name": str(name), "place": place, "parameters": effects.EFFECTS[name].draw(rng, place)})
    return out


LAW_POINTS = {"table_force": ["table_force", "motor_force"], "displacement": ["displacement", "reading"],
              "reading": ["reading", "displacement"]}


def by_component(values):
    """(key, number or vector) pairs as numbers; a component's key ends in .x, .y or .z."""
    out = {}
    for key, value in values:
        out.update({f"{key}.{c}": v for c, v in zip("xyz", value)} if isinstance(value, list) else {key: value})
    return out


def true_values(found):
    """Numbers of effects whose size is drawn under the key of the library, with the value that key has then."""
    out = []
    for e in found:
        for key, value in e["parameters"].items():
            if key == "share_percent" and e["name"] != "friction_fade":
                continue
            if e["name"] == "windup":
                value += machine.DECLARED["compliance"][machine.AXES.index(e["place"])] * 1e9
            out.append((f"effects.{e['place']}.{e['name']}.{key}", value))
    return by_component(out)


# Name -> key of a linear and of a rotary axis, and what it is called in machine.DECLARED.
DECLARED_KEYS = {
    "coulomb": (("effects.{}.coulomb.level_N", "effects.{}.coulomb.level_Nm"), "coulomb"),
    "viscous": (("effects.{}.viscous.coefficient_Ns_per_m", "effects.{}.viscous.coefficient_Nms_per_rad"), "viscous"),
    "load_mass": (("axes.{}.load_kg", "axes.{}.load_kgm2"), "load"),
}


def size_of(e):
    """How large an effect is, under the name and in the unit of its detection limit."""
    name, place, p = e["name"], e["place"], e["parameters"]
    if name in DECLARED_KEYS:  # a share of what is declared
        keys, declared = DECLARED_KEYS[name]
        i = machine.AXES.index(place)
        return [keys[files.ROTARY[i]].format(place), abs(p["share_percent"]) / 100 * machine.DECLARED[declared][i]]
    if name == "surface_friction":
        return ["probe.surface_friction", abs(p["coefficient"] - machine.SURFACE_FRICTION)]
    value = next(iter(p.values()))
    return [f"{place}.{name}", max(map(abs, value)) if isinstance(value, list) else abs(value)]


# Declared numbers, what goes along in every fit, and what is sought by itself: there is nothing to take out of a library.
NEVER_LEFT_OUT = {"bus_latency", "coulomb", "load_mass", "period_slip", "presliding", "scale_error", "stribeck", "surface_friction",
                  "thermal_drift", "tip_radius", "viscous", "windup"}


def scenarios(rng, counts, individuals, names=None):
    """Single effects go through the library in a drawn order before any comes twice; so do those that the diagnosis is
    not to know of ("without")."""
    names = sorted(names or effects.EFFECTS)
    drawn_from = {"single": names, "without": [n for n in names if n not in NEVER_LEFT_OUT]}
    order = {kind: [] for kind in drawn_from}
    out = []
    for kind, count in counts.items():
        for _ in range(count):
            s = {"kind": kind, "individual": int(rng.integers(individuals)), "effects": []}
            if kind in drawn_from:
                if not drawn_from[kind]:
                    raise SystemExit(f"--effects: {', '.join(names)}: none that can be left out of the library")
                if not order[kind]:
                    order[kind] = list(rng.permutation(drawn_from[kind]))
                s["effects"] = draw_effects(rng, 1, [order[kind].pop()])
            elif kind in ("pair", "triple"):
                s["effects"] = draw_effects(rng, {"pair": 2, "triple": 3}[kind], names)
            s["values"] = true_values(s["effects"])
            s["sizes"] = [size_of(e) for e in s["effects"]]
            if kind == "unknown":
                s["unknown"] = str(rng.choice(sorted(effects.UNKNOWN)))
            out.append(s)
    return out


def generate(vcnc, out, seed, counts, individuals, names=None):
    out.mkdir(parents=True, exist_ok=True)
    (out / "machine.toml").write_text(files.machine_toml())
    (out / "piece.toml").write_text(files.piece_toml())
    text, sections = program.program()
    (out / "program.ngc").write_text(text)
    subprocess.run([vcnc, "plan", str(out / "program.ngc"), "--machine", str(out / "machine.toml"), "--csv",
                    str(out / "plan.csv")], check=True, stdout=subprocess.DEVNULL)
    commands, lines = files.read_plan(out / "plan.csv")
    (out / "map.toml").write_text(files.map_toml(files.laps_of(lines, sections)))

    rng = np.random.default_rng(seed)
    factors = [machine.tolerated(rng) for _ in range(individuals)]
    drawn = scenarios(rng, counts, individuals, names)
    machines = [machine.healthy(f, rng) for f in factors]
    for s in drawn:
        m = machine.healthy(factors[s["individual"]], rng)
        for e in s["effects"]:
            effects.inject(m, e["name"], e["place"], e["parameters"])
        if "unknown" in s:
            s["truth"] = effects.UNKNOWN[s["unknown"]](m, rng)
            s["law_points"] = LAW_POINTS[s["truth"]["hook"]]
            s["law_axes"] = [s["truth"]["axis"]]
        machines.append(m)
    hashes = []
    for k, s in enumerate(drawn):
        s["seed"], s["number"] = seed, k
        s["reference"] = f"reference_{s['individual']}.csv"
        hashes.append(files.write_answer(out / f"answer_{k}.json", s))
        print(f"answer_{k} {hashes[-1]}", flush=True)
    records = machine.record(commands, machines, seed)
    for i, r in enumerate(records):
        name = f"reference_{i}.csv" if i < individuals else f"test_{i - individuals}.csv"
        files.write_table(out / name, r)
    return drawn


def counts_of(text):
    return {k: int(v) for k, v in (item.split("=") for item in text.split(","))}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("vcnc")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", type=counts_of, default=counts_of("clean=8,single=20,pair=4,triple=2,unknown=8"))
    parser.add_argument("--individuals", type=int, default=4)
    parser.add_argument("--effects", type=lambda s: s.split(","), default=None, help="draw from these only")
    a = parser.parse_args()
    generate(a.vcnc, a.out, a.seed, a.kinds, a.individuals, a.effects)


if __name__ == "__main__":
    sys.exit(main())
