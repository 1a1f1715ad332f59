"""Feed drives of many machines at once: one loop over time, one column per machine.

Every quantity of an axis is an array of shape (5, runs), axes in the order X Y Z A C, SI units.

Controller: position P at 2 kHz, velocity PI at 8 kHz on filtered differences of the measured position,
two first-order stages of the current with one cycle of computing time. Plant: two masses at 16 kHz by
the semi-implicit Euler rule (or one mass where the axis is rigid). Friction: four Maxwell elements in
parallel on the load side,

    f_i <- clip(f_i + k_i v h, +-a_i S(v)),   S(v) = F_c + F_s exp(-|v| / v_s),   F = sum f_i + B v

(generalised Maxwell-slip friction after Al-Bender, Lampaert, Swevers, IEEE Trans. Automatic Control 50
(2005) 1883, without its drift law). The yield distances of the elements are in the ratio of kYield.
"""

import numpy as np

kLoop = 8000.0
kPlantPerLoop = 2
kPositionEvery = 4
kLoopsPerTick = 8
kTick = 1e-3
kShare = np.array([0.1, 0.2, 0.3, 0.4])
kYield = np.array([0.3, 0.7, 1.2, 2.0])
kVelocityFilter = 0.15e-3
kLongestLatency = 40  # loops

NAMES = {
    "kv": 40.0, "ti": 0.01, "kp": 0.0, "velocity_ff": 1.0, "acceleration_ff": 1.0, "inertia_ff": 0.0,
    "lag_1": 2e-4, "lag_2": 1e-4, "force_limit": 1e9, "torque_constant": 1.0,
    "load": 1.0, "motor": 1.0, "stiffness": 0.0, "damping": 0.0, "gap": 0.0,
    "coulomb": 0.0, "stribeck": 0.0, "stribeck_velocity": 1.0, "viscous": 0.0, "bristle": 1.0,
    "asymmetry_dry": 0.0, "asymmetry_viscous": 0.0,
    "motor_coulomb": 0.0, "motor_viscous": 0.0, "motor_yield": 1e-6,
    "cogging": 0.0, "cogging_wave": 0.0, "cogging_phase": 0.0,
    "ripple": 0.0, "ripple_share": 0.0, "ripple_wave": 0.0, "ripple_phase": 0.0,
    "constant_force": 0.0, "turning_force": 0.0, "turning_angle": 0.0,
    "spring_1": 0.0, "spring_3": 0.0, "spring_rest": 0.0,
    "encoder_wave": 0.0, "encoder_amplitude": 0.0, "encoder_phase": 0.0,
    "motor_encoder_wave": 0.0, "motor_encoder_amplitude": 0.0, "motor_encoder_phase": 0.0,
    "load_encoder_wave": 0.0, "load_encoder_amplitude": 0.0, "load_encoder_phase": 0.0,
    "load_encoder_latency": 0.0,
    "motor_feedback": 0.0, "loop_noise": 1e-9,
}


class Drives:
    """Parameters of the five axes of `runs` machines, and what acts on single axes besides."""

    def __init__(self, runs):
        self.runs = runs
        for name, value in NAMES.items():
            setattr(self, name, np.full((5, runs), value))
        self.friction_factor = []  # (axis, run, f(t, x, v)): factor of the dry friction
        self.load_force = []  # (axis, run, f(t, x, v of all axes of the run)): force on the table
        self.command = {}  # (axis, run): f(series at 1 kHz) -> series at 1 kHz


def spline_coefficients(series):
    """Of the cubic B-spline through equidistant values; the ends are held."""
    pole = np.sqrt(3.0) - 2.0
    reach = 30
    taps = np.sqrt(3.0) * pole ** np.abs(np.arange(-reach, reach + 1))
    padded = np.concatenate([np.full(reach + 1, series[0]), series, np.full(reach + 2, series[-1])])
    return np.convolve(padded, taps, mode="valid")  # from one knot before the first to two after


def spline_rows(parts):
    """Weights of four neighbouring coefficients for value, velocity and acceleration."""
    u = np.arange(parts) / parts
    value = np.stack([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3])
    slope = np.stack([-3 * (1 - u) ** 2, 9 * u**2 - 12 * u, -9 * u**2 + 6 * u + 3, 3 * u**2])
    bend = np.stack([6 * (1 - u), 18 * u - 12, -18 * u + 6, 6 * u])
    return value / 6, slope / 6 / kTick, bend / 6 / kTick**2


def spline_values(series, shift=0.0):
    """The spline through a 1 kHz series at times later by `shift` [s], held beyond the ends."""
    at = np.clip(np.arange(len(series)) + shift / kTick, 0, len(series) - 1)
    first = np.minimum(at.astype(int), len(series) - 2)
    u = at - first
    c = spline_coefficients(series)
    w = [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
    return sum(w[j] * c[first + j] for j in range(4)) / 6


def simulate(commands, drives, seed):
    """commands: (ticks, 5), one program for all runs. Returns series of shape (ticks, 5, runs), as
    differences from the commanded position where they are positions: measured, load, twist, force."""
    ticks, runs = len(commands), drives.runs
    d = drives
    series = [commands[:, a] for a in range(5)]
    variant = np.repeat(np.arange(5)[:, None], runs, axis=1)
    for (axis, run), change in sorted(d.command.items(), key=lambda item: item[0]):
        variant[axis, run] = len(series)
        series.append(change(commands[:, axis]))
    coefficients = np.stack([spline_coefficients(s) for s in series])
    to_value, to_slope, to_bend = spline_rows(kLoopsPerTick)

    h = 1 / kLoop
    hp = h / kPlantPerLoop
    rng = np.random.default_rng(seed)
    filter_gain = 1 - np.exp(-h / kVelocityFilter)
    gain_1 = 1 - np.exp(-h / d.lag_1)
    gain_2 = 1 - np.exp(-h / d.lag_2)
    rigid = d.stiffness == 0
    motor_feedback = (d.motor_feedback > 0) & ~rigid
    mixed = bool(np.any(~motor_feedback & ~rigid))
    step_load = hp / np.where(rigid, d.load + d.motor, d.load)
    step_motor = np.where(rigid, 0, hp / d.motor)  # what is rigid follows the load below
    viscous = d.viscous
    half_gap = d.gap / 2
    has_gap = bool(np.any(d.gap > 0))
    share = kShare[:, None, None]
    # slope of element i: its share of the level over its yield distance
    slopes = share / kYield[:, None, None]
    slopes = d.bristle[None] * slopes / slopes.sum(axis=0) * hp
    has_asymmetry = bool(np.any(d.asymmetry_dry != 0) or np.any(d.asymmetry_viscous != 0))
    has_cogging = bool(np.any(d.cogging != 0))
    has_ripple = bool(np.any(d.ripple != 0) or np.any(d.ripple_share != 0))
    has_spring = bool(np.any(d.spring_1 != 0) or np.any(d.spring_3 != 0))
    has_turning = bool(np.any(d.turning_force != 0))
    has_encoder = bool(np.any(d.encoder_amplitude != 0))
    has_motor_friction = bool(np.any(d.motor_coulomb != 0) or np.any(d.motor_viscous != 0))
    motor_slope = hp * d.motor_coulomb / d.motor_yield
    inertia_ff = d.inertia_ff * d.acceleration_ff
    inverse_ti = h / d.ti
    inverse_vs = -1 / d.stribeck_velocity

    def reading(x):
        return x + d.encoder_amplitude * np.sin(d.encoder_wave * x + d.encoder_phase) if has_encoder else x

    one_sided = bool(np.any(d.motor_encoder_amplitude != 0) or np.any(d.load_encoder_amplitude != 0))

    def of_motor(x):
        return d.motor_encoder_amplitude * np.sin(d.motor_encoder_wave * x + d.motor_encoder_phase)

    def of_load(x):
        return d.load_encoder_amplitude * np.sin(d.load_encoder_wave * x + d.load_encoder_phase)

    def fed_back(x):
        return np.where(motor_feedback, of_motor(x), of_load(x)) if one_sided else 0.0

    has_latency = bool(np.any(d.load_encoder_latency != 0))
    past = np.repeat(commands[0][None, :, None], kLongestLatency + 2, axis=0) * np.ones((1, 1, runs))
    steps_back = np.floor(d.load_encoder_latency * kLoop).astype(int)
    share_back = d.load_encoder_latency * kLoop - steps_back

    def lateness(step, x):
        """What the load's encoder counts less than where the load is: its past, a straight line between loops."""
        past[step % len(past)] = x
        later, earlier = (np.take_along_axis(past, ((step - steps_back - i) % len(past))[None], axis=0)[0]
                          for i in (0, 1))
        return later + share_back * (earlier - later) - x

    load = np.repeat(commands[0][:, None], runs, axis=1).astype(float)
    motor = load.copy()
    v_load = np.zeros((5, runs))
    v_motor = np.zeros((5, runs))
    elements = np.zeros((4, 5, runs))
    motor_element = np.zeros((5, runs))  # one that yields, in front of the transmission
    integral = np.zeros((5, runs))
    force_1 = np.zeros((5, runs))
    force = np.zeros((5, runs))
    waiting = np.zeros((5, runs))
    velocity = np.zeros((5, runs))
    before = reading(load) + (of_motor(load) if one_sided else 0.0)
    v_ref_position = np.zeros((5, runs))
    factor = np.ones((5, runs))
    external = d.constant_force.copy()
    hooked_force = np.zeros((5, runs))
    out = {name: np.empty((ticks, 5, runs), dtype=np.float32)
           for name in ("measured", "load", "twist", "force")}

    for k in range(ticks):
        c = coefficients[:, k:k + 4]
        if c.shape[1] < 4:
            c = np.repeat(coefficients[:, -1:], 4, axis=1)
        values, slopes_c, bends = c @ to_value, c @ to_slope, c @ to_bend
        noise = rng.standard_normal((kLoopsPerTick, 5, runs)) * d.loop_noise
        late = lateness(kLoopsPerTick * k, load) if has_latency else 0.0
        here = commands[k][:, None]
        measured = reading(np.where(motor_feedback, motor, load))
        out["measured"][k] = measured + fed_back(measured) + np.where(d.motor_feedback > 0, 0, late) - here
        out["load"][k] = load - here
        out["twist"][k] = load + late - motor + (of_load(load) - of_motor(motor) if one_sided else 0.0)
        out["force"][k] = force
        t = k * kTick
        for axis, run, f in d.friction_factor:
            factor[axis, run] = f(t, load[axis, run], v_load[axis, run])
        for axis, run, f in d.load_force:
            hooked_force[axis, run] = f(t, load[:, run], v_load[:, run])
        level = d.coulomb * factor
        excess = d.stribeck * factor
        v_ff = (d.velocity_ff[:, :, None] * slopes_c[variant]).transpose(2, 0, 1).copy()
        f_ff = (inertia_ff[:, :, None] * bends[variant]).transpose(2, 0, 1).copy()
        x_ref = values[variant].transpose(2, 0, 1).copy()
        for j in range(kLoopsPerTick):
            x = reading(np.where(motor_feedback, motor, load)) if mixed else reading(motor)
            x = x + noise[j]
            turned = x + of_motor(x) if one_sided else x  # what the motor counts, for its velocity
            x = x + fed_back(x)
            if has_latency:
                x = x + np.where(d.motor_feedback > 0, 0, lateness(kLoopsPerTick * k + j, load))
            velocity += filter_gain * ((turned - before) * kLoop - velocity)
            before = turned
            if j % kPositionEvery == 0:
                v_ref_position = d.kv * (x_ref[j] - x)
            error = v_ref_position + v_ff[j]
            error -= velocity
            asked = d.kp * (error + integral)
            asked += f_ff[j]
            limited = np.minimum(np.maximum(asked, -d.force_limit), d.force_limit)
            error *= inverse_ti
            error *= asked == limited
            integral += error
            force_1 += gain_1 * (waiting - force_1)
            force += gain_2 * (force_1 - force)
            waiting = limited
            acting = force * d.torque_constant
            if has_cogging:
                acting += d.cogging * np.sin(d.cogging_wave * motor + d.cogging_phase)
            if has_ripple:
                acting += (d.ripple + d.ripple_share * force) * np.sin(d.ripple_wave * motor + d.ripple_phase)
            external = d.constant_force + hooked_force
            if has_turning:
                external += d.turning_force * np.sin(load + d.turning_angle)
            if has_spring:
                stretch = load - d.spring_rest
                external -= (d.spring_1 + d.spring_3 * stretch * stretch) * stretch
            external += acting * rigid
            for _ in range(kPlantPerLoop):
                bound = level + excess * np.exp(np.abs(v_load) * inverse_vs)
                most, least = bound, -bound
                if has_asymmetry:
                    most, least = bound * (1 + d.asymmetry_dry), bound * (d.asymmetry_dry - 1)
                    viscous = d.viscous * (1 + d.asymmetry_viscous * np.sign(v_load))
                elements += slopes * v_load
                np.minimum(elements, share * most, out=elements)
                np.maximum(elements, share * least, out=elements)
                net = viscous * v_load
                np.subtract(external, net, out=net)
                net -= np.add.reduce(elements, axis=0)
                wind = motor - load
                if has_gap:
                    wind -= np.minimum(np.maximum(wind, -half_gap), half_gap)
                    spring = d.stiffness * wind + d.damping * (wind != 0) * (v_motor - v_load)
                else:
                    wind *= d.stiffness
                    spring = v_motor - v_load
                    spring *= d.damping
                    spring += wind
                net += spring
                net *= step_load
                v_load += net
                if has_motor_friction:
                    motor_element += motor_slope * v_motor
                    np.clip(motor_element, -d.motor_coulomb, d.motor_coulomb, out=motor_element)
                    spring += motor_element + d.motor_viscous * v_motor
                np.subtract(acting, spring, out=spring)
                spring *= step_motor
                v_motor += spring
                load += hp * v_load
                motor += hp * v_motor
            np.copyto(motor, load, where=rigid)
    return out
