"""Quasi-static contact of a scanning probe's ball with analytic pieces, and how it is read.

The ball gives way along the outward normal n of the piece by the depth to which its centre was driven
in, and along the drag of friction:

    d_W = depth (n - mu t),   d_P = R^T d_W

t: direction of sliding. Each channel is read as an arctangent of two signals with their errors.
"""

import numpy as np


class Ring:
    """Bore about the z axis of the piece, half its height to either side; nothing beyond."""

    def __init__(self, radius, height=40e-3):
        self.radius, self.height = radius, height

    def touch(self, p, ball):
        away = np.hypot(p[:, 0], p[:, 1])
        n = -np.stack([p[:, 0], p[:, 1], np.zeros(len(p))], axis=1) / np.maximum(away, 1e-9)[:, None]
        return np.where(np.abs(p[:, 2]) < self.height / 2, away - (self.radius - ball), 0), n


class Sphere:
    def __init__(self, centre, radius):
        self.centre, self.radius = np.asarray(centre, float), radius

    def touch(self, p, ball):
        r = p - self.centre
        away = np.linalg.norm(r, axis=1)
        return self.radius + ball - away, r / np.maximum(away, 1e-9)[:, None]


class Plane:
    def __init__(self, point, normal):
        self.point = np.asarray(point, float)
        self.normal = np.asarray(normal, float) / np.linalg.norm(normal)

    def touch(self, p, ball):
        return ball - (p - self.point) @ self.normal, np.tile(self.normal, (len(p), 1))


class Probe:
    def __init__(self):
        self.ball = 3e-3
        self.friction = 0.1
        self.spring = 1324.0
        self.bend = np.zeros(3)  # compliance of the stylus by direction [m/N]
        self.lobing = (0.0, 3, 0.0)  # amplitude [m], lobes, direction
        self.matrix = np.eye(3)
        self.period = 20e-6
        self.cosine_offset = np.zeros(3)
        self.sine_offset = np.zeros(3)
        self.sine_gain = np.zeros(3)
        self.quadrature = np.zeros(3)
        self.harmonics = np.zeros((3, 2))
        self.adc_bits = 16
        self.noise = 0.15e-6
        self.latency = None  # f(t): age of the reading [s]
        self.shift = []  # f(t, axes): added to the reading (n, 3)
        self.limit = None


def deflection(probe, piece, p, turn, speed_floor=1e-4):
    """What the ball does: (n, 3) in the frame of the probe."""
    depth, n = piece.touch(p, probe.ball)
    amplitude, lobes, direction = probe.lobing
    if amplitude:
        n_probe = np.einsum("nji,nj->ni", turn, n)
        rho = np.hypot(n_probe[:, 0], n_probe[:, 1])
        theta = np.arctan2(n_probe[:, 1], n_probe[:, 0])
        depth = depth + amplitude * rho**lobes * np.cos(lobes * (theta - direction))
    depth = np.where(depth > 0, depth, 0)
    velocity = np.gradient(p, 1e-3, axis=0)
    sliding = velocity - np.sum(velocity * n, axis=1, keepdims=True) * n
    speed = np.linalg.norm(sliding, axis=1, keepdims=True)
    drag = sliding / (speed + speed_floor)
    world = depth[:, None] * (n - probe.friction * drag)
    return np.einsum("nji,nj->ni", turn, world), depth


def read(probe, felt, axes, t, rng):
    sensed = felt / (1 + probe.spring * probe.bend[None])
    sensed = sensed @ probe.matrix.T
    for shift in probe.shift:
        sensed = sensed + shift(t, axes)
    if probe.limit is not None:
        sensed = np.clip(sensed, -probe.limit, probe.limit)
    if probe.latency is not None:
        at = t - probe.latency(t)
        sensed = np.stack([np.interp(at, t, sensed[:, i]) for i in range(3)], axis=1)
    if probe.noise:
        sensed = sensed + probe.noise * rng.standard_normal(sensed.shape)
    phase = 2 * np.pi * sensed / probe.period

    def wave(phi):
        return np.cos(phi) + probe.harmonics[:, 0] * np.cos(2 * phi) + probe.harmonics[:, 1] * np.cos(3 * phi)

    quarter = phase - np.pi / 2 - probe.quadrature
    cosine = wave(phase) + probe.cosine_offset
    sine = (1 + probe.sine_gain) * wave(quarter) + probe.sine_offset
    step = 2.0 * 1.5 / 2**probe.adc_bits
    cosine, sine = np.round(cosine / step) * step, np.round(sine / step) * step
    off = np.arctan2(sine, cosine) - phase
    return sensed + probe.period / (2 * np.pi) * (off - 2 * np.pi * np.round(off / (2 * np.pi)))
