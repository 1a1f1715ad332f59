"""Effects as physical equations: what each does to a machine of the generator.

Names and parameters are the public ones of docs/effects.md; sizes are drawn log-uniformly about a size
that shows. `UNKNOWN` are effects that no entry of the library describes.
"""

import numpy as np

from machine import AXES, PIECE, TURN

LINEAR, ROTARY, ALL = "XYZ", "AC", "XYZAC"
ARCSEC = np.pi / 180 / 3600


class Effect:
    def __init__(self, name, places, draw, apply):
        self.name, self.places, self.draw, self.apply = name, places, draw, apply


EFFECTS = {}
UNKNOWN = {}


def size(rng, typical, signed=False, spread=3.0):
    value = typical * spread ** rng.uniform(-1, 1)
    return float(value * rng.choice([-1, 1])) if signed else float(value)


def effect(places, **sizes):
    """Decorates apply(machine, axis, parameters); sizes: typical or (linear, rotary); "~" before a
    name in `sizes` is not possible, so a tuple ("signed", typical) marks both signs."""

    def declare(apply):
        def draw(rng, place):
            out = {}
            for key, spec in sizes.items():
                if callable(spec):
                    out[key] = spec(rng, place)
                    continue
                signed = isinstance(spec, tuple) and spec[0] == "signed"
                out[key] = size(rng, spec[1] if signed else spec, signed)
            return {k: v for k, v in out.items() if v is not None}
        EFFECTS[apply.__name__] = Effect(apply.__name__, places, draw, apply)
        return apply
    return declare




def signed(typical):
    return ("signed", typical)


def fixed(value):
    return lambda rng, place: value


def phase(rng, place):
    return float(rng.uniform(-180, 180))


def lin(typical, sign=False):
    return lambda rng, place: size(rng, typical, sign) if place in LINEAR else None


def rot(typical, sign=False):
    return lambda rng, place: size(rng, typical, sign) if place in ROTARY else None


def pick(p, *names):
    """The one parameter of several names that is there, SI by its unit."""
    units = {"um": 1e-6, "nm": 1e-9, "mm": 1e-3, "arcsec": ARCSEC, "deg": np.pi / 180, "N": 1.0, "Nm": 1.0}
    for name in names:
        if name in p:
            return p[name] * units.get(name.rsplit("_", 1)[-1], 1.0)
    raise KeyError(names)


# --- servo ---------------------------------------------------------------------------------------

@effect(ALL, delay_ms=0.15)
def command_delay(m, axis, p):
    import drives
    m.command[axis] = lambda s: drives.spline_values(s, -p["delay_ms"] * 1e-3)


@effect(ALL, deviation_percent=signed(8))
def kv_error(m, axis, p):
    m.scale("kv", axis, 1 + p["deviation_percent"] / 100)


@effect(ALL, deviation_percent=signed(1))
def velocity_ff_error(m, axis, p):
    m.axis["velocity_ff"][axis] += p["deviation_percent"] / 100


@effect(ALL, deviation_percent=signed(30))
def acceleration_ff_error(m, axis, p):
    m.axis["acceleration_ff"][axis] += p["deviation_percent"] / 100


@effect(ALL, deviation_percent=lambda rng, place: size(rng, 60))
def integral_time_error(m, axis, p):
    m.scale("ti", axis, 1 + p["deviation_percent"] / 100)


@effect(ALL, deviation_percent=lambda rng, place: -size(rng, 25, spread=2))
def velocity_gain_error(m, axis, p):
    m.scale("kp", axis, 1 + p["deviation_percent"] / 100)


@effect(ALL, lag_us=300)
def current_lag(m, axis, p):
    m.axis["lag_1"][axis] += p["lag_us"] * 1e-6


@effect(ALL, deviation_percent=signed(8))
def torque_constant_error(m, axis, p):
    m.axis["torque_constant"][axis] = 1 + p["deviation_percent"] / 100


@effect(ALL, amplitude_N=lin(30), amplitude_Nm=rot(1), order=lambda r, place: 6.0 if place in LINEAR else 24.0,
        phase_deg=phase)
def torque_ripple(m, axis, p):
    m.axis["ripple"][axis] = pick(p, "amplitude_N", "amplitude_Nm")
    travel = [0.012, 0.012, 0.012, TURN, TURN][axis]
    m.axis["ripple_wave"][axis] = TURN * p["order"] / travel
    m.axis["ripple_phase"][axis] = np.deg2rad(p["phase_deg"])


@effect(ALL, amplitude_N=lin(30), amplitude_Nm=rot(1), pole_pitch_mm=lambda r, place: 24.0 if place in LINEAR else None,
        pole_pitch_deg=lambda r, place: 15.0 if place in ROTARY else None, phase_deg=phase)
def cogging(m, axis, p):
    m.axis["cogging"][axis] = pick(p, "amplitude_N", "amplitude_Nm")
    m.axis["cogging_wave"][axis] = TURN / pick(p, "pole_pitch_mm", "pole_pitch_deg")
    m.axis["cogging_phase"][axis] = np.deg2rad(p["phase_deg"])


@effect("C", amplitude_arcsec=8, phase_deg=phase)
def encoder_eccentricity(m, axis, p):
    m.axis["encoder_amplitude"][axis] = p["amplitude_arcsec"] * ARCSEC
    m.axis["encoder_wave"][axis] = 1.0
    m.axis["encoder_phase"][axis] = np.deg2rad(p["phase_deg"])


@effect(ALL, amplitude_um=lin(2), amplitude_arcsec=rot(8), phase_deg=phase,
        period_mm=lambda rng, place: 20.0 if place in LINEAR else None,
        period_deg=lambda rng, place: 360.0 if place in ROTARY else None)
def load_encoder_error(m, axis, p):
    m.axis["load_encoder_amplitude"][axis] = pick(p, "amplitude_um", "amplitude_arcsec")
    m.axis["load_encoder_wave"][axis] = TURN / pick(p, "period_mm", "period_deg")
    m.axis["load_encoder_phase"][axis] = np.deg2rad(p["phase_deg"])


@effect(ALL, latency_us=100)
def load_encoder_latency(m, axis, p):
    m.axis["load_encoder_latency"][axis] = p["latency_us"] * 1e-6


@effect(ALL, amplitude_um=lin(2), amplitude_arcsec=rot(8), phase_deg=phase,
        period_mm=lambda rng, place: 12.0 if place in LINEAR else None,
        period_deg=lambda rng, place: 18.0 if place in ROTARY else None)
def transmission_error(m, axis, p):
    m.axis["motor_encoder_amplitude"][axis] = -pick(p, "amplitude_um", "amplitude_arcsec")
    m.axis["motor_encoder_wave"][axis] = TURN / pick(p, "period_mm", "period_deg")
    m.axis["motor_encoder_phase"][axis] = np.deg2rad(p["phase_deg"])


@effect("XY", delay_cycles=fixed(1.0))
def bus_latency(m, axis, p):
    n = int(p["delay_cycles"])
    m.command[axis] = lambda s: np.concatenate([np.full(n, s[0]), s[:-n]])


# --- friction ------------------------------------------------------------------------------------

@effect(ALL, share_percent=signed(25))
def coulomb(m, axis, p):
    m.scale("coulomb", axis, 1 + p["share_percent"] / 100)


@effect(ALL, share_percent=signed(45))
def viscous(m, axis, p):
    m.scale("viscous", axis, 1 + p["share_percent"] / 100)


@effect(LINEAR, level_N=60, viscous_Ns_per_m=fixed(0.0))
def motor_friction(m, axis, p):
    m.axis["motor_coulomb"][axis] = p["level_N"]
    m.axis["motor_viscous"][axis] = p["viscous_Ns_per_m"]


@effect(LINEAR, share_percent=signed(8))
def load_mass(m, axis, p):
    m.scale("load", axis, 1 + p["share_percent"] / 100)


@effect(ALL, dry_percent=signed(15), viscous_percent=fixed(0.0))
def friction_asymmetry(m, axis, p):
    m.axis["asymmetry_dry"][axis] = p["dry_percent"] / 100


@effect("XY", height_percent=30, centre_mm=lambda r, place: float(1e3 * PIECE[AXES.index(place)] + r.uniform(-12, 12)),
        width_mm=fixed(12.0), edge_mm=fixed(4.0))
def friction_zone(m, axis, p):
    c, w, e = p["centre_mm"] * 1e-3, p["width_mm"] * 1e-3, p["edge_mm"] * 1e-3
    h = p["height_percent"] / 100

    def flank(x):
        u = min(max(x / e + 0.5, 0.0), 1.0)
        return u * u * (3 - 2 * u)
    m.friction_factor.append((axis, lambda t, x, v: 1 + h * flank(x - c + w / 2) * flank(c + w / 2 - x)))


@effect(ALL, share_percent=lambda r, place: min(size(r, 25, spread=2), 90), time_constant_s=lambda r, place: size(r, 20, spread=2))
def friction_fade(m, axis, p):
    m.friction_factor.append((axis, lambda t, x, v: 1 - p["share_percent"] / 100 * (
        1 - np.exp(-t / p["time_constant_s"]))))


# --- mechanics -----------------------------------------------------------------------------------

@effect("XYZAC", gap_um=lin(4), gap_arcsec=rot(4))
def backlash(m, axis, p):
    m.axis["gap"][axis] = pick(p, "gap_um", "gap_arcsec")


@effect("XYZ", compliance_nm_per_N=4)
def windup(m, axis, p):
    m.axis["compliance"][axis] += p["compliance_nm_per_N"] * 1e-9


@effect("XYZA", force_N=lin(100, True), torque_Nm=rot(4), angle_deg=lambda r, place: phase(r, place) if place in ROTARY else None)
def weight_imbalance(m, axis, p):
    if axis < 3:
        m.axis["constant_force"][axis] = p["force_N"]
    else:
        m.axis["turning_force"][axis] = p["torque_Nm"]
        m.axis["turning_angle"][axis] = np.deg2rad(p["angle_deg"])


@effect("XYAC", stiffness_N_per_mm=lin(1.0), stiffness_Nm_per_rad=rot(4),
        rest_mm=lambda r, place: 0.0 if place in LINEAR else None,
        rest_deg=lambda r, place: 0.0 if place in ROTARY else None)
def cable_chain(m, axis, p):
    m.axis["spring_1"][axis] = p["stiffness_N_per_mm"] * 1e3 if axis < 3 else p["stiffness_Nm_per_rad"]


def play(q, width):
    out = np.empty_like(q)
    middle = q[0]
    half = width / 2
    for k, x in enumerate(q):
        middle = min(max(middle, x - half), x + half)
        out[k] = middle
    return out


@effect(ALL, width_um=lin(4), width_arcsec=rot(5))
def load_play(m, axis, p):
    w = pick(p, "width_um", "width_arcsec")
    m.displacement.append((axis, lambda t, q, v, a, f: play(q, w) - q))


@effect("XY", compliance_nm_per_N=5)
def lost_motion(m, axis, p):
    c = p["compliance_nm_per_N"] * 1e-9
    motor = m.axis["motor"]
    m.displacement.append((axis, lambda t, q, v, a, f: -c * (f - motor[axis] * a)))


@effect("XYZ", participation=lambda r, place: size(r, 1, True, 2), frequency_Hz=lambda r, place: float(r.uniform(20, 60)),
        damping_ratio=fixed(0.04))
def structural_mode(m, axis, p):
    w, z = TURN * p["frequency_Hz"], p["damping_ratio"]

    def swing(t, q, v, a, f):
        h = t[1] - t[0]
        wd = w * np.sqrt(1 - z * z)
        decay, co, si = np.exp(-z * w * h), np.cos(wd * h), np.sin(wd * h)
        y, dy = 0.0, 0.0
        out = np.empty_like(q)
        for k in range(len(t)):
            out[k] = y
            rest = -p["participation"] * a[k] / w**2
            e = y - rest
            b = (dy + z * w * e) / wd
            y = rest + decay * (e * co + b * si)
            dy = decay * ((b * wd - z * w * e) * co - (e * wd + z * w * b) * si)
        return out
    m.displacement.append((axis, swing))


@effect(("geometry",), x_per_y_um_per_m_s2=signed(2))
def cross_inertia(m, axis, p):
    k = p["x_per_y_um_per_m_s2"] * 1e-6
    m.pose.append(lambda t, q, v, a: np.stack([k * a[:, 1], 0 * t, 0 * t], axis=1))


# --- geometry ------------------------------------------------------------------------------------

@effect("XY", error_ppm=signed(60), reference_mm=fixed(0.0))
def scale_error(m, axis, p):
    m.displacement.append((axis, lambda t, q, v, a, f: p["error_ppm"] * 1e-6 * q))


@effect("XYC", amplitude_um=lin(0.8), amplitude_arcsec=rot(3), period_mm=lambda r, place: 12.0 if place in LINEAR else None,
        period_deg=lambda r, place: 30.0 if place in ROTARY else None, phase_deg=phase)
def pitch_periodic(m, axis, p):
    a_, w = pick(p, "amplitude_um", "amplitude_arcsec"), TURN / pick(p, "period_mm", "period_deg")
    m.displacement.append((axis, lambda t, q, v, a, f: a_ * np.sin(w * q + np.deg2rad(p["phase_deg"]))))


@effect("XY", quadratic_um_at_100mm=signed(5))
def pitch_progressive(m, axis, p):
    m.displacement.append((axis, lambda t, q, v, a, f: p["quadratic_um_at_100mm"] * 1e-6 * (q / 0.1) ** 2))


@effect("XY", first_bow_um=signed(5))
def straightness(m, axis, p):
    other = 1 - axis

    def bow(t, q, v, a):
        out = np.zeros((len(t), 3))
        out[:, other] = p["first_bow_um"] * 1e-6 * (q[:, axis] / 0.1) ** 2
        return out
    m.pose.append(bow)


@effect("XY", first_um=signed(2), second_um=fixed(0.0), crossing_um=fixed(10.0))
def lateral_play(m, axis, p):
    other = 1 - axis

    def shift(t, q, v, a):
        out = np.zeros((len(t), 3))
        side, z = np.empty(len(t)), 0.0
        step = np.diff(q[:, axis], prepend=q[0, axis]) * 2 / (p["crossing_um"] * 1e-6)
        for k, s in enumerate(step):
            z = min(max(z + s, -1.0), 1.0)
            side[k] = z
        out[:, other] = p["first_um"] * 1e-6 / 2 * side
        return out
    m.pose.append(shift)


@effect(("geometry",), xy_urad=signed(40))
def squareness(m, axis, p):
    m.geometry.y = m.geometry.y + np.array([p["xy_urad"] * 1e-6, 0, 0])


@effect("C", first_um=2, second_um=2, axial_um=fixed(0.0), harmonic=fixed(2.0), phase_deg=phase)
def rotary_runout(m, axis, p):
    def wander(t, q, v, a):
        angle = p["harmonic"] * q[:, 4] + np.deg2rad(p["phase_deg"])
        # the table's body moves in the frame of what carries it: against the tip
        x, y = p["first_um"] * 1e-6 * np.cos(angle), p["second_um"] * 1e-6 * np.sin(angle)
        body = np.stack([x, y, 0 * x], axis=1)
        co, si = np.cos(-q[:, 3]), np.sin(-q[:, 3])
        return -np.stack([body[:, 0], co * body[:, 1], si * body[:, 1]], axis=1)
    m.pose.append(wander)


@effect(("geometry",), y_um=signed(15), z_um=signed(15))
def a_axis_offset(m, axis, p):
    m.geometry.a_point = np.array([0, p["y_um"], p["z_um"]]) * 1e-6


@effect(("geometry",), about_y_urad=signed(40), about_z_urad=signed(40))
def a_axis_tilt(m, axis, p):
    m.geometry.a = m.geometry.a + np.cross([0, p["about_y_urad"] * 1e-6, p["about_z_urad"] * 1e-6], m.geometry.a)


@effect(("geometry",), x_um=signed(8), y_um=signed(8))
def c_axis_offset(m, axis, p):
    m.geometry.c_point = np.array([p["x_um"], p["y_um"], 0]) * 1e-6


@effect(("geometry",), about_x_urad=signed(60), about_y_urad=signed(60))
def c_axis_tilt(m, axis, p):
    m.geometry.c = m.geometry.c + np.cross([p["about_x_urad"] * 1e-6, p["about_y_urad"] * 1e-6, 0], m.geometry.c)


# --- thermal -------------------------------------------------------------------------------------

@effect("XY", rate_um_per_m_min=signed(60), reference_mm=fixed(0.0))
def thermal_expansion(m, axis, p):
    m.displacement.append((axis, lambda t, q, v, a, f: p["rate_um_per_m_min"] * 1e-6 / 60 * t * q))


@effect("XY", rise_K=signed(4), time_constant_s=lambda r, place: size(r, 30, spread=2), expansion_um_per_m_K=fixed(11.5),
        reference_mm=fixed(0.0))
def thermal_warm_up(m, axis, p):
    m.displacement.append((axis, lambda t, q, v, a, f: p["rise_K"] * 11.5e-6 * (
        1 - np.exp(-t / p["time_constant_s"])) * q))


@effect("XY", offset_um=signed(4), time_constant_s=lambda r, place: size(r, 30, spread=2))
def thermal_drift(m, axis, p):
    m.displacement.append((axis, lambda t, q, v, a, f: p["offset_um"] * 1e-6 * (1 - np.exp(-t / p["time_constant_s"]))))


@effect("XY", amplitude_um=2, period_s=lambda r, place: size(r, 20, spread=1.5))
def ambient_cycle(m, axis, p):
    m.displacement.append((axis, lambda t, q, v, a, f: p["amplitude_um"] * 1e-6 * np.sin(TURN * t / p["period_s"])))


# --- probe and acquisition -----------------------------------------------------------------------

@effect(("probe",), larger_um=signed(5))
def tip_radius(m, axis, p):
    m.probe.ball += p["larger_um"] * 1e-6


@effect(("probe",), amplitude_um=1, lobes=fixed(3.0), phase_deg=phase)
def tip_lobing(m, axis, p):
    m.probe.lobing = (p["amplitude_um"] * 1e-6, 3, np.deg2rad(p["phase_deg"]))


@effect(("probe",), coefficient=lambda r, place: 0.1 + size(r, 0.05))
def surface_friction(m, axis, p):
    m.probe.friction = p["coefficient"]


@effect(("probe",), gain_percent=lambda r, place: [size(r, 0.8, True), size(r, 0.8, True), 0.0])
def probe_gain(m, axis, p):
    m.probe.matrix = m.probe.matrix @ np.diag(1 + np.array(p["gain_percent"]) / 100)


@effect(("probe",), x_from_y_percent=signed(0.8), y_from_x_percent=signed(0.8))
def cross_talk(m, axis, p):
    c = np.zeros((3, 3))
    c[0, 1], c[1, 0] = p["x_from_y_percent"] / 100, p["y_from_x_percent"] / 100
    m.probe.matrix = m.probe.matrix + c


@effect(("probe",), rate_um_per_min=lambda r, place: [size(r, 2, True), size(r, 2, True), size(r, 2, True)],
        time_constant_s=fixed(0.0))
def probe_drift(m, axis, p):
    m.probe.shift.append(lambda t, q: t[:, None] / 60 * np.array(p["rate_um_per_min"]) * 1e-6)


@effect(("probe",), limit_mm=lambda r, place: float(r.uniform(0.46, 0.495)))
def range_clip(m, axis, p):
    m.probe.limit = p["limit_mm"] * 1e-3


@effect(("probe",), latency_us=300)
def sample_latency(m, axis, p):
    m.probe.latency = lambda t: p["latency_us"] * 1e-6 + 0 * t


@effect(("probe",), cosine_percent=lambda r, place: [size(r, 3, True) for _ in range(3)],
        sine_percent=lambda r, place: [size(r, 3, True) for _ in range(3)])
def signal_offset(m, axis, p):
    m.probe.cosine_offset = np.array(p["cosine_percent"]) / 100
    m.probe.sine_offset = np.array(p["sine_percent"]) / 100


@effect(("probe",), gain_percent=lambda r, place: [size(r, 5, True) for _ in range(3)])
def signal_gain(m, axis, p):
    m.probe.sine_gain = np.array(p["gain_percent"]) / 100


@effect(("probe",), angle_deg=lambda r, place: [size(r, 3, True) for _ in range(3)])
def signal_phase(m, axis, p):
    m.probe.quadrature = np.deg2rad(p["angle_deg"])


@effect(("probe",), periods=fixed(1.0), channel=lambda r, place: float(r.integers(0, 2)), start_s=lambda r, place: float(r.uniform(8, 40)))
def period_slip(m, axis, p):
    one = np.zeros(3)
    one[int(p["channel"])] = m.probe.period
    m.probe.shift.append(lambda t, q: (t >= p["start_s"])[:, None] * one)


# --- what the library does not have --------------------------------------------------------------

def unknown(function):
    UNKNOWN[function.__name__] = function
    return function


@unknown
def friction_by_other_axis(m, rng):
    """Dry friction of X grows with the position of Y: a gib that the overhanging slide presses."""
    f = rng.uniform(0.3, 0.8)
    # hooks see the axis' own state only, so the force is added as one of all axes
    level = m.axis["coulomb"][0]
    m.load_force.append((0, lambda t, x, v: -f * level * np.tanh(v[0] / 2e-4) * (x[1] - PIECE[1]) / 0.015))
    return {"law": "force on X as sgn(v_X) f(y)", "hook": "table_force", "axis": "X"}


@unknown
def hose_between_axes(m, rng):
    """A hose from Y pulls on X: force on X in proportion to y."""
    k = rng.uniform(2, 5) * 1e3
    m.load_force.append((0, lambda t, x, v: -k * (x[1] - PIECE[1])))
    return {"law": "force on X as f(y)", "hook": "table_force", "axis": "X"}


@unknown
def bellows_at_the_end(m, rng):
    """A bellows that is pressed over the last 10 mm of the ring: one-sided spring."""
    k = rng.uniform(8, 20) * 1e3
    m.load_force.append((0, lambda t, x, v: -k * max(x[0] - PIECE[0] - 0.005, 0.0)))
    return {"law": "force on X as f(x)", "hook": "table_force", "axis": "X"}


@unknown
def friction_in_waves(m, rng):
    """A guide of Y that is hard and soft in turn, every 12 mm."""
    h = rng.uniform(0.2, 0.6)
    m.friction_factor.append((1, lambda t, x, v: 1 + h * np.sin(TURN * x / 12e-3)))
    return {"law": "force on Y as sgn(v_Y) f(y)", "hook": "table_force", "axis": "Y"}


@unknown
def lean_with_speed(m, rng):
    """Oil film of the Y guide: X shifts with the speed of Y."""
    c = rng.uniform(1, 3) * 1e-6 / 0.1 * rng.choice([-1, 1])
    m.pose.append(lambda t, q, v, a: np.stack([c * v[:, 1], 0 * t, 0 * t], axis=1))
    return {"law": "displacement of X as f(v_Y)", "hook": "displacement", "axis": "X"}


@unknown
def clamp_slips(m, rng):
    """The piece slips in its clamp at some time, once."""
    d, t0 = rng.uniform(2, 5) * 1e-6 * rng.choice([-1, 1]), rng.uniform(20, 42)
    m.pose.append(lambda t, q, v, a: np.stack([d * (t > t0), 0 * t, 0 * t], axis=1))
    return {"law": "displacement of X as f(t)", "hook": "displacement", "axis": "X"}


@unknown
def waves_by_other_axis(m, rng):
    """X waves with 37 mm over the position of Y, more where x is large."""
    d = rng.uniform(1, 3) * 1e-6
    m.pose.append(lambda t, q, v, a: np.stack(
        [d * np.sin(TURN * q[:, 1] / 37e-3) * (1 + (q[:, 0] - PIECE[0]) / 0.02), 0 * t, 0 * t], axis=1))
    return {"law": "displacement of X as f(y), g(x)", "hook": "displacement", "axis": "X"}


@unknown
def probe_leans_with_table(m, rng):
    """The probe's cable pulls as C turns: reading of x over the angle."""
    d = rng.uniform(1, 3) * 1e-6
    m.probe.shift.append(lambda t, q: np.stack([d * np.tanh(3 * q[:, 4]), 0 * t, 0 * t], axis=1))
    return {"law": "reading of x as f(C)", "hook": "reading", "axis": "X"}


def inject(m, name, place, parameters):
    if name not in EFFECTS:
        raise ValueError(f"there is no {name}, only {', '.join(sorted(EFFECTS))}")
    missing = set(EFFECTS[name].draw(np.random.default_rng(0), place)) - set(parameters)
    if missing:
        raise ValueError(f"{name} at {place} needs {', '.join(sorted(missing))}, too")
    EFFECTS[name].apply(m, AXES.index(place) if place in AXES else -1, parameters)


def places_of(name):
    return list(EFFECTS[name].places)
