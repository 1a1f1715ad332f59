#!/usr/bin/env python3
"""The generator against closed forms, written down independently of it.

    generator_test.py
"""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import numpy as np

import drives
import effects
import files
import kinematics
import machine
import probe


def bare(runs=1, **numbers):
    """Rigid drives of 100 kg without friction, lag and noise."""
    d = drives.Drives(runs)
    d.load[:], d.motor[:] = 60, 40
    d.kp[:] = 2 * np.pi * 80 * 100
    d.inertia_ff[:] = 100
    d.loop_noise[:] = 0
    for name, value in numbers.items():
        getattr(d, name)[:] = value
    return d


def ramp(ticks, speed, rise=200):
    """Axis X from rest to a constant speed by a smooth rise of the speed."""
    u = np.clip(np.arange(ticks) / rise, 0, 1)
    v = speed * u**3 * (10 - 15 * u + 6 * u * u)
    commands = np.zeros((ticks, 5))
    commands[:, 0] = np.cumsum(v) * 1e-3
    return commands


class Drives(unittest.TestCase):
    def test_following_error_of_a_ramp(self):
        d = bare(3)
        d.kv[:] = [[20, 40, 40]] * 5
        d.velocity_ff[:] = [[0, 0, 0.95]] * 5
        e = drives.simulate(ramp(1500, 0.05), d, 1)["measured"][-50, 0]
        np.testing.assert_allclose(e, [-0.05 / 20, -0.05 / 40, -0.05 * 0.05 / 40], rtol=2e-4)

    def test_circle_radius(self):
        """Without feed-forward the position loop is a low-pass: the radius shrinks by (v/Kv)^2 / 2R, and the
        velocity loop's share is left to a tolerance."""
        radius, speed, kv = 0.04, 0.1, 40.0
        t = np.arange(4000) * 1e-3
        phi = speed / radius * t
        commands = np.zeros((len(t), 5))
        commands[:, 0], commands[:, 1] = radius * np.cos(phi), radius * np.sin(phi)
        d = bare(velocity_ff=0.0, kv=kv)
        e = drives.simulate(commands, d, 1)["measured"][:, :, 0].astype(float)
        actual = np.hypot(commands[-2000:, 0] + e[-2000:, 0], commands[-2000:, 1] + e[-2000:, 1])
        expected = -((speed / kv) ** 2) / (2 * radius)
        self.assertAlmostEqual(np.mean(actual - radius) / expected, 1, delta=0.03)

    def test_friction_level(self):
        """The drive's force at constant speed is F_c + B v, with the Stribeck part gone."""
        d = bare(coulomb=50.0, viscous=200.0, stribeck=30.0, stribeck_velocity=1e-3, bristle=1e7)
        s = drives.simulate(ramp(3000, 0.1), d, 1)
        self.assertAlmostEqual(s["force"][-50, 0, 0], 50 + 200 * 0.1, delta=0.05)

    def test_maxwell_elements_follow_their_yield_distances(self):
        """Slow motion from rest: the virgin curve is piecewise linear through the yield points."""
        level, stiffness = 50.0, 1e7
        d = bare(coulomb=level, bristle=stiffness)
        s = drives.simulate(ramp(4000, 2e-5), d, 1)
        x = ramp(4000, 2e-5)[:, 0] + s["load"][:, 0, 0]
        slope = drives.kShare / drives.kYield
        slope = stiffness * slope / slope.sum()
        yielding = drives.kShare * level / slope
        expected = sum(np.minimum(slope[i] * x, drives.kShare[i] * level) for i in range(4))
        np.testing.assert_allclose(s["force"][300:-50, 0, 0], expected[300:-50], atol=0.5)
        self.assertGreater(x[-1], yielding.max())

    def test_asymmetric_dry_friction_is_symmetric_about_a_force(self):
        """Elements that slide at F (1 + a) and -F (1 - a): once slid, a F more than without, also
        while they turn round."""
        level, share = 50.0, 0.2
        d = bare(2, coulomb=level, bristle=1e7)
        d.asymmetry_dry[:, 1] = share
        to_and_fro = np.zeros((3000, 5))
        to_and_fro[:, 0] = 2e-3 * np.sin(2 * np.pi * np.arange(3000) / 1000) ** 3
        force = drives.simulate(to_and_fro, d, 1)["force"][:, 0]
        np.testing.assert_allclose(force[600:, 1] - force[600:, 0], share * level, atol=0.1)

    def test_two_masses_ring_at_their_frequency(self):
        d = bare(stiffness=2e6, damping=0.0, kp=1e-3, kv=1e-3, inertia_ff=0.0, motor_feedback=1.0)
        d.load_force = [(0, 0, lambda t, x, v: 100.0 if t < 0.002 else 0.0)]
        twist = drives.simulate(np.zeros((2000, 5)), d, 1)["twist"][100:, 0, 0].astype(float)
        spectrum = np.abs(np.fft.rfft((twist - twist.mean()) * np.hanning(len(twist)), 1 << 16))
        f = np.argmax(spectrum) * 1000 / (1 << 16)
        self.assertAlmostEqual(f, np.sqrt(2e6 * (1 / 60 + 1 / 40)) / (2 * np.pi), delta=0.15)

    def test_backlash_with_motor_encoder_opens_by_its_gap(self):
        d = bare(stiffness=1e8, damping=5e3, gap=10e-6, coulomb=20.0, bristle=1e8, motor_feedback=1.0)
        commands = ramp(1200, 0.02)
        commands = np.concatenate([commands, commands[::-1]])
        twist = drives.simulate(commands, d, 1)["twist"][:, 0, 0].astype(float)
        self.assertAlmostEqual(twist[2000] - twist[1000], 10e-6 + 2 * 20 / 1e8, delta=0.05e-6)

    def test_friction_of_the_motor_does_not_wind_up_the_transmission(self):
        level, stiffness = 50.0, 1e8
        d = bare(3, stiffness=stiffness, damping=5e3, bristle=1e8, motor_feedback=1.0)
        d.motor_coulomb[:, 1] = level
        d.coulomb[:, 2] = level
        s = drives.simulate(ramp(2000, 0.1), d, 1)
        for run, wound in ((1, 0.0), (2, level / stiffness)):
            more = {k: (s[k][-500:, 0, run] - s[k][-500:, 0, 0]).mean() for k in ("force", "twist")}
            self.assertAlmostEqual(more["force"], level, delta=0.01 * level)
            self.assertAlmostEqual(-more["twist"], wound, delta=0.01 * level / stiffness)

    def test_a_late_encoder_of_the_load_shows_by_the_way_of_its_latency(self):
        v, late = 0.02, 0.3e-3
        for motor_feedback in (0.0, 1.0):
            d = bare(2, motor_feedback=motor_feedback)
            d.load_encoder_latency[:, 1] = late
            s = {k: a[-500:, 0].astype(float) for k, a in drives.simulate(ramp(2000, v), d, 2).items()}
            more = {k: (a[:, 1] - a[:, 0]).mean() for k, a in s.items()}
            self.assertAlmostEqual(more["twist"], -v * late, delta=0.002 * v * late)
            self.assertAlmostEqual(more["load"], 0 if motor_feedback else v * late, delta=0.01 * v * late)

    def test_error_of_one_measuring_system(self):
        """Both show between the systems; the load moves where its own is in error and closes the loop, by Kv/(s + Kv)."""
        v, period = 0.02, 0.02
        to = {"amplitude": 2e-6, "wave": 2 * np.pi / period, "phase": 0.4}
        commands = ramp(4000, v)
        waves, angle = 2 * np.pi * v / period, to["wave"] * commands[1000:, 0] + to["phase"]
        for side, sign in (("motor", -1), ("load", 1)):
            d = bare(**{f"{side}_encoder_{k}": value for k, value in to.items()})
            out = {k: v[1000:, 0, 0].astype(float) for k, v in drives.simulate(commands, d, 1).items()}
            np.testing.assert_allclose(out["twist"], sign * 2e-6 * np.sin(angle), atol=5e-9)
            off = out["load"] - out["load"].mean()
            follows = 2e-6 / np.hypot(1, waves / d.kv[0, 0])
            self.assertAlmostEqual(np.sqrt(2) * off.std() / (follows if side == "load" else follows * waves / d.kv[0, 0]), 1, delta=0.05)

    def test_delay_of_the_set_point(self):
        d = bare()
        d.command = {(0, 0): lambda s: drives.spline_values(s, -0.5e-3)}
        e = drives.simulate(ramp(1500, 0.05), d, 1)["measured"][-300, 0, 0]
        self.assertAlmostEqual(e / (-0.05 * 0.5e-3), 1, delta=1e-3)


class Kinematics(unittest.TestCase):
    def test_published_vector(self):
        """A = 20 deg, C = 30 deg, p = (10, 20, 30) mm, A axis at z = -50, C axis at y = 25, z = -80."""
        g = kinematics.Geometry()
        g.tool, g.piece = np.zeros(3), np.zeros(3)
        g.a_point = np.array([0, 0, -50e-3])
        g.c_point = np.array([0, 25e-3, -80e-3])
        axes = np.array([[6.160254e-3, 42.086475e-3, 19.815997e-3, np.deg2rad(20), np.deg2rad(30)]])
        p, turn = kinematics.tip_in_piece(g, axes)
        np.testing.assert_allclose(p[0], [10e-3, 20e-3, 30e-3], atol=1e-8)
        np.testing.assert_allclose(turn[0] @ [0, 0, 1], [0.171010072, -0.296198133, 0.939692621], atol=1e-8)

    def test_axis_errors_against_their_vector_formulas(self):
        rng = np.random.default_rng(3)
        axes = rng.uniform(-0.1, 0.1, (50, 5))
        axes[:, 3:] = rng.uniform(-1, 1, (50, 2))

        def matrix(axis, angle):
            c, s = np.cos(angle), np.sin(angle)
            return {"x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
                    "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[axis]

        ideal, _ = kinematics.tip_in_piece(machine.Machine().geometry, axes)
        for name, place, parameters, error in (
                ("c_axis_offset", "geometry", {"x_um": 8.0, "y_um": -5.0},
                 lambda q: (np.eye(3) - matrix("z", q[4])) @ [8e-6, -5e-6, 0]),
                ("a_axis_offset", "geometry", {"y_um": 8.0, "z_um": -5.0},
                 lambda q: matrix("z", q[4]) @ (np.eye(3) - matrix("x", q[3])) @ [0, 8e-6, -5e-6])):
            m = machine.Machine()
            effects.inject(m, name, place, parameters)
            got, _ = kinematics.tip_in_piece(m.geometry, axes)
            np.testing.assert_allclose(got - ideal, [error(q) for q in axes], atol=1e-11, err_msg=name)

    def test_squareness_shears(self):
        m = machine.Machine()
        effects.inject(m, "squareness", "geometry", {"xy_urad": 40.0})
        axes = np.array([[0.01, 0.05, 0, 0, 0]])
        got, _ = kinematics.tip_in_piece(m.geometry, axes)
        ideal, _ = kinematics.tip_in_piece(machine.Machine().geometry, axes)
        np.testing.assert_allclose(got - ideal, [[40e-6 * 0.05, 0, 0]], atol=1e-15)


class Probe(unittest.TestCase):
    def test_pieces(self):
        p = np.array([[0.0300, 0, 0.01]])
        depth, n = probe.Ring(0.0325).touch(p, 0.003)
        self.assertAlmostEqual(depth[0], 0.5e-3)
        np.testing.assert_allclose(n, [[-1, 0, 0]])
        depth, n = probe.Sphere([0, 0, 0], 0.025).touch(np.array([[0, 0, 0.0276]]), 0.003)
        self.assertAlmostEqual(depth[0], 0.4e-3)
        depth, n = probe.Plane([0, 0, 0], [1, 0, 0]).touch(np.array([[0.0024, 5, 7]]), 0.003)
        self.assertAlmostEqual(depth[0], 0.6e-3)

    def test_errors_of_the_signals(self):
        """Heydemann: an offset q of the sine moves the reading by period/2pi q cos(phi), unequal gains by
        period/2pi g/2 sin(2 phi), a quadrature error by -period/2pi alpha cos^2(phi) at w = sin(phi - alpha)."""
        x = np.linspace(0, 100e-6, 400)
        felt = np.stack([x, x, x], axis=1)
        unit = 20e-6 / (2 * np.pi)
        phi = x / unit
        for member, value, expected in (("sine_offset", 0.01, unit * 0.01 * np.cos(phi)),
                                        ("sine_gain", 0.01, unit * 0.005 * np.sin(2 * phi)),
                                        ("quadrature", 0.01, -unit * 0.01 * np.cos(phi) ** 2)):
            one = probe.Probe()
            one.noise, one.adc_bits = 0, 24
            setattr(one, member, np.full(3, value))
            got = probe.read(one, felt, None, x, np.random.default_rng(1))
            np.testing.assert_allclose(got[:, 0] - x, expected, atol=unit * 1.2e-4, err_msg=member)

    def test_structural_mode_under_steady_acceleration(self):
        m = machine.Machine()
        effects.inject(m, "structural_mode", "X", {"participation": 1.0, "frequency_Hz": 35.0, "damping_ratio": 0.2})
        n = 3000
        out = m.displacement[0][1](np.arange(n) * 1e-3, np.zeros(n), np.zeros(n), np.full(n, 2.0), np.zeros(n))
        self.assertAlmostEqual(out[-1] / (-2.0 / (2 * np.pi * 35) ** 2), 1, delta=1e-6)


class Recording(unittest.TestCase):
    def test_every_effect_changes_the_recording(self):
        """Of one machine, without noise in the drives: each effect must move at least one signal, and `healthy`
        twice from the same seed none."""
        t = np.arange(1300) * 1e-3
        commands = np.zeros((len(t), 5))
        ease = np.minimum(t / 0.3, 1) ** 2
        commands[:, 0] = machine.PIECE[0] + 0.03 * np.sin(4 * t) * ease
        commands[:, 1] = machine.PIECE[1] + 0.03 * np.sin(3 * t + 0.4) * ease
        commands[:, 2] = 0.2 + 0.004 * np.sin(3 * t) * ease
        commands[:, 3] = 0.1 * np.sin(2.5 * t) * ease
        commands[:, 4] = 0.6 * np.sin(2 * t) * ease
        machines, names = [], []
        for name, e in effects.EFFECTS.items():
            place = e.places[0]
            m = machine.Machine()
            effects.inject(m, name, place, e.draw(np.random.default_rng(5), place))
            machines.append(m)
            names.append(name)
        for name, apply in effects.UNKNOWN.items():
            m = machine.Machine()
            apply(m, np.random.default_rng(5))
            machines.append(m)
            names.append(name)
        machines.append(machine.Machine())
        for m in machines:
            m.piece = probe.Plane([0.1, 0, 0], [1, 0.4, 0.2])  # touched all the time
            m.axis["loop_noise"] = [0.0] * 5
            m.probe.noise = 0
        quiet = machine.POSITION_NOISE * 0
        machine.POSITION_NOISE, kept = quiet, machine.POSITION_NOISE
        machine.FORCE_NOISE, force = quiet, machine.FORCE_NOISE
        try:
            records = machine.record(commands, machines, 1)
        finally:
            machine.POSITION_NOISE, machine.FORCE_NOISE = kept, force
        clean = records[-1]
        scale = {"position": 1e-9, "twist": 1e-9, "force": 0.05, "deflection": 20e-9}
        for name, r in zip(names, records):
            moved = max(np.abs(r[k] - clean[k]).max() / scale[k] for k in scale)
            if name not in ("period_slip", "clamp_slips"):  # come later than this motion lasts
                self.assertGreater(moved, 3, name)

    def test_same_seed_same_recording(self):
        commands = ramp(300, 0.01)

        def once():
            factors = machine.tolerated(np.random.default_rng(1))
            return machine.record(commands, [machine.healthy(factors, np.random.default_rng(2))], 9)[0]
        a, b = once(), once()
        for k in a:
            np.testing.assert_array_equal(a[k], b[k])

    def test_laps_from_program_lines(self):
        lines = np.array([1, 1, 2, 3, 3, 4, 5, 5])
        self.assertEqual(files.laps_of(lines, [(2, 3, "a"), (5, 5, "b")], settle=1), [(0.002, 0.005, "a"), (0.006, 0.008, "b")])


if __name__ == "__main__":
    unittest.main()
