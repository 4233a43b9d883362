#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far shear_band goes, and whether it says so: every scheme with steps from a hundredth to a thousand times the default and
tolerances from 1e-1 to 1e-10; hot and cold, fast and slow, soft and nearly incompressible; odd, thin and tiny grids; walls that turn
back, stop, jump, open, or follow a load; rough fields. Each run is judged by maps.py's classes.

What is promised:
- Adaptive index-reduced schemes bound the error of a step in sigma/s_Y (or, beyond yield, sigma over its equivalent stress) and
  chi/chi_inf by --tolerance. The delivered error of the end may add up to ten times that, but 0.1 without a warning is never right. The
  velocity is the multiplier, whose error the slope of the flow amplifies: a hundred times the tolerance, at least 1e-2 of the walls'
  velocity.
- Fixed steps, and adaptive ones of projection schemes, whose Q* is no error, promise their order: an error beyond 1e-2 must be warned of.
  The velocity of projection schemes is that of the middle of the step: up to 0.1 in it is listed as `near`.
- The one-point stiffness and elements hold equilibrium to round-off, 1e-9 here (elements by the program's own residual); the fully
  integrated stiffness to 1e-3, or it warns.
- chi goes to chi_inf and never beyond, within the promise for chi; advection, which is not monotonous, may overshoot by 1e-2.

Errors are against the same scene and grid by Dormand-Prince's pair at 1e-7 (1e-9 for tolerances), whose worth is its difference from
CVODE's BDF at ten times that (an integrator by other people; the cells' rates are the same code), added twice to what is promised. Where
one of them takes too long, the standard scheme at Dormand-Prince's tolerance is the second.
Rates have an oracle of their own: where fields are uniform, the ordinary differential equations of one point, written here.

    verification/stability_grid.py         # some 20 minutes on two cores
"""

import dataclasses

import common
import h5py
import maps
import numpy as np
from results import Run

GRID = 20
DURATION = 1.4175  # [s], strain 0.07
SMALL = {"cells": 16, "duration": 1.0}  # where steps and tolerances are a hundredth and a millionth: past yield, a band has begun
RATE_SCHEMES = ("auto", "bogacki-shampine", "dormand-prince", "ralston", "chebyshev", "arkode-2", "arkode-3", "arkode-4", "arkode-5",
                "cvode-adams", "cvode-bdf", "ida")
PROJECTION_SCHEMES = ("incremental", "extrapolated", "substepped", "euler")
SCHEMES = (*RATE_SCHEMES, *PROJECTION_SCHEMES, "mri")
BOTH = ("full", "reduced")
FACTORS = (0.01, 0.1, 1, 3, 10, 30, 100, 300, 1000)
TOLERANCES = ("auto", 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
FLOOR = 1e-2        # of fixed steps and of the velocity
LAG = 0.1           # of v in projection schemes
ROUND_OFF = 1e-9
HALF_HEIGHT = 0.01  # [m]
DOUBTED = "estimated error|may not be kept|of so many add up"  # what a warning says of errors of the integration
TIGHT = {"A": {"scheme": "dormand-prince", "tolerance": 1e-7}, "B": {"scheme": "cvode-bdf", "tolerance": 1e-6}, "C": {"tolerance": 1e-7}}
TIGHTEST = {"A": {"scheme": "dormand-prince", "tolerance": 1e-9}, "B": {"scheme": "cvode-bdf", "tolerance": 1e-8}, "C": {"tolerance": 1e-9}}
HOW = {  # a few ways to integrate, for what is crossed with scenes
    "auto": {},
    "auto 1e-6": {"tolerance": 1e-6},
    "dormand-prince 1e-6": {"scheme": "dormand-prince", "tolerance": 1e-6},
    "chebyshev 1e-3": {"scheme": "chebyshev", "tolerance": 1e-3},
    "cvode-adams 1e-5": {"scheme": "cvode-adams", "tolerance": 1e-5},
    "cvode-bdf 1e-5": {"scheme": "cvode-bdf", "tolerance": 1e-5},
    "ida 1e-5": {"scheme": "ida", "tolerance": 1e-5},
    "arkode-3 1e-5": {"scheme": "arkode-3", "tolerance": 1e-5},
    "incremental": {"scheme": "incremental", "step": "fixed"},
    "extrapolated": {"scheme": "extrapolated", "step": "fixed"},
    "incremental, adaptive": {"scheme": "incremental"},
    "substepped": {"scheme": "substepped", "step": "fixed"},
    "mri": {"scheme": "mri", "step": "fixed"},
}
FEW = ("auto", "auto 1e-6", "cvode-bdf 1e-5", "incremental")
BATHS = (300, 400, 500, 600, 700, 800, 890, 1000, 1200, 1500)  # [K]
RATES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1, 10, 100, 1e3, 1e4, 1e5, 1e6)
MODULI = (0.01, 0.5, 0.7, 1, 3.26, 10, 100, 1e3, 1e4, 1e6)  # K/mu
YIELDS = (1e3, 1e6, 1e8, 0.4e9, 0.85e9, 2e9, 4e9, 1e11)  # [Pa]
CORNERS = (1e-12, 1e-6, 1e-3, 1e-2, 0.1, 1)
DEGREES = (2, 5, 10)
CELLS = ("1x1", "2x2", "3x3", "4x4", "5x5", "7x7", "17x17", "31x13", "13x31", "4x200", "200x4", "5x101", "101x5", "64x8", "8x64")
ELEMENTS = ((1, "8x8", "reduced"), (1, "5x40", "reduced"), (2, "2x2", "full"), (2, "1x20", "full"), (3, "7x27", "full"),
            (4, "100x4", "full"), (7, "13x35", "full"), (8, "16x16", "full"), (16, "4x16", "full"), (16, "16x64", "full"),
            (16, "33x16", "reduced"))  # degree, points, model
DOMAINS = ((0.02, 0.02), (0.2, 0.02), (0.02, 0.2), (2, 0.02), (0.02, 2), (2e-8, 2e-8), (2e4, 2e4), (2e-15, 2e-15))  # [m]
LEFT = (0, 0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 2e-6)  # of a step after 500 whole ones
TURNS = {
    "reversal": "0:5e-4,0.5:5e-4,0.5:-5e-4",
    "reversal, full cycles": "0:5e-4,0.45:5e-4,0.45:-5e-4,0.9:-5e-4,0.9:5e-4",
    "hold after yield": "0:5e-4,0.6:5e-4,0.6:0",
    "hold before yield": "0:5e-4,0.3:5e-4,0.3:0",
    "rate up 100 times": "0:5e-4,0.7:5e-4,0.7:5e-2,0.72:5e-2,0.72:5e-4",
    "rate down 1000 times": "0:5e-4,0.7:5e-4,0.7:5e-7",
    "ramp": "0:0,1.4175:1e-3",
    "pulse of 1 ms": "0:0,0.5:0,0.5:0.15,0.501:0.15,0.501:0",
    "opening": "0:5e-4:1e-5",
    "opening 1 %": "0:5e-4:1e-4",
    "closing": "0:5e-4:-1e-4",
    "opening only": "0:0:1e-4",
    "opens, closes": "0:5e-4:2e-4,0.5:5e-4:2e-4,0.5:5e-4:-2e-4",
    "at rest": "0:0",
}
SHORT = {"duration": 0.3}
LOADS = {
    "tau 0.9 GPa in 50 ms": {"shear-traction": "0:0,0.05:9e8", **SHORT},
    "tau 0.5 GPa": {"shear-traction": "0:0,0.05:5e8", **SHORT},
    "tau 0.5 GPa from the start": {"shear-traction": "5e8", **SHORT},
    "tau 0.9 GPa from the start": {"shear-traction": "9e8", **SHORT},
    "tau 0.95 GPa": {"shear-traction": "0:0,0.05:9.5e8", **SHORT},
    "tau 1.1 GPa": {"shear-traction": "0:0,0.05:1.1e9", **SHORT},
    "tau 2 GPa": {"shear-traction": "0:0,0.05:2e9", **SHORT},
    "loaded, unloaded": {"shear-traction": "0:0,0.05:9e8,0.1:9e8,0.15:0", **SHORT},
    "tau drops at once": {"shear-traction": "0:0,0.05:9e8,0.1:9e8,0.1:4e8", **SHORT},
    "alternating": {"shear-traction": "0:0,0.1:9e8,0.2:-9e8,0.3:9e8", **SHORT},
    "sigma_yy 0, sheared": {"normal-traction": "0"},
    "sigma_yy -2 GPa, sheared": {"normal-traction": "-2e9"},
    "sigma_yy 1.5 GPa, sheared": {"normal-traction": "0:0,0.1:1.5e9"},
    "both": {"normal-traction": "0:0,0.1:-3e8", "shear-traction": "0:0,0.05:9e8", **SHORT},
}
PERZYNA = {
    "n = 1": {}, "n = 3": {"perzyna-exponent": 3}, "n = 10": {"perzyna-exponent": 10}, "n = 100": {"perzyna-exponent": 100},
    "fast: 1e6/s": {"perzyna-rate": 1e6}, "slow: 1e-6/s": {"perzyna-rate": 1e-6}, "H = 10 GPa": {"perzyna-hardening": 1e10},
    "H = 4000 GPa": {"perzyna-hardening": 4e12}, "n = 3, 100/s": {"perzyna-exponent": 3, "perzyna-rate": 100},
}
ELASTIC = {
    "shear": {"yield-stress": 1e10},
    "strain 2": {"yield-stress": 1e12, "duration": 40.5, "plasticity": "perzyna"},
    "opening": {"yield-stress": 1e10, "wall-history": "0:5e-4:1e-4"},
}
UNIFORM = {  # scenes of one point
    "default": {}, "1200 K": {"stz-bath-temperature": 1200}, "300 K": {"stz-bath-temperature": 300}, "890 K": {"stz-bath-temperature": 890},
    "rate 1e-6": {"wall-velocity": common.WALL * 1e-6, "duration": DURATION * 1e6},
    "rate 1e3": {"wall-velocity": common.WALL * 1e3, "duration": DURATION / 1e3},
    "K/mu 1e4": {"bulk-modulus": 1e4 * common.SHEAR}, "strain 2": {"duration": 40.5}, "from 900 K": {"initial-base": 899},
    "reversal": {"wall-history": TURNS["reversal"]}, "hold": {"wall-history": TURNS["hold after yield"]},
    "jump": {"wall-history": TURNS["rate up 100 times"]}, "opening": {"wall-history": TURNS["opening 1 %"]},
    "creep": LOADS["tau 0.9 GPa in 50 ms"], "creep, unloaded": LOADS["loaded, unloaded"], "sigma_yy 0": {"normal-traction": "0"},
    "both loads": LOADS["both"], "perzyna": {"plasticity": "perzyna"}, "perzyna, n = 10": {"plasticity": "perzyna", "perzyna-exponent": 10},
    "perzyna, H": {"plasticity": "perzyna", "perzyna-hardening": 1e10}, "corner": {"stz-corner": 0.01}, "elastic": {"yield-stress": 1e10},
}


# --- fields and their norms ------------------------------------------------------------------------------------------------


class Snapshot:
    """The last snapshot of a run, in SI units."""

    def __init__(self, folder):
        run = Run(folder)
        last = run.snapshots[-1]
        read = lambda *names: np.stack([last[name] for name in names])
        self.stress = read("pressure", "s", "tau", "q")
        self.internal = last["effective_temperature" if "effective_temperature" in last.names else "plastic_strain"]
        self.velocity, self.time = read("velocity_x", "velocity_y"), last.time
        left, bottom, right, top = run.grid.box
        self.dx, self.dy = (right - left) / run.grid.x_centre.size, (top - bottom) / run.grid.y_centre.size


def stress_norm(stress):
    """Root mean square of the Frobenius norm of the 3 x 3 stress."""
    p, s, tau, q = stress
    return np.sqrt(np.mean(3 * p**2 + 2 * (s**2 + tau**2 + 3 * q**2)))


def rms(field):
    return np.sqrt(np.mean(np.sum(field**2, axis=0))) if field.ndim == 3 else np.sqrt(np.mean(field**2))


def residual(snapshot, size):
    """B^T sigma at the corners within, with the gradient of one point, over a stress on a cell's shorter side: its own or `size`, the
    larger."""
    p, s, tau, q = snapshot.stress
    xx, yy = -p + s - q, -p - s - q
    before = lambda f: np.roll(f, 1, axis=1)  # periodic in x
    along_x = lambda f: 0.5 * ((f - before(f))[1:] + (f - before(f))[:-1]) / snapshot.dx
    along_y = lambda f: 0.5 * (f[1:] - f[:-1] + before(f)[1:] - before(f)[:-1]) / snapshot.dy
    force = np.stack([along_x(xx) + along_y(tau), along_x(tau) + along_y(yy)])
    size = max(stress_norm(snapshot.stress), size)
    return rms(force) * min(snapshot.dx, snapshot.dy) / size if size > 0 and force.size else 0.0


# --- references ------------------------------------------------------------------------------------------------------------


@dataclasses.dataclass
class Reference:
    """Final fields, units of errors, and the difference (sigma, chi, v) of two integrators."""

    stress: np.ndarray
    internal: np.ndarray
    velocity: np.ndarray
    stress_unit: float
    unit: float  # of the internal variable
    speed: float
    worth: tuple = (0.0, 0.0, 0.0)

    def errors(self, snapshot):
        return (stress_norm(snapshot.stress - self.stress) / self.stress_unit, rms(snapshot.internal - self.internal) / self.unit,
                rms(snapshot.velocity - self.velocity) / self.speed)


def scene_of(options):
    """What decides the answer; the rest decides how it is found."""
    return tuple(sorted((key, str(value)) for key, value in options.items()))


def reference_from(folder, options):
    last = Snapshot(folder)
    unit = float(options.get("stz-steady-temperature", 900)) if options.get("plasticity", "stz") == "stz" else 1.0
    told = [abs(speed) for which in (1, 2) for _, speed in knots_of(options.get("wall-history", "0:0"), which)]
    half = 0.5 * float(options.get("height", 0.02))
    speed = max(np.abs(last.velocity).max(), *told, half * np.abs(Run(folder).history["wall_strain_rate_1/s"]).max(), 1e-3 * common.WALL)
    return Reference(last.stress, last.internal, last.velocity, stress_unit(options, last.stress), unit, speed)


def stress_unit(options, stress):
    """The yield stress, or the equivalent stress of what flows far beyond it."""
    return max(float(options.get("yield-stress", 0.85e9)), stress_norm(stress * np.array([0, 1, 1, 1]).reshape(4, 1, 1)) / 2**0.5)


def find_references(scenes, arguments):
    """{scene: Reference or None}: by two integrators, which are a map of their own: they must agree within 1e-5."""
    def case(options, which):
        label = ", ".join(f"{key} {value}" for key, value in options.items() if key != "snapshots")
        tight = TIGHTEST if options["cells"] == SMALL["cells"] else TIGHT
        return maps.Case("references", {"scene": label, "of": which}, "shear_band", {**options, **tight[which]},
                         lambda folder: maps.Judgement(0.0, 1.0), limit=20)

    def run(wanted):
        return maps.run_cases([case(options, which) for options, which in wanted], arguments.program.parent, arguments.work, arguments.jobs)

    both = run([(options, which) for options in scenes.values() for which in "AB"])
    pairs = dict(zip(scenes, zip(both[0::2], both[1::2])))
    lost = [scene for scene, pair in pairs.items() if sum(one.status == 0 for one in pair) == 1]
    third = dict(zip(lost, run([(scenes[scene], "C") for scene in lost])))
    found = {}
    for scene, options in scenes.items():
        good = [one for one in (*pairs[scene], *([third[scene]] if scene in third else [])) if one.status == 0]
        found[scene] = reference_from(good[0].folder, options) if len(good) > 1 else None
        if found[scene]:
            found[scene].worth = found[scene].errors(Snapshot(good[1].folder))
    return found


# --- oracles ---------------------------------------------------------------------------------------------------------------


def promises_of(options):
    """Promised errors of sigma, chi and v, and the slack of v in projection schemes."""
    if options.get("scheme", "auto") in RATE_SCHEMES and options.get("step", "adaptive") == "adaptive":
        asked = options.get("tolerance", "auto")
        tolerance = 1e-4 if asked == "auto" else float(asked)
        bound = min(10 * tolerance, 0.1)
        return (bound, bound, max(min(100 * tolerance, 0.1), FLOOR)), 0.0
    return (FLOOR,) * 3, LAG if options.get("scheme") in PROJECTION_SCHEMES else 0.0


def judge(options, reference, folder):
    """The worst of all that can be said about the end of a run: error, promise, what."""
    last = Snapshot(folder)
    (sigma, chi, v), slack = promises_of(options)
    exact = options.get("operator", "exact") == "exact"
    history = Run(folder).history
    largest = np.sqrt(2) * np.max(history["mean_deviatoric_magnitude_Pa"])  # of the run: what unloads keeps its round-off
    stiff = float(options.get("bulk-modulus", 122e9)) / common.SHEAR  # what round-off of the divergence of v is amplified by
    open_force = history["equilibrium_residual"][-1] if options.get("space") == "elements" else residual(last, largest)
    found = [(abs(last.time / options["duration"] - 1), 1e-9, "time of the last snapshot", "$^", 0),
             (open_force, ROUND_OFF * max(1, stiff / 100) if exact else 1e-3, "equilibrium", "equilibrium", 0)]
    mean = last.stress[2].mean()
    if np.ndim(history["time_s"]) == 1 and history["time_s"][-1] == last.time:
        found.append((abs(history["wall_shear_traction_Pa"][-1] - mean) / max(stress_norm(last.stress), 1e-300), 1e-8,
                      "traction in history.csv", "$^", 0))
    if options.get("plasticity", "stz") == "stz":
        steady, start = float(options.get("stz-steady-temperature", 900)), first_internal(folder)
        low, high = min(start[0], steady), max(start[1], steady)
        beyond = max(low - last.internal.min(), last.internal.max() - high, 0.0) / steady
        allowed = chi if options.get("model") == "reduced" else max(chi, FLOOR)
        found.append((beyond, allowed, "bounds of chi", f"{DOUBTED}|finest scales", 0))
    if reference:
        for error, promised, worth, what in zip(reference.errors(last), (sigma, chi, v), reference.worth, ("sigma", "chi", "v")):
            found.append((error, promised + 2 * worth, what, DOUBTED, slack + 2 * worth if what == "v" else 0))
    error, promised, what, about, slack = max(found, key=lambda entry: entry[0] / entry[1])
    delivered = max(reference.errors(last)[:2]) if reference else float("nan")
    return maps.Judgement(float(error), float(promised), what if reference else f"{what}; no reference", float(slack), about, delivered)


def first_internal(folder):
    history = Run(folder).history
    return history["smallest_effective_temperature_K"][0], history["largest_effective_temperature_K"][0]


# --- one point -------------------------------------------------------------------------------------------------------------

RADAU_A = np.array([[(88 - 7 * 6**0.5) / 360, (296 - 169 * 6**0.5) / 1800, (-2 + 3 * 6**0.5) / 225],
                    [(296 + 169 * 6**0.5) / 1800, (88 + 7 * 6**0.5) / 360, (-2 - 3 * 6**0.5) / 225],
                    [(16 - 6**0.5) / 36, (16 + 6**0.5) / 36, 1 / 9]])
RADAU_C = RADAU_A.sum(axis=1)


def radau_step(rate, t, y, dt):
    """A step of Radau IIA, order 5, or None where Newton's iteration does not converge."""
    n = y.size
    base = rate(t, y)
    jacobian = np.empty((n, n))
    for k in range(n):
        change = 1e-7 * max(abs(y[k]), 1e-3)
        jacobian[:, k] = (rate(t, y + change * np.eye(n)[k]) - base) / change
    inverse = np.linalg.inv(np.eye(3 * n) - dt * np.kron(RADAU_A, jacobian))
    z = np.zeros((3, n))
    for _ in range(12):
        slopes = np.stack([rate(t + c * dt, y + z_i) for c, z_i in zip(RADAU_C, z)])
        change = (inverse @ (dt * RADAU_A @ slopes - z).ravel()).reshape(3, n)
        z = z + change
        if not np.isfinite(z).all():
            return None
        if np.abs(change).max() < 1e-12:
            return y + z[2]
    return None


def integrate(rate, y, times, tolerance=1e-9):
    """y at the last of `times`; steps end at each, because the load has a kink there, and a step across yield is a short one. The error
    is that of a step against two halves."""
    dt = 1e-3 * (times[-1] - times[0])
    for begin, end in zip(times, times[1:]):
        t = begin
        while t < end:
            dt = min(dt, end - t)
            whole = radau_step(rate, t, y, dt)
            half = radau_step(rate, t, y, dt / 2)
            fine = radau_step(rate, t + dt / 2, half, dt / 2) if half is not None else None
            error = np.abs(whole - fine).max() / tolerance if whole is not None and fine is not None else np.inf
            if error <= 1 and rate.yields(y) != rate.yields(fine) and dt > 1e-10 * end:
                error = 1e3
            if error <= 1:
                t, y = (end, fine) if dt >= end - t else (t + dt, fine)
            if dt < 1e-13 * end:
                raise ArithmeticError("the point's steps shrink")
            dt *= min(4.0, max(0.2, 0.8 * max(error, 1e-12) ** (-1 / 6)))
    return y


def at(knots, t, end):
    """Value and slope of a piecewise-linear history within the interval that ends at `end`."""
    for (t0, a), (t1, b) in zip(knots, knots[1:]):
        if t0 < end <= t1:
            return a + (b - a) * (t - t0) / (t1 - t0), (b - a) / (t1 - t0)
    return knots[-1][1], 0.0


def knots_of(text, which=1):
    rows = [[float(word) for word in knot.split(":")] for knot in text.split(",")]
    return [(row[0], row[which] if which < len(row) else 0.0) for row in rows]


def point(options):
    """p, s, tau, q [Pa], chi or kappa, and the walls' u and v at the end of a scene whose fields are uniform."""
    value = lambda key, default: float(options.get(key, default))
    K, mu, Y = value("bulk-modulus", 122e9), value("shear-modulus", 37.4e9), value("yield-stress", 0.85e9)
    end = value("duration", DURATION)
    spins = options.get("model", "full") == "full"
    stz = options.get("plasticity", "stz") == "stz"
    T, steady = value("stz-bath-temperature", 400), value("stz-steady-temperature", 900)
    activation = value("stz-activation-volume", 3e-28) * value("stz-local-strain", 0.3) * Y / (1.3806488e-23 * T)
    attempts = np.log(0.5 / value("stz-molecular-time", 1e-13)) - value("stz-activation-barrier", 8000) / T
    heat, formation, corner = value("stz-heat-capacity", 0.4), value("stz-formation-temperature", 21000), value("stz-corner", 0)
    D0, n, H = value("perzyna-rate", 0.01), value("perzyna-exponent", 1), value("perzyna-hardening", 0)
    told = options.get("wall-history", f"0:{options.get('wall-velocity', common.WALL)}")
    walls = knots_of(told, 1), knots_of(told, 2)
    load = {key: knots_of(text if ":" in text else f"0:{text}") for key, text in
            (("shear", options.get("shear-traction", "")), ("normal", options.get("normal-traction", ""))) if text}

    def flow(sbar, internal):
        """D^pl/sbar and the rate of the internal variable; stress in Y."""
        if not stz:
            excess = sbar / (1 + H / Y * internal) - 1
            D = D0 * excess**n if excess > 0 else 0.0
            return D / max(sbar, 1e-30), D
        x = 1 - 1 / max(sbar, 1e-30)
        x = 0.5 * (x + np.hypot(x, corner)) if corner else max(x, 0.0)
        chi = internal * steady
        D = x * (np.exp(attempts - formation / chi + activation * sbar) + np.exp(attempts - formation / chi - activation * sbar))
        return D / max(sbar, 1e-30), 2 * sbar * D * (1 - internal) / heat

    def rates_at(interval):
        def rate(t, y):
            p, s, tau, q, internal = y
            fluidity, change = flow(np.sqrt(s * s + tau * tau + 3 * q * q), internal)
            m, k, relax = mu / Y, K / Y, 2 * mu / Y * fluidity
            g, e = (at(knots, t, interval)[0] / HALF_HEIGHT for knots in walls)
            spin = 1.0 if spins else 0.0
            if "normal" in load and "shear" not in load:  # -dp - ds - dq = wanted, g is told
                e = (at(load["normal"], t, interval)[1] / Y + spin * g * tau - relax * (s + q)) / (k + 4 / 3 * m)
            elif "shear" in load and "normal" not in load:
                g = (at(load["shear"], t, interval)[1] / Y + relax * tau) / (m - spin * s)
            elif load:
                g = (at(load["shear"], t, interval)[1] / Y + relax * tau) / (m - spin * s)
                e = (at(load["normal"], t, interval)[1] / Y + spin * g * tau - relax * (s + q)) / (k + 4 / 3 * m)
            rate.walls = g * HALF_HEIGHT, e * HALF_HEIGHT
            return np.array([-k * e, -m * e + spin * g * tau - relax * s, m * g - spin * g * s - relax * tau,
                             -m * e / 3 - relax * q, change])
        rate.yields = lambda y: corner == 0 and np.sqrt(y[1]**2 + y[2]**2 + 3 * y[3]**2) > (1 if stz else 1 + H / Y * y[4])
        return rate

    start = value("initial-base", 640 if stz else 0) / (steady if stz else 1.0)
    y = np.array([0.0, 0.0, 0.0, 0.0, start])
    for key, knots in load.items():  # a load that is there from the start on: elastic
        if key == "shear":
            y[2] += knots[0][1] / Y
        else:
            e = knots[0][1] / (K + 4 / 3 * mu)
            y[:4] += np.array([-K, -mu, 0, -mu / 3]) * e / Y
    times = sorted({0.0, end, *(t for knots in (*walls, *load.values()) for t, _ in knots if 0 < t < end)})
    for begin, stop in zip(times, times[1:]):
        rate = rates_at(stop)
        y = integrate(rate, y, [begin, stop])
    rate(end, y)
    return y[:4] * Y, y[4] * (steady if stz else 1.0), rate.walls


def point_reference(options):
    stress, internal, (u, v) = point(options)
    height = np.linspace(-1, 1, GRID + 1)[:, None]
    velocity = np.stack([u * height, v * height])
    unit = float(options.get("stz-steady-temperature", 900)) if options.get("plasticity", "stz") == "stz" else 1.0
    stress = stress[:, None, None]
    return Reference(stress, internal, velocity, stress_unit(options, stress), unit,
                     max(np.hypot(u, v), 1e-3 * common.WALL), (1e-8, 1e-8, 1e-6))


# --- cases -----------------------------------------------------------------------------------------------------------------


def default_step(cells):
    """The paper's: 0.5e4 t_s h/L, h the shorter side of a cell [s]."""
    return 1e4 / cells * common.TIME


def write_fields(folder):
    """Initial files by name: rough fields that no pattern of the program makes."""
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(7)
    ones, noise = np.ones((GRID, GRID)), lambda: random.standard_normal((GRID, GRID))
    j, i = np.mgrid[:GRID, :GRID]
    board = (-1.0) ** (i + j)
    spot, half, stripe = ones * 640, np.where(i < GRID // 2, 600.0, 800.0), np.where(j == GRID // 2, 850.0, 620.0)
    spot[GRID // 2, GRID // 3] = 880
    stress = lambda p=0.0, s=0.0, tau=0.0, q=0.0: {"pressure": p * ones, "s": s * ones, "tau": tau * ones, "q": q * ones}
    zero = stress()
    files = {
        "chi: one cell 240 K above": {"effective_temperature": spot},
        "chi: jump of 200 K": {"effective_temperature": half},
        "chi: a row 230 K above": {"effective_temperature": stripe},
        "chi: noise 2 %": {"effective_temperature": 640 * (1 + 0.02 * noise())},
        "chi: noise 10 %": {"effective_temperature": np.clip(640 * (1 + 0.1 * noise()), 410, 1200)},
        "chi: checkerboard 1 %": {"effective_temperature": 640 * (1 + 0.01 * board)},
        "chi: checkerboard 20 %": {"effective_temperature": 640 * (1 + 0.2 * board)},
        "chi: from 2 K to 20000 K": {"effective_temperature": np.where(i < GRID // 2, 2.0, 20000.0)},
        "chi: above chi_inf": {"effective_temperature": 1000 + 30 * noise()},
        "stress: uniform tau, 0.9 s_Y": {"effective_temperature": 640 * ones, **stress(tau=0.9 * common.YIELD)},
        "stress: uniform tau, 1.5 s_Y": {"effective_temperature": 640 * ones, **stress(tau=1.5 * common.YIELD)},
        "stress: uniform tau, 5 s_Y": {"effective_temperature": 640 * ones, **stress(tau=5 * common.YIELD)},
        "stress: uniform tau, -1.2 s_Y": {"effective_temperature": 640 * ones, **stress(tau=-1.2 * common.YIELD)},
        "stress: pressure 100 s_Y": {"effective_temperature": 640 * ones, **stress(p=100 * common.YIELD)},
        "stress: all, chi noise": {"effective_temperature": 640 * (1 + 0.02 * noise()), **stress(3e8, 2e8, 4e8, -2e8)},
        "stress: noise 1e8 Pa": {"effective_temperature": 640 * ones, **{key: 1e8 * noise() for key in zero}},
        "stress: checkerboard 3e8 Pa": {"effective_temperature": 640 * ones, **{key: 3e8 * board for key in zero}},
        "stress: noise 1 Pa": {"effective_temperature": 640 * ones, **{key: noise() for key in zero}},
    }
    for number, (name, fields) in enumerate(files.items()):
        with h5py.File(folder / f"{number}.h5", "w") as file:
            for key, values in fields.items():
                file[key] = values
    return {name: folder / f"{number}.h5" for number, name in enumerate(files)}


class Book:
    """Cases, and the scenes they need a reference of."""

    def __init__(self):
        self.entries, self.scenes = [], {}

    def add(self, name, axes, scene, how, point=False, limit=10.0):
        duration = scene.get("duration", DURATION)
        scene = {"cells": GRID, **scene, "duration": duration, "snapshots": duration}
        how = dict(how)
        cells = min(int(word) for word in str(scene["cells"]).split("x"))
        if how.get("step") == "fixed" or how.get("scheme") in PROJECTION_SCHEMES:
            factor = how.pop("factor", 1)
            # strain of a step as in the paper, whatever the speed of the walls
            pace = duration / DURATION if "wall-velocity" in scene else 1.0
            if how.get("step") == "fixed":
                how["dt"] = f"{factor * default_step(max(cells, 1)) * pace:.6g}"
        key = scene_of(scene) if not point else None
        if key is not None:
            self.scenes[key] = scene
        self.entries.append((name, axes, {**scene, **how}, key, scene, limit))

    def cases(self, references):
        points = {}
        for name, axes, options, key, scene, limit in self.entries:
            if key is None and scene_of(scene) not in points:
                points[scene_of(scene)] = point_reference(scene)
            reference = references[key] if key is not None else points[scene_of(scene)]
            if int(options.get("history-every", 1)) == 1 and float(options.get("dt", 1)) < 1e-4 * options["duration"]:
                options = {**options, "history-every": 100}
            yield maps.Case(name, axes, "shear_band", options,
                            lambda folder, o=options, r=reference: judge(o, r, folder), limit=limit)


def book(files):
    b = Book()
    def crossed(name, axis, scenes, hows, **more):
        for label, scene in scenes.items():
            for how in hows:
                b.add(name, {axis: label, "integrator": how}, scene, HOW[how], **more)

    crossed("bath temperature", "bath [K]", {T: {"stz-bath-temperature": T} for T in BATHS}, HOW)
    # few cells: steps of explicit schemes are as short as slow walls make them
    crossed("wall rate", "rate over the paper's",
            {f"{r:g}": {"cells": 8, "wall-velocity": common.WALL * r, "duration": DURATION / r} for r in RATES},
            [how for how in HOW if how != "incremental, adaptive"])
    crossed("compressibility", "K/mu", {r: {"bulk-modulus": r * common.SHEAR} for r in MODULI}, FEW)
    crossed("yield stress", "yield stress [Pa]", {f"{Y:g}": {"yield-stress": Y} for Y in YIELDS}, FEW, limit=40)
    crossed("cells", "cells", {cells: {"cells": cells} for cells in CELLS}, FEW)
    crossed("domain", "width x height [m]",
            {f"{w:g} x {h:g}": {"width": w, "height": h, "wall-velocity": common.WALL * h / 0.02} for w, h in DOMAINS},
            ("auto", "incremental"))
    rough = {name: {"initial": "file", "initial-file": file} for name, file in files.items()}
    for model in BOTH:
        of_model = lambda scenes: {name: {**scene, "model": model} for name, scene in scenes.items()}
        hows = lambda *more: (*FEW, *more) if model == "full" else FEW
        crossed(f"wall history, {model}", "history", of_model({name: {"wall-history": text} for name, text in TURNS.items()}),
                hows("chebyshev 1e-3", "extrapolated", "ida 1e-5", "mri"))
        crossed(f"force control, {model}", "load", of_model(LOADS), hows("dormand-prince 1e-6", "extrapolated", "ida 1e-5", "mri"))
        crossed(f"rough fields, {model}", "start", of_model(rough), hows("dormand-prince 1e-6", "extrapolated"))
        crossed(f"strain 2, {model}", "strain", of_model({2: {"duration": 40.5}, 0.5: {"duration": 10.125}}),
                (*FEW, "chebyshev 1e-3", "extrapolated"))
    crossed("elements, rough fields", "degree, start",
            {f"{degree}, {name}": {"space": "elements", "degree": degree, **start} for degree in DEGREES
             for name, start in {"the paper's": {}, **rough}.items()}, (*FEW, "dormand-prince 1e-6"))
    hows = (*FEW, "chebyshev 1e-3", "dormand-prince 1e-6", "extrapolated", "ida 1e-5", "mri")
    crossed("elements, walls", "walls", {name: {"space": "elements", "degree": 10, **walls} for name, walls in
                                         {**{name: {"wall-history": text} for name, text in TURNS.items()}, **LOADS}.items()}, hows)
    crossed("elements, points", "degree, points",
            {f"{degree}, {points}": {"space": "elements", "degree": degree, "cells": points, "model": model}
             for degree, points, model in ELEMENTS}, FEW)
    inclusion = {"plasticity": "perzyna", "initial": "gaussian", "initial-base": 0, "initial-amplitude": 0.01, "perzyna-hardening": 1e9}
    crossed("Perzyna", "law", {name: {**inclusion, **scene} for name, scene in PERZYNA.items()},
            (*FEW, "dormand-prince 1e-6", "substepped"))
    crossed("elastic", "walls", ELASTIC, (*FEW, "extrapolated"))
    crossed("corner", "corner width", {w: {"stz-corner": w} for w in CORNERS}, FEW)
    for model in BOTH:
        crossed(f"one point, {model}", "scene", {name: {"initial": "uniform", "model": model, **scene} for name, scene in UNIFORM.items()},
                HOW if model == "full" else FEW, point=True, limit=60)
    for solver in ("fourier", "cholesky"):
        for operator in ("exact", "full"):
            for how in ("auto", "incremental", "extrapolated", "substepped"):
                for cells in ("20", "17x24", "24x17"):
                    for name, start in {"paper": {}, "noise": rough["chi: noise 2 %"]}.items():
                        b.add("operators", {"solver": f"{solver}, {operator}", "run": f"{how}, {cells}, {name}"}, {"cells": cells, **start},
                              {**HOW[how], "equilibrium": solver, "operator": operator})
    for left in LEFT:
        for scheme in ("auto", *PROJECTION_SCHEMES):
            for operator in ("exact", "full") if scheme != "auto" else ("exact",):
                b.add("last step", {"scheme": f"{scheme}, {operator}", "part of a step": left},
                      {"duration": round((500 + left) * default_step(GRID), 12)}, {"scheme": scheme, "step": "fixed", "operator": operator})
    for model in BOTH:
        for scheme in SCHEMES:
            for factor in FACTORS if model == "full" else FACTORS[1:]:
                b.add(f"fixed steps, {model}", {"scheme": scheme, "step": factor}, {**SMALL, "model": model},
                      {"scheme": scheme, "step": "fixed", "factor": factor}, limit=60)
            for tolerance in TOLERANCES if scheme != "mri" else ():
                b.add(f"tolerance, {model}", {"scheme": scheme, "tolerance": tolerance}, {**SMALL, "model": model},
                      {"scheme": scheme, "tolerance": tolerance}, limit=60)
    return b


LABELS = {"step": "step over the default", "tolerance": "--tolerance"}


def draw(results, folder):
    """A heat map a map, and one of delivered error over tolerance."""
    by_map = {}
    for result in results:
        by_map.setdefault(result.case.map, []).append(result)
    for name, part in by_map.items():
        rows, columns = part[0].case.axes
        file = folder / f"stability_grid_{name.replace(', ', '_').replace(' ', '_')}.png"
        maps.heat_map(part, rows, columns, file, f"{name}: error of sigma/s_Y or chi/chi_inf, the larger", labels=LABELS)
        if name.startswith("tolerance"):
            rated = [result for result in part if result.case.axes["scheme"] in RATE_SCHEMES]
            ratio = lambda result: f"{result.delivered / (1e-4 if (t := result.case.axes['tolerance']) == 'auto' else t):.2g}"
            file = file.with_name(file.stem + "_ratio.png")
            maps.heat_map(rated, rows, columns, file, f"{name}: delivered error over --tolerance", ratio, LABELS)


def main():
    arguments = common.jobs_option(common.parser(__doc__, work="out/verification/stability_grid")).parse_args()
    b = book(write_fields(arguments.work / "fields"))
    references = find_references(b.scenes, arguments)
    results = maps.run_cases(list(b.cases(references)), arguments.program.parent, arguments.work, arguments.jobs)
    draw(results, arguments.results)
    worths = [(max(reference.worth[:2]), dict(key)) for key, reference in references.items() if reference]
    print("worst references:", *sorted(worths, key=lambda entry: -np.nan_to_num(entry[0], nan=9))[:12], sep="\n")
    print("without:", *[dict(key) for key, reference in references.items() if not reference], sep="\n")
    maps.publish(results, "stability_grid", arguments.results, "How far shear_band goes", __doc__.split("\n\n")[1])


if __name__ == "__main__":
    main()
