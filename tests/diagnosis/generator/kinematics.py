"""The machine's geometry as a product of screw exponentials.

Every joint is a screw (direction w, point q on its line, or a pure translation); the pose of the tool
seen from the piece is

    G = (exp(A) exp(C) P)^-1  exp(X) E_X(x) exp(Y) E_Y(y) exp(Z) E_Z(z) T

with the table's joints turning by -A and -C, P the piece on the table at A = C = 0 and E the tilt of a
carriage. Errors of axes are errors of screws: a squareness is a direction, an axis offset a point.
Series run along the first index. SI.
"""

import numpy as np


def cross_matrix(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def rotation(w, angle):
    """exp of a unit direction w by angles: (n, 3, 3)."""
    k = cross_matrix(w / np.linalg.norm(w))
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * k + (1 - c) * (k @ k)


def small_rotation(vectors):
    """exp of rotation vectors, one each: (n, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)
    unit = vectors / np.maximum(angle, 1e-300)[:, None]
    k = np.zeros((len(vectors), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -unit[:, 2], unit[:, 1], -unit[:, 0]
    k -= np.swapaxes(k, 1, 2)
    return np.eye(3) + np.sin(angle)[:, None, None] * k + (1 - np.cos(angle))[:, None, None] * (k @ k)


class Geometry:
    """Declared by default; the members are what a machine's axes really are."""

    def __init__(self):
        self.x = np.array([1.0, 0, 0])
        self.y = np.array([0, 1.0, 0])
        self.z = np.array([0, 0, 1.0])
        self.a = np.array([1.0, 0, 0])
        self.c = np.array([0, 0, 1.0])
        self.a_point = np.zeros(3)
        self.c_point = np.zeros(3)
        self.tool = np.array([0, 0, -0.15])
        self.piece = np.array([0, 0, 0.05])
        self.piece_turn = np.zeros(3)
        self.carriage_tilt = {}  # 0, 1, 2 -> rotation vector per metre of travel
        self.tool_side = None  # f(axes, t): further displacement of the tip in the machine [m]


def tip_in_piece(g, axes, extra=None):
    """axes: (n, 5) true positions; extra: (n, 3) displacement of the tip in the machine's frame.
    Returns positions (n, 3) and orientations (n, 3, 3) of the tool seen from the piece."""
    n = len(axes)
    position = np.tile(g.tool, (n, 1))
    turn = np.tile(np.eye(3), (n, 1, 1))
    for joint, direction in ((2, g.z), (1, g.y), (0, g.x)):
        if joint in g.carriage_tilt:
            tilt = small_rotation(axes[:, joint:joint + 1] * g.carriage_tilt[joint][None])
            position = np.einsum("nij,nj->ni", tilt, position)
            turn = tilt @ turn
        position = position + axes[:, joint:joint + 1] * direction[None]
    if extra is not None:
        position = position + extra
    # into the frame of the table: undo A about its line, then C about its own
    for angle, direction, point in ((axes[:, 3], g.a, g.a_point), (axes[:, 4], g.c, g.c_point)):
        r = rotation(direction, angle)
        position = np.einsum("nij,nj->ni", r, position - point) + point
        turn = r @ turn
    unturn = small_rotation(-g.piece_turn[None])[0]
    return (position - g.piece) @ unturn.T, unturn @ turn
