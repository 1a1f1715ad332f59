#!/usr/bin/env python3
"""The blind test of `vcnc diagnose`: draws machines with unknown faults, has them diagnosed, grades the answers.

    bench.py VCNC [--parts independent,own] [--seed N] [--kinds clean=8,single=40,...] [--work DIR]
             [--jobs 2] [--markdown FILE] [--bounds NAME]

Part `own`: recordings of the virtual machine itself (vcnc run --inject), against the declared model. Part `measured`: the
same of configs/machines/trunnion_measured.toml, with its play, stick-slip, encoder steps and a probe whose signals are corrected.
Part `independent`: tables of the generator in generator/, which shares no code, friction law, integrator,
loop rates, kinematics or noise with vcnc; differential, the piece clamped anew and the machine at another
thermal state between the healthy run and the test. Part `independent_absolute`: the same without the healthy run,
against the declared model as `vcnc commission` has fitted it to that.

Answer keys are written and their SHA-256 printed before anything is diagnosed. Every run counts. With --bounds
the measured shares must not fall behind those of bounds.toml; exit code 1 if one does.
"""

import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE / "generator")]

import numpy as np

import files
import generate
import grading
import machine
import program

# Leave no trace that repeats (a noise audit's matter) or none behind the logged command (the NC unit's).
NOT_REPEATABLE = {"encoder_quantisation", "bus_loss", "bus_jitter", "frame_vibration", "mains_hum", "adc_noise",
                  "sample_jitter", "dropped_samples"}
BEFORE_THE_COMMAND = {"corner_cutting", "chord_error", "path_filter"}
STOPS_AT_ONCE = {"contact_loss"}  # the NC unit's own check of the readings stops the machine: an alarm, no record of it
TOLERATED = {"windup", "backlash", "coulomb", "stribeck", "viscous", "presliding"}  # declared ones have a tolerance
FOUND_BEFOREHAND = {"period_slip"}  # before anything is fitted: nothing to suspect
SET_UP = {"piece_offset", "piece_tilt"}  # clamped anew for every run: never a finding
S_PIECE = HERE.parents[1] / "configs/pieces/s_eq1.toml"
MEASURED = HERE.parents[1] / "configs/machines/trunnion_measured.toml"
MODEL = "found.toml"  # what a diagnosis calls the machine it found
WHOLE = {"periods", "channel", "delay_cycles", "lobes", "harmonic", "order"}


def run(command):
    """Processor time of a child, user and system; its output on failure."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    output = process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: exit code {process.returncode}\n{output[-2000:]}")
    return used.ru_utime + used.ru_stime


def kept(path, make):
    """A grade; with --work it is kept beside what was found and taken from there again."""
    if path.exists():
        return json.loads(path.read_text())
    row = make()
    path.write_text(json.dumps(row))
    return row


def oracle(vcnc, answer, arguments, out):
    """What a diagnosis leaves that knows which effects there are and fits their numbers alone; nothing where there is
    nothing to fit."""
    suspects = [grading.suspect(e) for e in answer["effects"] if e["name"] not in FOUND_BEFOREHAND]
    if not suspects:
        return {}
    run([vcnc, "diagnose", *arguments, *(word for s in suspects for word in ("--suspect", s)), "--out", str(out)])
    known = json.loads((out / "diagnosis.json").read_text())
    shutil.rmtree(out)
    return {"oracle": grading.left_of(known)}


def diagnose(vcnc, answer, arguments, out):
    try:
        seconds = run([vcnc, "diagnose", *arguments, "--out", str(out)])
    except RuntimeError as error:
        return {"kind": answer["kind"], "truth": [grading.label(e) for e in answer["effects"]] or [answer.get("unknown", "")],
                "number": answer.get("number"), "failed": str(error)}
    report = json.loads((out / "diagnosis.json").read_text())
    if report["laws"]:
        laws = tomllib.loads((out / MODEL).read_text())["effects"]["law"]
        for told, law in zip(report["laws"], (l for l in laws if l.get("label", "").startswith("learned"))):
            told.update(law)
    row = grading.grade(answer, report, seconds)
    if row.get("top") or row["kind"] == "without":
        # An effect that was left out of the library is there for who knows it.
        known = [a for i, a in enumerate(arguments) if "--without" not in arguments[max(0, i - 1):i + 1]]
        row |= oracle(vcnc, answer, known, out.with_name(out.name + "_oracle"))
    return row


# --- the virtual machine as the generator -------------------------------------------------------------

def library(vcnc):
    text = subprocess.run([vcnc, "effects", "--json"], check=True, capture_output=True, text=True).stdout
    return {e["name"]: e for e in json.loads(text)["effects"]}


def own_machine():
    noise = "".join(f"[effects.{a}.encoder_quantisation]\nquantum_{'arcsec' if r else 'nm'} = {0.02 if r else 20}\n"
                    for a, r in zip(machine.AXES, files.ROTARY))
    return files.machine_toml() + noise + "[effects.probe.adc_noise]\nnoise_mV = 5\n"


def measured_machine():
    """As it is shipped, but for the piece and where it lies."""
    ours = files.machine_toml()
    begin, end = ours.index("[setup]"), ours.index("\n[", ours.index("[setup]"))
    text = MEASURED.read_text()
    old = text.index("[setup]")
    return text[:old] + ours[begin:end] + text[text.index("\n[", old):]


OWN = {"own": own_machine, "measured": measured_machine}


def declared_number(declared, key):
    values = declared
    for part in key.split("."):
        values = values[part] if isinstance(values, dict) and part in values else None
    return values


def draw_own(rng, entry, declared):
    """An effect of the library at one of its places, sizes within a factor of three about the typical one."""
    place = entry["places"][rng.integers(len(entry["places"]))]
    factor, sign = 3 ** rng.uniform(-1, 1), rng.choice([-1.0, 1.0])
    parameters, assignments, size = {}, [], None
    for p in place["parameters"]:
        short, nominal, default = p["key"].rsplit(".", 1)[1], p["nominal"], p["default"]
        held = declared_number(declared, p["key"])
        if held is not None:
            value = (np.asarray(held) * (1 + sign * min(0.4 * factor / 3, 0.6))).tolist() if not parameters else held
            if not parameters:  # of a declared number its change counts, against its tolerance where it has one
                change = float(np.abs(np.subtract(value, held)).flat[0])
                size = (p["key"] if entry["name"] in TOLERATED else f"{place['place']}.{entry['name']}", change)
        elif short.startswith("phase"):
            value = float(rng.uniform(-180, 180))
        elif short == "start_s":
            value = float(rng.uniform(10, 40))  # the program ends after 44
        elif short in WHOLE or not np.any(nominal):
            value = nominal
        elif np.any(default):
            value = nominal
        else:
            signed = p["min"] < 0
            value = [v * factor * (rng.choice([-1.0, 1.0]) if signed else 1) for v in nominal] if isinstance(
                nominal, list) else nominal * factor * (sign if signed else 1)
            value = np.clip(value, p["min"], p["max"]).tolist()
        parameters[short] = value
        assignments.append((p["key"], value))
    effect = {"name": entry["name"], "place": place["place"], "parameters": parameters}
    return effect, assignments, size or (f"{place['place']}.{entry['name']}", grading.first_number(effect))


def set_up(rng, declared):
    """Tolerances of an individual and how the piece is clamped, as assignments."""
    out = [("effects.setup.piece_offset.shift_um", (5 * rng.standard_normal(3)).tolist()),
           ("effects.setup.piece_tilt.tilt_urad", (20 * rng.standard_normal(3)).tolist())]
    for axis, rotary in zip(machine.AXES, files.ROTARY):
        for key, tolerance in ((f"axes.{axis}.load_{'kgm2' if rotary else 'kg'}", 0.01),
                               (f"effects.{axis}.coulomb.level_{'Nm' if rotary else 'N'}", 0.03),
                               (f"effects.{axis}.viscous.coefficient_{'Nms_per_rad' if rotary else 'Ns_per_m'}", 0.05)):
            out.append((key, declared_number(declared, key) * (1 + tolerance * rng.standard_normal())))
    return out


def leave_out(s, entries):
    """The diagnosis is not to know of the effect of a scenario, and is to tell a law that acts where it does."""
    effect = s["effects"][0]
    s["without"] = effect["name"]
    s["law_points"] = list(grading.HOOKS.get(entries[effect["name"]]["port"], ()))
    s["law_axes"] = [effect["place"]] if effect["place"] in machine.AXES else list(machine.AXES)


def own_scenarios(rng, counts, entries, declared):
    names = sorted(set(entries) - NOT_REPEATABLE - BEFORE_THE_COMMAND - STOPS_AT_ONCE - SET_UP)
    order, out = [], []
    for kind, count in counts.items():
        if kind == "unknown":
            continue
        for _ in range(count):
            number = {"clean": 0, "single": 1, "pair": 2, "triple": 3, "without": 1}[kind]
            chosen = []
            while len(chosen) < number:
                if not order:
                    order = list(rng.permutation(names))
                name = order.pop() if number == 1 else str(rng.choice(names))
                if name not in chosen and not (kind == "without" and name in generate.NEVER_LEFT_OUT):
                    chosen.append(name)
            s = {"kind": kind, "effects": [], "values": {}, "sizes": [], "number": len(out)}
            assignments = dict(set_up(rng, declared))
            for name in chosen:
                effect, values, size = draw_own(rng, entries[name], declared)
                s["effects"].append(effect)
                s["sizes"].append(size)
                assignments.update(values)
                s["values"].update(generate.by_component(values))
            if kind == "without":
                leave_out(s, entries)
            s["assignments"] = assignments
            out.append(s)
    return out


def text_of(value):
    return "[" + ", ".join(f"{v:.9g}" for v in value) + "]" if isinstance(value, list) else f"{value:.9g}"


def own_run(vcnc, work, s, per_shift):
    """One machine: run, diagnosed, graded, and what was found held against another piece."""
    folder = work / f"own_{s['number']}"
    command = [vcnc, "run", str(work / "program.ngc"), "--machine", str(work / "own.toml"), "--in-process", "--no-report",
               "--seed", str(s["number"] + 1), "--out", str(folder)]
    for key, value in s["assignments"].items():
        command += ["--inject", f"{key.removeprefix('effects.')}={text_of(value)}"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        return {"kind": s["kind"], "truth": [grading.label(e) for e in s["effects"]], "number": s["number"], "failed": done.stderr[-600:]}
    extra = ["--without", s["without"]] if "without" in s else []
    row = diagnose(vcnc, s, [str(folder), "--model", str(work / "own.toml"), *extra], work / f"own_{s['number']}_found")
    shutil.rmtree(folder)
    return row | transfer(vcnc, work, s, row, per_shift)


def own_part(vcnc, work, seed, counts, jobs, declared):
    write_inputs(work)
    (work / "own.toml").write_text(declared)
    subprocess.run([vcnc, "program", "s-piece", "--machine", str(work / "own.toml"), "--set", f"setup.piece={S_PIECE}",
                    "--feed-mm-min", "2000", "--out", str(work / "s.ngc")], check=True, capture_output=True)
    drawn = own_scenarios(np.random.default_rng(seed), counts, library(vcnc), tomllib.loads(declared))
    for s in drawn:
        number = s["number"]
        print(f"own answer_{number} {files.write_answer(work / f'own_answer_{number}.json', s)}", flush=True)
    per_shift = readings_per_shift(vcnc, work)
    return pooled(jobs, lambda s: kept(work / f"own_{s['number']}_found.json", lambda: own_run(vcnc, work, s, per_shift)), drawn)


def contour_readings(vcnc, work, name, machine_file, assignments):
    """Size of the probe's deflection [m] in every tick of the S piece's lap; NaN off the piece."""
    folder = work / name
    command = [vcnc, "run", str(work / "s.ngc"), "--machine", str(machine_file), "--set", f"setup.piece={S_PIECE}",
               "--in-process", "--no-report", "--csv", "--out", str(folder)]
    for key, value in assignments.items():
        command += ["--inject", f"{key.removeprefix('effects.')}={text_of(value)}"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    path = folder / "rows.csv"
    with open(path, encoding="ascii") as file:
        head = [h.split(" ")[0] for h in file.readline().strip().split(",")]
    rows = np.loadtxt(path, delimiter=",", skiprows=1, usecols=[head.index(f"deflection.{c}") for c in "xyz"])
    shutil.rmtree(folder)
    size = np.linalg.norm(rows, axis=1)
    return np.where(size > 0.3e-3, size, np.nan)


QUIET = {"effects.probe.adc_noise.noise_mV": 0} | {
    f"effects.{axis}.encoder_quantisation.quantum_{'arcsec' if rotary else 'nm'}": 0
    for axis, rotary in zip(machine.AXES, files.ROTARY)}


def clamped_at(shift_um):
    return {"effects.setup.piece_offset.shift_um": shift_um, "effects.setup.piece_tilt.tilt_urad": [0.0, 0.0, 0.0]}


def readings_per_shift(vcnc, work):
    """What the reading on the S piece changes by per micrometre that it is clamped elsewhere in x, y and z; (ticks, 3)."""
    at = [contour_readings(vcnc, work, f"clamped_{i}", work / "own.toml", clamped_at([10.0 * (i == j) for j in range(3)]) | QUIET)
          for i in range(4)]
    n = min(map(len, at))
    return np.stack([(a[:n] - at[3][:n]) / 10 for a in at[:3]], axis=1)


def left_where_clamped_best(difference, per_shift):
    """RMS of a difference of readings once a shift of the piece has been fitted, as whoever clamps it anew does."""
    n = min(len(difference), len(per_shift))
    known = np.isfinite(difference[:n]) & np.all(np.isfinite(per_shift[:n]), axis=1)
    d, c = difference[:n][known], per_shift[:n][known]
    return float(np.sqrt(np.mean((d - c @ np.linalg.lstsq(c, d, rcond=None)[0]) ** 2)))


def transfer(vcnc, work, s, row, per_shift):
    """What the declared model and the one found on circles and lines leave of the readings on the S piece [um], both
    against the true machine; of strong single effects that were named, and of clean machines: those show what noise leaves."""
    named = s["kind"] == "single" and row.get("strength", 0) >= 3 and row.get("top")
    if "failed" in row or not (named or s["kind"] == "clean"):
        return {}
    if any(e["name"] == "period_slip" for e in s["effects"]):
        return {}
    truth = {k: v for k, v in s["assignments"].items() if not k.startswith("effects.setup.")}
    name = f"transfer_{s['number']}"
    true = contour_readings(vcnc, work, name, work / "own.toml", truth | QUIET)
    left = []
    for model in (work / "own.toml", work / f"own_{s['number']}_found" / MODEL):
        other = contour_readings(vcnc, work, name, model, clamped_at([0.0, 0.0, 0.0]) | QUIET)
        n = min(len(true), len(other))
        left.append(1e6 * left_where_clamped_best(true[:n] - other[:n], per_shift))
    return {"transfer_um": left}


# --- the independent generator ------------------------------------------------------------------------

def write_inputs(work):
    work.mkdir(parents=True, exist_ok=True)
    (work / "machine.toml").write_text(files.machine_toml())
    (work / "piece.toml").write_text(files.piece_toml())
    (work / "program.ngc").write_text(program.program()[0])


def commissioned(work, reference):
    """The declared model as fitted to a healthy run."""
    return (work / reference).with_suffix(".toml")


def commission(vcnc, work, reference):
    out = commissioned(work, reference)
    if not out.exists():
        run([vcnc, "commission", str(work / reference), "--map", str(work / "map.toml"), "--model", str(work / "machine.toml"),
             "--out", str(out)])


def independent_run(vcnc, work, s, absolute):
    model = commissioned(work, s["reference"]) if absolute else work / "machine.toml"
    arguments = [str(work / f"test_{s['number']}.csv"), "--map", str(work / "map.toml"), "--model", str(model)]
    if not absolute:
        arguments += ["--reference", str(work / s["reference"])]
    if "without" in s:
        arguments += ["--without", s["without"]]
    out = work / f"{'absolute' if absolute else 'found'}_{s['number']}"
    return kept(out.with_suffix(".json"), lambda: diagnose(vcnc, s, arguments, out))


def independent_part(vcnc, work, seed, counts, jobs, individuals, absolute=False, numbers=None):
    if (work / "answer_0.json").exists():  # drawn before, with its hashes
        drawn = [json.loads(p.read_text()) for p in sorted(work.glob("answer_*.json"))]
    else:
        drawn = generate.generate(vcnc, work, seed, counts, individuals)
    drawn = [s for s in drawn if numbers is None or s["number"] in numbers]
    entries = library(vcnc)
    for s in drawn:
        if s["kind"] == "without":
            leave_out(s, entries)
    if absolute:
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            list(pool.map(lambda reference: commission(vcnc, work, reference), sorted({s["reference"] for s in drawn})))
    return pooled(jobs, lambda s: independent_run(vcnc, work, s, absolute), sorted(drawn, key=lambda s: s["number"]))


def shuffled(work, s, rng):
    """The control: what the test differs from its reference, lap by lap, goes to laps of other conditions; lengths are
    made equal by repetition. What an axis differs by while it stands is not compared where it comes from, so it does not
    go where the axis moves. Whatever is found then is an error of the diagnosis."""
    laps = tomllib.loads((work / "map.toml").read_text())["laps"]
    with open(work / s["reference"], encoding="ascii") as file:
        head = file.readline()
    reference = np.loadtxt(work / s["reference"], delimiter=",", skiprows=1)
    test = np.loadtxt(work / f"test_{s['number']}.csv", delimiter=",", skiprows=1)
    rest, out = test - reference, reference.copy()
    columns = head.strip().split(",")
    for axis in machine.AXES:
        command = next(i for i, c in enumerate(columns) if c.startswith(f"{axis}_command_"))
        moves = np.abs(np.gradient(test[:, command])) > 1e-7
        stands = np.convolve(moves, np.ones(51), "same") == 0
        for i, c in enumerate(columns):
            if c.startswith(f"{axis}_"):
                rest[stands, i] = 0
    spans = [(round(l["from_s"] * 1000), round(l["to_s"] * 1000)) for l in laps]
    while True:
        order = rng.permutation(len(laps))
        if all(laps[i]["condition"] != laps[j]["condition"] for i, j in enumerate(order)):
            break
    for (begin, end), j in zip(spans, order):
        out[begin:end] += np.resize(rest[spans[j][0]:spans[j][1]], (end - begin, rest.shape[1]))
    out[:, 0] = test[:, 0]
    for i, name in enumerate(columns):
        if "_command_" in name:
            out[:, i] = test[:, i]
    name = work / f"shuffled_{s['number']}.csv"
    with open(name, "w", encoding="ascii") as file:
        file.write(head)
        np.savetxt(file, out, fmt="%.9f", delimiter=",")
    return name


def shuffled_part(vcnc, work, seed, jobs, count=6):
    """Of the independent part's first tests that have an effect."""
    drawn = sorted((json.loads(p.read_text()) for p in work.glob("answer_*.json")), key=lambda s: s["number"])
    drawn = [s for s in drawn if s["kind"] == "single"][:count]
    rng = np.random.default_rng(seed)

    def one(s):
        arguments = [str(shuffled(work, s, rng)), "--map", str(work / "map.toml"), "--model", str(work / "machine.toml"),
                     "--reference", str(work / s["reference"])]
        out = work / f"shuffled_{s['number']}"
        return kept(out.with_suffix(".json"),
                    lambda: diagnose(vcnc, {"kind": "clean", "effects": [], "number": s["number"]}, arguments, out))
    return pooled(jobs, one, drawn)


def pooled(jobs, work, items):
    """The children do the work; a line for each as it ends."""
    rows = []
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for row in pool.map(work, items):
            rows.append(row)
            if "failed" in row:
                print(f"  {row['number']:>3} {row['kind']:<8} {', '.join(row['truth'])}: FAILED {row['failed'][-300:]}", flush=True)
                continue
            mark = ("+" if row.get("exact") or (row["kind"] == "clean" and not row["claims"]) or row.get("law_right") else
                    "~" if row.get("top") or row.get("rejected") else "-")
            print(f"  {mark} {row['number']:>3} {row['kind']:<8} {', '.join(row['truth']) or '-':<40} {row['verdict']:<14}"
                  f" {', '.join(row['told']) or '-'}  {row['law']}  {row['seconds']:.1f} s", flush=True)
    return rows


# --- report -------------------------------------------------------------------------------------------

HEAD = """# Blind test of the diagnosis

Written by `tests/diagnosis/bench.py build/release/bin/vcnc --seed SEED --kinds ... --markdown docs/diagnosis_bench.md`. Answer keys
are written, and their SHA-256 printed, before anything is diagnosed; every run counts, none is left out.

* **independent**: machines of `tests/diagnosis/generator/`, which shares nothing with vcnc but the commands: Maxwell-slip friction
  (vcnc: LuGre bristles), velocity loop at 8 kHz on filtered differences, position loop at 2 kHz, two-stage current lag, semi-implicit
  Euler at 16 kHz, screw exponentials, quasi-static contact, own noise (20 nm, 10 N, 0.15 um). Differential: a healthy run and a
  test of one individual, whose masses and friction are off by their tolerances (mass 1 %, friction 3 to 10 %); between the two the
  piece is clamped anew (5 um, 20 urad) and the thermal state changes (friction 1 to 3 %, scales 1 ppm, drift 0.1 um/min).
* **independent_absolute**: the same tests without the healthy run, against the declared model as `vcnc commission` has fitted it to that.
* **own**: the virtual machine itself as the generator (`vcnc run --inject`), against the declared model: an easy setting, since
  friction law and controller are the diagnosis' own.
* **measured**: the same of the machine `configs/machines/trunnion_measured.toml` as it is shipped: play, stick-slip, encoder steps of 10 nm, and a
  probe with hysteresis and signals that are corrected while it measures.
* *left out*, in either part: the effect is injected and taken out of the library (`vcnc diagnose --without`).
* **shuffled**: what the first single tests differ from their reference, lap by lap, moved to laps of other conditions. Nothing may be found.

The program is 44 s: circles of 15 mm at F3000 and F6000 in both senses in a ring gauge, circles while C or A turns, strokes of Z;
everything twice. The ring stands 72 mm off the C axis, so that an error of its angle moves the ring. The ball never comes to rest on the piece but at the ends of a stroke: what the drag of friction does to a ball at
rest is a matter of nanometres of motion, and the two models need not agree on it. The declared suspension of the probe is light, as the
generator's contact is quasi-static. L is the detection limit that the diagnosis states itself: five standard
deviations, and what a gain and a consequence must reach to be told beside what the model gets wrong about the healthy machine. Sizes
are drawn log-uniformly within a factor of three about a typical one, so that some lie below L, where silence is right. Noise effects, the set-up, what happens before
the logged command and what stops the machine at once are not injected as findings.

## The generator itself

Checked against closed forms (`tests/diagnosis/generator/generator_test.py`: following error of a ramp, radius of a circle, friction
level, virgin curve of the Maxwell elements, resonance of two masses, opening of a gap, delay; a published vector of the
kinematics, axis errors against their vector formulas; Heydemann's errors of the signals). Against `vcnc run` of the same declared
machine on the same commands, first 22 s of an earlier program with circles of 30 mm:

| signal | rms in vcnc | rms in the generator | rms of the difference |
|---|---|---|---|
| following error X | 24.1 um | 24.1 um | 0.74 um |
| following error Y | 35.1 um | 35.2 um | 0.95 um |
| following error Z | 0.86 um | 0.75 um | 0.13 um |
| load less motor X | 2.05 um | 2.07 um | 0.13 um |
| force X | 687 N | 686 N | 23 N, of which 10 N are noise |
| force Y | 888 N | 885 N | 21 N, of which 10 N are noise |

So signs, units and instants agree, and what another friction law and controller make is some percent of the following error.
"""


def markdown(parts, seeds):
    lines = [HEAD]
    for part, rows in parts.items():
        good = [r for r in rows if "failed" not in r]
        lines += [f"## {part}", "", f"Seed {seeds}, {len(rows)} runs, {len(rows) - len(good)} of them ended in an error.", "",
                  "| measure | result |", "|---|---|"]
        lines += [f"| {k} | {v} |" for k, v in grading.summary(good).items()] if good else []
        lines += ["", "Every run:", "", "| | kind | truth | size / L | verdict | told |", "|---|---|---|---|---|---|"]
        for r in rows:
            if "failed" in r:
                lines.append(f"| {r['number']} | {r['kind']} | {', '.join(r['truth'])} | | error | |")
                continue
            strength = f"{r['strength']:.1f}" if math.isfinite(r.get("strength", math.nan)) else ""
            lines.append(f"| {r['number']} | {r['kind']} | {', '.join(r['truth'])} | {strength} | {r['verdict']} | "
                         f"{', '.join(r['told'])}{'; ' + r['law'] if r['law'] else ''} |")
        lines.append("")
    return "\n".join(lines)


def check_bounds(name, part, rows):
    """What fell behind."""
    bounds = tomllib.loads((HERE / "bounds.toml").read_text()).get(name, {}).get(part, {})
    measured = grading.summary([r for r in rows if "failed" not in r])
    out = [f"{part}: {r['number']} failed: {r['failed'][-200:]}" for r in rows if "failed" in r]
    if not bounds:
        return out + [f"{part}: bounds.toml has no [{name}.{part}]"]
    for measure, bound in bounds.items():
        value = grading.number_of(measured[measure])
        if value is None or value < bound.get("least", 0) or value > bound.get("most", 1):
            out.append(f"{part}: {measure}: {measured[measure]}, allowed {bound}")
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("vcnc")
    parser.add_argument("--parts", type=lambda s: s.split(","), default=["independent", "own"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", type=generate.counts_of,
                        default=generate.counts_of("clean=24,single=60,pair=12,triple=4,unknown=12,without=20"))
    parser.add_argument("--individuals", type=int, default=4)
    parser.add_argument("--work", type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--numbers", type=lambda s: {int(n) for n in s.split(",")}, help="of the independent part, these runs only")
    parser.add_argument("--markdown", type=pathlib.Path)
    parser.add_argument("--bounds")
    a = parser.parse_args()
    work = a.work or pathlib.Path(tempfile.mkdtemp(prefix="diagnosis_bench_"))
    parts = {}
    for part in a.parts:
        print(f"== {part}", flush=True)
        folder = work / part.split("_")[0]
        if part in OWN:
            parts[part] = own_part(a.vcnc, folder, a.seed, a.kinds, a.jobs, OWN[part]())
        elif part in ("independent", "independent_absolute"):
            parts[part] = independent_part(a.vcnc, folder, a.seed, a.kinds, a.jobs, a.individuals, part.endswith("absolute"),
                                           a.numbers)
        elif part == "shuffled":
            parts[part] = shuffled_part(a.vcnc, work / "independent", a.seed, 1)
        else:
            sys.exit(f"unknown part {part}: {', '.join(OWN)}, independent, independent_absolute, shuffled")
        good = [r for r in parts[part] if "failed" not in r]
        for k, v in (grading.summary(good) if good else {}).items():
            print(f"  {k}: {v}")
    if a.markdown:
        a.markdown.write_text(markdown(parts, a.seed))
    if a.work is None:
        shutil.rmtree(work)
    behind = [text for part, rows in parts.items() for text in check_bounds(a.bounds, part, rows)] if a.bounds else []
    for text in behind:
        print(text, file=sys.stderr)
    return 1 if behind else 0


if __name__ == "__main__":
    sys.exit(main())
