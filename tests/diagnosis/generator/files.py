"""What the generator writes: declared machine, piece, program, tables with their map, answer keys."""

import hashlib
import json

import numpy as np

from machine import AXES, DECLARED, PIECE, RING_RADIUS, SURFACE_FRICTION, TURN

DEGREE = np.pi / 180
ROTARY = (False, False, False, True, True)
TRAVEL = [(-400, 400), (-400, 400), (-100, 600), (-120, 120), (-3600, 3600)]


def machine_toml():
    d = DECLARED
    out = ['name = "bench trunnion"', "", "[kinematics]", 'type = "trunnion"', ""]
    for i, axis in enumerate(AXES):
        unit, kg, f = ("deg", "kgm2", "torque_limit_Nm") if ROTARY[i] else ("mm", "kg", "force_limit_N")
        turn = d["travel_per_turn"][i] / (DEGREE if ROTARY[i] else 1e-3)
        limits = (200, 2000, 20000) if ROTARY[i] else (500, 5000, 50000)
        out += [f"[axes.{axis}]", f"min_{unit} = {TRAVEL[i][0]}", f"max_{unit} = {TRAVEL[i][1]}"]
        if axis == "Z":
            out.append("start_mm = 450")
        out += [f"velocity_{unit}_s = {limits[0]}", f"acceleration_{unit}_s2 = {limits[1]}",
                f"jerk_{unit}_s3 = {limits[2]}", f"kv_per_s = {d['kv'][i]}",
                f"velocity_bandwidth_Hz = {d['bandwidth'][i]}", f"integral_time_ms = {d['ti'][i] * 1e3:g}",
                f"velocity_ff = {d['velocity_ff'][i]}", f"acceleration_ff = {d['acceleration_ff'][i]}",
                f"current_lag_us = {d['current_lag'][i] * 1e6:g}",
                f'feedback = "{"motor" if d["motor_feedback"][i] else "load"}"',
                f"load_{kg} = {d['load'][i]}", f"motor_inertia_kgm2 = {d['motor_inertia'][i]}",
                f"travel_per_turn_{unit} = {turn:.12g}", f"{f} = {d['force_limit'][i]}", ""]
    # The contact is quasi-static: a light suspension.
    out += ["[probe]", "moving_mass_g = 1", "stylus_mass_g = 0.1", "", "[setup]", 'piece = "piece.toml"', f"g54_mm = [{', '.join(f'{p * 1e3:g}' for p in PIECE)}]", ""]
    for i, axis in enumerate(AXES):
        e = f"[effects.{axis}."
        if d["compliance"][i]:
            out += [e + "windup]", f"compliance_nm_per_N = {d['compliance'][i] * 1e9:g}",
                    f"damping_ratio = {d['damping_ratio'][i]:g}"]
        if ROTARY[i]:
            out += [e + "coulomb]", f"level_Nm = {d['coulomb'][i]}", e + "stribeck]",
                    f"excess_Nm = {d['stribeck'][i]}",
                    f"velocity_deg_s = {d['stribeck_velocity'][i] / DEGREE:.9g}",
                    e + "viscous]", f"coefficient_Nms_per_rad = {d['viscous'][i]}",
                    e + "presliding]", f"stiffness_Nm_per_rad = {d['bristle'][i]:g}", "damping_Nms_per_rad = 50"]
        else:
            out += [e + "coulomb]", f"level_N = {d['coulomb'][i]}", e + "stribeck]",
                    f"excess_N = {d['stribeck'][i]}", f"velocity_mm_s = {d['stribeck_velocity'][i] * 1e3:g}",
                    e + "viscous]", f"coefficient_Ns_per_m = {d['viscous'][i]}",
                    e + "presliding]", f"stiffness_N_per_um = {d['bristle'][i] * 1e-6:g}", "damping_Ns_per_m = 15000"]
    out += ["[effects.probe.surface_friction]", f"coefficient = {SURFACE_FRICTION}"]
    return "\n".join(out) + "\n"


def piece_toml():
    return f'name = "ring gauge"\nkind = "ring"\nradius_mm = {RING_RADIUS * 1e3:g}\n'


def columns():
    """(heading, kind, axis, unit, factor from SI, decimals) of the table, without the time."""
    out = []
    for i, axis in enumerate(AXES):
        unit, force = ("deg", "Nm") if ROTARY[i] else ("mm", "N")
        factor = 1 / DEGREE if ROTARY[i] else 1e3
        out += [(f"{axis}_command_{unit}", "command", axis, unit, factor, 9),
                (f"{axis}_position_{unit}", "position", axis, unit, factor, 9)]
        if DECLARED["compliance"][i]:
            out.append((f"{axis}_twist_um", "twist", axis, "um", 1e6, 4))
        out.append((f"{axis}_force_{force}", "force", axis, force, 1.0, 3))
    out += [(f"probe_{c}_um", "deflection", c, "um", 1e6, 4) for c in "xyz"]
    return out


def map_toml(laps):
    out = ['machine = "machine.toml"', "", "[time]", 'column = "time_s"', 'unit = "s"', ""]
    for heading, kind, axis, unit, _, _ in columns():
        out += ["[[signals]]", f'column = "{heading}"', f'kind = "{kind}"', f'axis = "{axis}"', f'unit = "{unit}"', ""]
    for begin, end, condition in laps:
        out += ["[[laps]]", f"from_s = {begin:.3f}", f"to_s = {end:.3f}", f'condition = "{condition}"', ""]
    return "\n".join(out)


def write_table(path, recorded):
    series, formats = [recorded["time"]], ["%.3f"]
    for _, kind, axis, _, factor, decimals in columns():
        i = "xyz".index(axis) if kind == "deflection" else AXES.index(axis)
        series.append(recorded[kind][:, i] * factor)
        formats.append(f"%.{decimals}f")
    rows = np.stack(series, axis=1)
    line, chunk = ",".join(formats) + "\n", 2000
    with open(path, "w", encoding="ascii") as file:
        file.write(",".join(["time_s"] + [c[0] for c in columns()]) + "\n")
        for k in range(0, len(rows), chunk):
            part = rows[k:k + chunk]
            file.write(line * len(part) % tuple(part.ravel().tolist()))


def read_plan(path):
    """Commands (ticks, 5) SI and the program line of every tick, from `vcnc plan --csv`."""
    table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(1, 2, 3, 4, 5, 10))
    return table[:, :5] * np.array([1e-3] * 3 + [DEGREE] * 2), table[:, 5].astype(int)


def laps_of(lines, sections, settle=50):
    """Times of the sections; each ends so long after its last set-point."""
    out = []
    for first, last, condition in sections:
        at = np.flatnonzero((lines >= first) & (lines <= last))
        out.append((at[0] * 1e-3, (at[-1] + settle) * 1e-3, condition))
    return out


def write_answer(path, answer):
    """Returns the SHA-256 that is told before anything is diagnosed."""
    text = json.dumps(answer, indent=1, sort_keys=True)
    path.write_text(text)
    return hashlib.sha256(text.encode()).hexdigest()
