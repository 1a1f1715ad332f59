"""One machine of the generator: what is declared of it, what it really is, and its recording."""

import copy

import numpy as np

import drives as drive_model
import kinematics
import probe as probe_model

AXES = "XYZAC"
TURN = 2 * np.pi

# What the machine file says, per axis X Y Z A C, SI.
DECLARED = {
    "kv": [40.0, 40.0, 40.0, 38.0, 38.0],
    "bandwidth": [80.0] * 5,  # of the velocity loop [Hz]
    "ti": [0.010] * 5,
    "velocity_ff": [0.98, 0.97, 0.98, 0.98, 0.98],
    "acceleration_ff": [0.9, 0.9, 0.9, 1.0, 1.0],
    "current_lag": [3e-4] * 5,
    "load": [500.0, 450.0, 350.0, 4.0, 2.0],
    "motor_inertia": [0.01, 0.01, 0.01, 0.5, 0.5],
    "travel_per_turn": [0.012, 0.012, 0.012, TURN, TURN],
    "force_limit": [40000.0, 40000.0, 40000.0, 500.0, 500.0],
    "motor_feedback": [1.0, 1.0, 1.0, 0.0, 0.0],
    "compliance": [6.7e-9, 6.7e-9, 6.7e-9, 0.0, 0.0],
    "damping_ratio": [0.05] * 5,
    "coulomb": [250.0, 220.0, 150.0, 6.0, 3.0],
    "stribeck": [100.0, 80.0, 30.0, 2.0, 1.0],
    "stribeck_velocity": [0.002, 0.002, 0.002, 0.02, 0.02],
    "viscous": [1000.0, 900.0, 700.0, 3.0, 2.0],
    "bristle": [25e6, 25e6, 25e6, 1e5, 1e5],
}
SURFACE_FRICTION = 0.1
RING_RADIUS = 17.5e-3
PIECE = np.array([0.06, 0.04, 0.05])  # off the C axis: an error of its angle moves the ring

# Standard deviations of the truth about the declaration, as shares.
TOLERANCE = {"load": 0.01, "coulomb": 0.03, "viscous": 0.05, "stribeck": 0.05, "compliance": 0.02,
             "bristle": 0.10}

POSITION_NOISE = np.array([20e-9, 20e-9, 20e-9, 1e-7, 1e-7])
FORCE_NOISE = np.array([10.0, 10.0, 10.0, 0.1, 0.1])


def total_inertia(d):
    """Load and motor with the screw, on the load side."""
    return [d["load"][i] + d["motor_inertia"][i] * (TURN / d["travel_per_turn"][i]) ** 2 for i in range(5)]


class Machine:
    """Truth of one machine in one recording. `axis` holds numbers per axis; the lists hold functions."""

    def __init__(self):
        d = copy.deepcopy(DECLARED)
        total = total_inertia(d)
        self.axis = {
            "kv": d["kv"], "ti": d["ti"], "velocity_ff": d["velocity_ff"],
            "acceleration_ff": d["acceleration_ff"],
            "kp": [TURN * d["bandwidth"][i] * total[i] for i in range(5)],
            "inertia_ff": list(total),
            "lag_1": [2 / 3 * lag for lag in d["current_lag"]],
            "lag_2": [1 / 3 * lag for lag in d["current_lag"]],
            "force_limit": d["force_limit"], "load": d["load"],
            "motor": [total[i] - d["load"][i] for i in range(5)],
            "compliance": d["compliance"], "damping_ratio": d["damping_ratio"],
            "coulomb": d["coulomb"], "stribeck": d["stribeck"],
            "stribeck_velocity": d["stribeck_velocity"], "viscous": d["viscous"],
            "bristle": d["bristle"], "motor_feedback": d["motor_feedback"],
        }
        for name, value in drive_model.NAMES.items():
            self.axis.setdefault(name, [value] * 5)
        self.axis["loop_noise"] = [1e-9, 1e-9, 1e-9, 5e-9, 5e-9]
        self.friction_factor = []  # (axis, f(t, x, v))
        self.load_force = []  # (axis, f(t, x, v))
        self.command = {}  # axis -> f(series)
        self.displacement = []  # (axis, f(t, q, v, a, force)): along the axis
        self.pose = []  # f(t, q, v, a) -> (n, 3): of the tip in the machine
        self.geometry = kinematics.Geometry()
        self.geometry.piece = PIECE.copy()
        self.probe = probe_model.Probe()
        self.probe.friction = SURFACE_FRICTION
        self.piece = probe_model.Ring(RING_RADIUS)

    def scale(self, name, axis, factor):
        self.axis[name][axis] *= factor


def tolerated(rng):
    """Factors of one individual machine; the same in all its recordings."""
    return {name: 1 + sigma * rng.standard_normal(5) for name, sigma in TOLERANCE.items()}


def healthy(factors, rng):
    """A recording of that machine: its piece clamped anew, another thermal state."""
    m = Machine()
    for name, factor in factors.items():
        for i in range(5):
            m.scale(name, i, max(factor[i], 0.1))
    for i in range(5):  # grease by temperature
        m.scale("viscous", i, 1 + 0.03 * rng.standard_normal())
        m.scale("coulomb", i, 1 + 0.01 * rng.standard_normal())
    m.geometry.piece = m.geometry.piece + 5e-6 * rng.standard_normal(3)
    m.geometry.piece_turn = 20e-6 * rng.standard_normal(3)
    m.piece = probe_model.Ring(RING_RADIUS + 1e-6 * rng.standard_normal())
    for i in range(3):
        expansion = 1e-6 * rng.standard_normal()
        drift = 0.1e-6 / 60 * rng.standard_normal()
        m.displacement.append((i, lambda t, q, v, a, f, e=expansion, d=drift: e * q + d * t))
    return m


def drives_of(machines):
    """Their drives, side by side."""
    d = drive_model.Drives(len(machines))
    for r, m in enumerate(machines):
        for name in drive_model.NAMES:
            if name in ("stiffness", "damping"):
                continue
            getattr(d, name)[:, r] = m.axis[name]
        for i in range(5):
            c = m.axis["compliance"][i]
            if m.axis["gap"][i] > 0 and c == 0:
                c = 1e-9 if i < 3 else 1e-7
            if c > 0:
                load, motor = m.axis["load"][i], m.axis["motor"][i]
                reduced = load * motor / (load + motor)
                d.stiffness[i, r] = 1 / c
                d.damping[i, r] = 2 * m.axis["damping_ratio"][i] * np.sqrt(reduced / c)
        d.friction_factor += [(axis, r, f) for axis, f in m.friction_factor]
        d.load_force += [(axis, r, f) for axis, f in m.load_force]
        d.command.update({(axis, r): f for axis, f in m.command.items()})
    return d


def record(commands, machines, seed):
    """Simulates machines on one program. commands: (ticks, 5) SI. Returns one dict of series each."""
    series = drive_model.simulate(commands, drives_of(machines), seed)
    return [measure(commands, m, {k: s[:, :, r].astype(float) for k, s in series.items()},
                    np.random.default_rng([seed, r])) for r, m in enumerate(machines)]


def tip(commands, m, s):
    """Times, positions of the axes, and where the tool is seen from the piece."""
    t = np.arange(len(commands)) * drive_model.kTick
    q = commands + s["load"]
    v = np.gradient(q, drive_model.kTick, axis=0)
    a = np.gradient(v, drive_model.kTick, axis=0)
    true = q.copy()
    for axis, f in m.displacement:
        true[:, axis] += f(t, q[:, axis], v[:, axis], a[:, axis], s["force"][:, axis])
    extra = sum((f(t, q, v, a) for f in m.pose), np.zeros((len(t), 3)))
    return (t, q, *kinematics.tip_in_piece(m.geometry, true, extra))


def measure(commands, m, s, rng):
    t, q, p, turn = tip(commands, m, s)
    felt, _ = probe_model.deflection(m.probe, m.piece, p, turn)
    noise = rng.standard_normal((3, len(t), 5))
    return {
        "time": t, "command": commands,
        "position": commands + s["measured"] + POSITION_NOISE * noise[0],
        "twist": s["twist"] + np.sqrt(2) * POSITION_NOISE * noise[1],
        "force": s["force"] + FORCE_NOISE * noise[2],
        "deflection": probe_model.read(m.probe, felt, q, t, rng),
    }
