#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far material points go, and whether they say so. Each run is judged by maps.py's classes.

What is promised:
- Solvers and preconditioners of one method, form and shape solve one problem, to 1e-3 (--newton-tolerance bounds forces, 1e-6).
- Steps promise their order: where half the step changes the end by more than a tenth, a warning must say so.
- A bar that slips at its ends has the stress of a point, within 1e-2; once it has crossed cells, within the cells that a rigid body's
  edge is known to, twice one over the bar's length; where nothing damps them, give or take the waves that a sudden grip sends out.
- Energies grow by no more than a tenth beyond the work done; explicit steps, too. The stress stays at most at yield, det F above zero,
  the particles stay all. What floats has its momentum, and its centre moves with it.
- Nobody has a promise where elasticity at small strain has no meaning: where the density has doubled or halved, a warning must say so.
- Locking, numerical fracture and too few particles may be wrong by a tenth, and beyond that must be warned of.
- Surfaces that touch: what the floor got is what the block lost, a slope rubs as Coulomb says within 1e-2, nothing goes deeper than a
  twentieth of a cell without a warning.

    verification/stability_points.py         # some 20 minutes on two cores
"""

import dataclasses
import functools
import hashlib
import json
import re

import common
import maps
import numpy as np
from results import Run

METHODS = ("explicit", "implicit", "midpoint", "quasi-static")
FORMS = ("velocity", "momentum")
SHAPES = ("linear", "gimp", "bspline")
SOLVERS = ("newton-cg", "newton-gmres", "kinsol-gmres", "kinsol-fgmres", "kinsol-bicgstab", "kinsol-cg")
PRECONDITIONERS = ("none", "diagonal", "tangent", "auto")
GEOMETRIES = ("plane-strain", "plane-stress", "axisymmetric")
POISSON = (0.3, 0.45, 0.49, 0.499, 0.4999)
WAYS = tuple((method, form) for method in METHODS for form in FORMS if (method, form) != ("quasi-static", "momentum"))
STEPS = "step|longer|shorter|energy|strain in one"  # what a warning about time says
SPACE = "lock|fracture|particles a cell|smaller cells|let go"  # and one about space
ANY = f"{STEPS}|{SPACE}"
CROSSED = "crossed into other cells"  # says that stresses are off by tens of per cent
STRESS = f"{ANY}|{CROSSED}"
DEEP = "surface|deep"  # says that rigid bodies' surfaces were crossed
BESIDE = "holds nodes half a cell beyond"  # B-splines: says that stresses in the row beside a rigid body are off by their own size


# --- scenes ----------------------------------------------------------------------------------------------------------------


def toml(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + "}"
    return json.dumps(value)


def scene(grid, sides, materials, bodies, rigid=(), gravity=None, observables=()):
    """TOML of a scene of points without the options."""
    lines = ['carrier = "points"']

    def table(head, entries):
        lines.extend([head, *(f"{key} = {toml(entry)}" for key, entry in entries.items())])

    table("[grid]", grid)
    table("[sides]", sides)
    for name, material in materials.items():
        table(f"[materials.{name}]", material)
    for head, tables in (("[[bodies]]", bodies), ("[[rigid-bodies]]", rigid), ("[[observables]]", observables)):
        for entries in tables:
            table(head, entries)
    if gravity is not None:
        table("[body-force]", {"acceleration": gravity})
    return "\n".join(lines) + "\n"


METAL = {"law": "von-mises", "young-modulus": 1000.0, "poisson-ratio": 0.3, "density": 10.0, "yield-stress": 6.0, "hardening": 200.0}
ELASTIC = {"law": "linear-elastic", "young-modulus": 1000.0, "poisson-ratio": 0.3, "density": 10.0}
CELL = 0.1  # of all scenes here [m]; sound takes 0.01 s through it


def bar(cells, across, material, speed, geometry="plane-strain", sticks=False, room=1.0):
    """A bar along y between its plane of symmetry and a grip that moves at `speed`; half of it in x. `room` beside it, of its width."""
    length, width = cells * CELL, across * CELL
    high = cells + 3 + round(cells if speed > 0 else 0)
    wide = across + 2 + round(room * across if speed < 0 else 0)
    grip = {"name": "grip", "shape": {"rectangle": [0, length, wide * CELL, length + CELL]}, "velocity": [0, speed],
            "holds": ["x", "y"] if sticks else ["y"]}
    return scene({"geometry": geometry, "width": wide * CELL, "height": high * CELL},
                 {"left": "slip", "bottom": "fixed" if sticks else "slip"}, {"metal": material},
                 [{"name": "bar", "material": "metal", "shape": {"rectangle": [0, 0, width, length]}}], [grip])


# --- what a run left -------------------------------------------------------------------------------------------------------


class State:
    """A snapshot, by default the last; SI."""

    def __init__(self, folder, index=-1):
        snapshot = Run(folder).snapshots[index]
        self.id, self.time = snapshot["id"], snapshot.time
        self.position, self.density, self.material = (snapshot[name] for name in ("position", "density", "material"))
        self.velocity = np.stack([snapshot["velocity_x"], snapshot["velocity_y"]], axis=1)
        self.xx, self.yy, self.zz, self.xy = (snapshot[f"stress_{name}"] for name in ("xx", "yy", "zz", "xy"))
        self.plastic = snapshot["plastic_strain"] if "plastic_strain" in snapshot.names else np.zeros(self.id.size)

    @property
    def stress(self):
        return np.stack([self.xx, self.yy, self.zz, np.sqrt(2) * self.xy])

    @property
    def mises(self):
        return np.sqrt(0.5 * ((self.xx - self.yy)**2 + (self.yy - self.zz)**2 + (self.zz - self.xx)**2) + 3 * self.xy**2)


def states(folder):
    return [State(folder, index) for index in range(len(Run(folder).snapshots))]


def rms(array):
    return float(np.sqrt(np.mean(np.square(array)))) if np.size(array) else 0.0


def over(difference, size):
    return difference / size if size > 0 else (0.0 if difference == 0 else np.inf)


@dataclasses.dataclass
class Finding:
    """One thing that an oracle looked at."""

    error: float
    promised: float
    what: str
    about: str = "$^"  # no warning speaks of it


def work_of(history, parameters):
    """Of the rigid bodies on the particles, and the sum of the magnitudes of its parts [J]."""
    parts = np.zeros(history["dt_s"].size)
    for body in parameters["rigid-bodies"] if "rigid-bodies" in parameters else []:
        for axis, name in enumerate("xy"):
            if "history" in body:
                knots = np.array(body["history"])
                middle = history["time_s"] - 0.5 * history["dt_s"]
                speed = knots[np.searchsorted(knots[:, 0], middle, side="right") - 1, 1 + axis]  # constant between knots
            else:
                speed = body["velocity"][axis]
            parts -= history[f"{body['name'].replace(' ', '_')}_force_{name}_N"] * history["dt_s"] * speed
    return parts.sum(), np.abs(parts).sum()


def sound(folder):
    """What holds for every run."""
    summary, history = common.summary(folder), Run(folder).history
    parameters = summary["parameters"]
    first, last = State(folder, 0), State(folder)
    found = [Finding(abs(last.time / float(parameters["duration"]) - 1), 1e-9, "time of the end"),
             Finding(float(not np.array_equal(first.id, last.id)), 0.5, "the particles' numbers"),
             Finding(float(history["smallest_determinant"].min() <= 0), 0.5, "det F")]
    denser = float(np.abs(np.log2(last.density / first.density)).max())
    found.append(Finding(denser, 1.0, "density, in doublings", "speed|volume|denser|density"))
    laws = list(parameters["materials"].values())
    for number in np.unique(last.material):
        law, mine = laws[int(number)], last.material == number
        if law["law"] == "von-mises":
            hardened = law["yield-stress"] + law["hardening"] * np.minimum(last.plastic[mine], law["limit-strain"])
            found.append(Finding(float((last.mises[mine] / hardened).max() - 1), 1e-6, "stress beyond yield"))
    if not parameters.get("body-force", {}).get("history") and parameters.get("body-force", {}).get("acceleration", [0, 0]) == [0, 0]:
        inertia = parameters["method"] != "quasi-static"
        energy = history["internal_energy_J"] + (history["kinetic_energy_J"] if inertia else 0)
        work, magnitude = work_of(history, parameters)
        gained = energy[-1] - energy[0] - work
        stiffest = max(law["young-modulus"] for law in laws)
        nothing = 1e-24 * stiffest * first.id.size * float(parameters["cell-size"])**2  # that of a stress of 1e-12 E
        found.append(Finding(over(max(gained, 0), max(energy[0], magnitude, nothing)), 0.1, "energy from nowhere", "too much|stable"))
    return found


def worst(found):
    one = max(found, key=lambda finding: np.inf if np.isnan(finding.error) else finding.error / finding.promised)
    return maps.Judgement(float(one.error), float(one.promised), one.what, about=one.about)


# --- oracles ---------------------------------------------------------------------------------------------------------------


def differences(folder, other, promised, note, about="--newton-tolerance"):
    """Of two runs of one scene: stress, displacement, velocity, plastic strain; of their own sizes."""
    start, a, b = State(folder, 0), State(folder), State(other)
    stress = over(rms(a.stress - b.stress), rms(b.stress))
    moved = over(rms(a.position - b.position), rms(b.position - start.position))
    plastic = over(rms(a.plastic - b.plastic), max(rms(b.plastic), 1e-9))
    return [Finding(stress, promised, f"stress{note}", about), Finding(moved, promised, f"displacement{note}", about),
            Finding(plastic, promised, f"plastic strain{note}", about)]


def means(folder, other, promised, about, note):
    """The same of means, where particles that cross cells scatter: mean stress, over the largest mean or equivalent stress of the run's
    snapshots (what oscillates passes through zero) or a twentieth of the impact stress sqrt(E rho) v, the largest; displacement, over
    itself or half the way that the velocity of the start goes, the larger (what rebounds is back where it began at some time); mean plastic
    strain. A warning of crossed cells speaks of up to half of the stress, and of a fifth of what follows from it."""
    start, a, b = State(folder, 0), State(folder), State(other)
    laws = list(common.summary(folder)["parameters"]["materials"].values())
    impact = max(np.sqrt(law["young-modulus"] * law["density"]) for law in laws) * rms(start.velocity)
    size = max(0.05 * impact, *(max(rms(one.mises), float(np.linalg.norm(one.stress.mean(axis=1)))) for one in states(other)))
    stress = over(float(np.linalg.norm(a.stress.mean(axis=1) - b.stress.mean(axis=1))), size)
    way = max(rms(b.position - start.position), 0.5 * rms(start.velocity) * b.time)
    moved = over(rms(a.position - b.position), way)
    plastic = over(abs(a.plastic.mean() - b.plastic.mean()), max(b.plastic.mean(), 1e-9))
    crossed = lambda error, most: f"{about}|{CROSSED}" if error <= most else about
    return [Finding(stress, promised, f"mean stress{note}", crossed(stress, 0.5)),
            Finding(moved, promised, f"displacement{note}", crossed(moved, 0.2)),
            Finding(plastic, promised, f"mean plastic strain{note}", crossed(plastic, 0.2))]


def against_half(folder, other):
    return means(folder, other, 0.1, ANY, " at half the step")


def against_solver(folder, other):
    """Where a solver fails and the step is cut, the answer differs by what the step's length makes, and a warning about that speaks of it."""
    if common.summary(folder)["steps"] == common.summary(other)["steps"]:
        return differences(folder, other, 1e-3, " against another solver")
    return differences(folder, other, 0.1, " against another solver, with other steps", STEPS)


@functools.cache
def point(E, nu, Y, H, strain, geometry):
    """Axial stress and plastic strain of a point that is strained along y with free sides, by small steps of the rates; logarithmic strain.
    In plane strain nothing moves across."""
    if geometry != "plane-strain":
        size = abs(strain)
        beyond = max(size - Y / E, 0.0)
        return np.sign(strain) * (Y + E * H / (E + H) * beyond if beyond else E * size), E / (E + H) * beyond
    lame, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
    elastic = lame * np.ones((3, 3)) + 2 * mu * np.eye(3)
    steps, stress, plastic = 20000, np.zeros(3), 0.0  # xx, yy, zz
    for _ in range(steps):
        deviator = stress - stress.mean()
        mises = np.sqrt(1.5) * np.linalg.norm(deviator)
        tangent, flow = elastic, None
        if mises >= Y + H * plastic:
            flow = 1.5 * deviator / mises
            tangent = elastic - np.outer(elastic @ flow, elastic @ flow) / (flow @ elastic @ flow + H)
        along = strain / steps
        across = -tangent[0, 1] / tangent[0, 0] * along
        change = np.array([across, along, 0.0])
        if flow is not None:
            plastic += flow @ elastic @ change / (flow @ elastic @ flow + H)
        stress = stress + tangent @ change
    return stress[1], plastic


def uniaxial(folder, material, geometry, strain, promised, about="$^", moving=0.0):
    """The half away from the grip against the point; `moving` is what inertia may add to the stress [Pa]."""
    start, last = State(folder, 0), State(folder)
    E, nu = material["young-modulus"], material["poisson-ratio"]
    Y, H = material.get("yield-stress", np.inf), material.get("hardening", 0.0)
    stress, plastic = point(E, nu, Y, H, float(np.log1p(strain)), geometry)
    far = start.position[:, 1] < 0.5 * start.position[:, 1].max()
    error = np.array([last.yy[far] - stress, last.xx[far]])
    promise = promised + over(moving, abs(stress))
    bspline = common.summary(folder)["parameters"]["shape"] == "bspline"
    if bspline:  # they hold a node beyond a rigid body's edge, which is half a cell of the bar's length, or all that is left of it
        about = f"{about}|{BESIDE}"
    mean = over(float(np.linalg.norm(error.mean(axis=1))), abs(stress))
    found = [Finding(mean, promise, "mean stress against the point", about),
             Finding(over(rms(error), abs(stress)), 3 * promise, "stress against the point", about)]
    if plastic > 1e-4:
        strained = abs(last.plastic[far].mean() - plastic) / plastic
        found.append(Finding(strained, 2 * promise, "plastic strain against the point", about))
    return found


# --- cases -----------------------------------------------------------------------------------------------------------------


@dataclasses.dataclass
class Entry:
    map: str
    axes: dict
    program: str
    text: str | None  # of a scene
    options: dict
    judge: object     # of folder and the other run's folder (or None): findings
    other: dict | None = None  # options of a run of the same scene, to compare with
    limit: float = 60.0       # [s]


class Book:
    def __init__(self):
        self.entries = []

    def add(self, name, axes, judge, options, text=None, program="scene", **more):
        common_options = {"snapshots": f"0,{options['duration']:.17g}", "history-every": 1}
        if more.pop("watched", False):
            common_options["snapshots-every"] = options["duration"] / 20
        if text is not None:
            common_options["cell-size"] = CELL
        if more.get("other") is not None:
            duration = more["other"].get("duration", options["duration"])
            more["other"] = {**common_options, "snapshots": f"0,{duration:.17g}", **more["other"]}
        self.entries.append(Entry(name, axes, program, text, {**common_options, **options}, judge, **more))

    def others(self):
        """{key: case} of the runs that others are compared with."""
        found = {}
        for entry in self.entries:
            if entry.other is not None:
                options = {key: entry.other[key] for key in sorted(entry.other)}
                label = hashlib.sha256(f"{entry.program} {entry.text}".encode()).hexdigest()[:8]
                axes = {"scene": label, **{k: v for k, v in options.items() if k not in ("snapshots", "history-every")}}
                found[self.key(entry)] = maps.Case("others", axes, entry.program, options, lambda folder: maps.Judgement(0, 1), entry.text,
                                                   4 * entry.limit)
        return found

    def key(self, entry):
        return json.dumps([entry.program, entry.text, sorted(entry.other.items())])

    def cases(self, others):
        for entry in self.entries:
            other = others.get(self.key(entry)) if entry.other is not None else None
            yield maps.Case(entry.map, entry.axes, entry.program, entry.options, oracle_of(entry, other), entry.text, entry.limit)


def oracle_of(entry, other):
    def oracle(folder):
        lost = entry.other is not None and (other is None or other.status != 0)
        found = sound(folder) + (entry.judge(folder, other.folder if other else None) if not lost else [])
        judgement = worst(found)
        return dataclasses.replace(judgement, note=f"{judgement.note}; the other run failed") if lost else judgement
    return oracle


def solvers(b):
    """Every combination of what solves a step on a bar and a billet, which stick to what holds them and yield."""
    scenes = {"bar": (bar(6, 2, METAL, -0.006, sticks=True), {"duration": 2.0, "dt": 0.4}),
              "billet": (bar(6, 4, METAL, -0.06, "axisymmetric", sticks=True), {"duration": 1.0, "dt": 0.1})}
    for name, (text, run) in scenes.items():
        for shape in SHAPES:
            for method, form in (*WAYS, ("quasi-static", "momentum")):
                options = {**run, "shape": shape, "method": method, "form": form}
                if method == "explicit":
                    b.add(f"solvers, {name}", {"way": f"{method}, {form}, {shape}", "solver": "none"},
                          against_half, {**options, "dt": 0.002}, text, other={**options, "dt": 0.001})
                    continue
                for solver in SOLVERS:
                    for preconditioner in PRECONDITIONERS:
                        hopeless = method == "quasi-static" and form == "momentum" or form == "momentum" and solver.endswith("cg")
                        if hopeless and (preconditioner != "none" or shape != "linear" or solver not in ("newton-cg", "kinsol-cg")):
                            continue  # refused: once is enough
                        b.add(f"solvers, {name}", {"way": f"{method}, {form}, {shape}", "solver": f"{solver}, {preconditioner}"},
                              against_solver,
                              {**options, "solver": solver, "preconditioner": preconditioner}, text,
                              other={**options, "solver": "newton-gmres", "preconditioner": "tangent", "newton-tolerance": 1e-9})


FACTORS = (0.1, 0.3, 1, 3, 10, 100, 1000, 10000)  # of the explicit step


def steps(b):
    """Steps from a tenth of the explicit one to ten thousand times it, against half of each."""
    scenes = {  # program, text, step, shortest duration, options
        "plastic bar": ("plastic_bar", None, 0.004778, 2.0, {}),
        "elastic bar": ("elastic_bar", None, 0.00484, 2.0, {}),
        "upsetting": ("upsetting", None, 9.5585e-8, 2e-3, {}),
        "bar that slips": ("scene", bar(8, 2, METAL, 0.0064), 0.0045, 1.0, {}),
        "billet": ("scene", bar(6, 4, METAL, -0.06, "axisymmetric", sticks=True), 0.0045, 1.0, {}),
        "vibrating bar": ("vibrating_bar", None, 0.048, 4.0, {}),
        "disks": ("scene", disks(0.001), 0.0243, 40.0, {"cell-size": 0.05})}
    for name, (program, text, unit, duration, more) in scenes.items():
        few = 4000 if name != "disks" else 6000
        for method, form in WAYS:
            if method == "quasi-static" and name in ("vibrating bar", "disks"):
                continue  # nothing holds them
            for factor in FACTORS:
                if method == "explicit" and factor > 100:
                    continue
                if name == "disks" and factor < 0.3:
                    continue  # they do not meet within these steps
                if name == "upsetting" and (factor < 10 if method != "explicit" else factor < 1):
                    continue  # a minute each
                dt = factor * unit
                options = {"method": method, "form": form, "dt": dt, "duration": max(min(duration, few * dt), 2.02 * dt), **more}
                halves = {**options, "dt": dt / 2}
                if text is None:
                    options["snapshots"] = halves["snapshots"] = f"0,{options['duration']:.17g}"
                b.add(f"steps, {name}", {"way": f"{method}, {form}", "step over the explicit one": factor}, against_half, options, text,
                      program, other=halves, limit=120, watched=True)


def strains(b):
    """A bar that slips at its ends, pulled and pressed by up to three quarters; and into one column of cells."""
    runs = [(method, shape, per_side) for shape in SHAPES
            for method, per_side in (("implicit", 1), ("implicit", 2), ("implicit", 4), ("midpoint", 2), ("quasi-static", 2))]
    cells = 24
    for geometry in GEOMETRIES:
        for strain in (0.08, 0.33, 0.75, -0.08, -0.33, -0.75):
            for method, shape, per_side in runs:
                promised = 0.01 + 2 / cells / (1 + strain)
                # the midpoint rule keeps the wave that the grip sends out, rho c v, back and forth
                moving = 2 * 10.0 * 10.0 * 0.024 if method == "midpoint" else 0.0
                judge = lambda folder, other, g=geometry, e=strain, p=promised, add=moving: uniaxial(folder, METAL, g, e, p, STRESS, add)
                options = {"method": method, "shape": shape, "particles-per-side": per_side, "dt": 0.5, "dt-start": 0.05}
                b.add(f"strain, {geometry}", {"nominal strain": f"{strain:+.0%}", "run": f"{method}, {shape}, {per_side} x {per_side}"},
                      judge, {**options, "duration": 100 * abs(strain)}, bar(cells, 4, METAL, np.sign(strain) * 0.024, geometry, room=4.0))
    for cells in (2, 3, 4):
        for shape in SHAPES:
            for method in METHODS:
                for per_side in (2, 4):
                    left = 0.9  # cells
                    strain = left / cells - 1
                    judge = lambda folder, other, e=strain: uniaxial(folder, METAL, "plane-stress", e, 0.5, STRESS)
                    options = {"method": method, "shape": shape, "particles-per-side": per_side,
                               "dt": 3e-3 if method == "explicit" else 0.2}
                    b.add("into one column", {"cells": f"{cells}, {per_side} x {per_side}", "run": f"{method}, {shape}"}, judge,
                          {**options, "duration": -50 * strain}, bar(cells, 2, METAL, -0.002 * cells, "plane-stress", room=3.0))
    for geometry in GEOMETRIES[:2]:
        for direction in ("tension", "compression"):
            for duration in (100, 225):
                for shape in SHAPES:
                    options = {"geometry": geometry, "direction": direction, "duration": duration, "dt": 0.5, "dt-start": 0.0048,
                               "shape": shape}
                    b.add("the paper's bar", {"load": f"{geometry}, {direction}, {duration / 3:.0f} %", "shape": shape}, against_finer,
                          options, program="plastic_bar", other={**options, "shape": "gimp", "cell-size": 0.05, "dt": 0.25})


def against_finer(folder, other):
    """The mean axial stress of the paper's bar on finer cells: to the cells that a grip's edge is known to, a third."""
    key = "mean_stress_xx_Pa"
    if any(re.search(SPACE, warning) for warning in common.summary(other)["warnings"]):
        return []
    a, b = Run(folder).history[key][-1], Run(other).history[key][-1]
    return [Finding(abs(a - b) / abs(b), 0.35, "mean stress against finer cells", f"{STRESS}|{BESIDE}")]


def poisson(b):
    """Nearly incompressible: the bar that slips against the point, and a block on its base against
    cells of a quarter with one particle each, which do not lock."""
    for nu in POISSON:
        for shape in SHAPES:
            for per_side in (1, 2, 3, 6):
                axes = {"Poisson's ratio": nu, "run": f"{shape}, {per_side} x {per_side}"}
                metal = {**METAL, "poisson-ratio": nu}
                for method in ("implicit", "quasi-static"):
                    judge = lambda folder, other, m=metal: uniaxial(folder, m, "plane-strain", 0.008, 0.03, STRESS)
                    options = {"shape": shape, "particles-per-side": per_side, "method": method, "dt": 0.5, "duration": 10.0}
                    b.add(f"Poisson, bar, {method}", axes, judge, options, bar(8, 2, metal, 0.00064))
                block = {**ELASTIC, "poisson-ratio": nu}
                text = hanging(block)
                options = {"shape": shape, "particles-per-side": per_side, "method": "quasi-static", "dt": 1.0, "duration": 1.0}
                b.add("Poisson, block", axes, against_block, options, text,
                      other={**options, "shape": "gimp", "particles-per-side": 1, "cell-size": CELL / 4})
                if per_side < 4:
                    options = {"poisson-ratio": nu, "shape": shape, "dt": 0.1, "particles-per-side": per_side, "duration": 24}
                    b.add("Poisson, the paper's bar", axes, against_finer, options, program="plastic_bar",
                          other={**options, "shape": "bspline", "particles-per-side": 2, "cell-size": 0.025, "dt": 0.2})


def hanging(material):
    """A block whose base is fixed, in weight towards it and aside; it does not reach the other sides."""
    return scene({"geometry": "plane-strain", "width": 1.2, "height": 0.8}, {"bottom": "fixed"}, {"metal": material},
                 [{"name": "block", "material": "metal", "shape": {"rectangle": [0.2, 0, 1.0, 0.4]}}], gravity=[0.02, -0.05])


def against_block(folder, other):
    """Mean displacement, and the root mean square of the mean stress: what locking spoils."""
    (a0, a), (b0, b) = ((State(f, 0), State(f)) for f in (folder, other))
    moved_a, moved_b = (a.position - a0.position).mean(axis=0), (b.position - b0.position).mean(axis=0)
    mean = lambda state: rms((state.xx + state.yy + state.zz) / 3)
    moved = float(np.linalg.norm(moved_a - moved_b) / np.linalg.norm(moved_b))
    return [Finding(moved, 0.1, "displacement against finer cells", SPACE),
            Finding(abs(mean(a) / mean(b) - 1), 0.25, "mean stress (rms) against finer cells", SPACE)]


def yields(b):
    for ratio in (1e-6, 1e-4, 1e-3, 3e-3, 1e-2, 1.0, 1e300):
        for hardening in (0.0, 0.2, 5.0, 1e3):
            for method, form in WAYS:
                metal = {**METAL, "yield-stress": ratio * 1000.0, "hardening": hardening * 1000.0}
                moving = 0.0 if method == "quasi-static" else 2 * 10.0 * 10.0 * 0.00064  # rho c v, back and forth
                judge = lambda folder, other, m=metal, add=moving: uniaxial(folder, m, "plane-stress", 0.008, 0.01, STRESS, add)
                options = {"method": method, "form": form, "dt": 0.003 if method == "explicit" else 0.25, "duration": 10.0}
                b.add(f"yield, {method}, {form}", {"hardening over E": hardening, "yield stress over E": ratio}, judge, options,
                      bar(8, 2, metal, 0.00064, "plane-stress"))


def contrasts(b):
    """Two materials in a body, one after the other and side by side, without Poisson's effect: the force is that of springs."""
    cells, strain = 8, 0.008
    length = cells * CELL
    for ratio in (1e-6, 1e-3, 1.0, 1e3, 1e6):
        E = 1000.0 * max(1.0, 1 / ratio), 1000.0 * max(1.0, ratio)  # sound takes 0.1 s through the softer half
        first, second = ({**ELASTIC, "poisson-ratio": 0.0, "young-modulus": modulus} for modulus in E)
        for layout in ("series", "parallel"):
            parts = {"first": [0, 0, 0.4, length / 2] if layout == "series" else [0, 0, 0.2, length],
                     "second": [0, length / 2, 0.4, length] if layout == "series" else [0.2, 0, 0.4, length]}
            grip = {"name": "grip", "shape": {"rectangle": [0, length, 0.6, length + CELL]}, "velocity": [0, strain * length / 10],
                    "holds": ["y"]}
            text = scene({"width": 0.6, "height": length + 3 * CELL}, {"left": "slip", "bottom": "slip"},
                         {"first": first, "second": second},
                         [{"name": name, "material": name, "shape": {"rectangle": part}} for name, part in parts.items()], [grip])
            for shape in SHAPES:
                for method in ("implicit", "quasi-static"):
                    for preconditioner in PRECONDITIONERS:
                        judge = lambda folder, other, e=E, lay=layout, s=shape: springs(folder, *e, lay, strain, s)
                        b.add(f"contrast, {layout}",
                              {"run": f"{method}, {shape}, {preconditioner}", "stiffness of the second over the first": ratio}, judge,
                              {"shape": shape, "method": method, "preconditioner": preconditioner, "dt": 2.0, "duration": 10.0}, text,
                              limit=20)


def springs(folder, first, second, layout, strain, shape):
    """Linear functions know where cells end, and so do materials here; the others smear the interface over a cell, of eight."""
    last = State(folder)
    promised = 0.02 if shape == "linear" else 0.3
    load = abs(Run(folder).history["grip_force_y_N"][-1])
    if layout == "series":
        stress = strain / (0.5 / first + 0.5 / second)
        found = [Finding(abs(load / (0.4 * stress) - 1), promised, "load against springs", ANY)]
        if shape == "linear":
            found.append(Finding(rms(last.yy - stress) / stress, promised, "stress against springs", ANY))
        return found
    load_expected = 0.2 * strain * (first + second)
    return [Finding(abs(load / load_expected - 1), promised, "load against springs", ANY)]


def loads(b):
    """Problems whose answer must scale with the load: a bar's speed, and a column's weight."""
    for factor in (1e-9, 1e-6, 1e-3, 1.0, 10.0, 100.0):
        strain = 0.008 * factor
        crossed = 8 * strain > 0.2  # of a cell
        promised = 0.03 + (2 / 8 / (1 + strain) if crossed else 0)
        for shape in SHAPES:
            for method, form in WAYS:
                moving = 0.0 if method == "quasi-static" else 2 * 10.0 * 10.0 * 0.00064 * factor
                axes = {"speed over the usual": f"{factor:g}", "run": f"{method}, {form}, {shape}"}
                options = {"method": method, "form": form, "shape": shape}
                for name, material in (("elastic", ELASTIC), ("plastic", METAL)):
                    judge = lambda folder, other, m=material, e=strain, p=promised, add=moving: uniaxial(
                        folder, m, "plane-stress", e, p, STRESS, add)
                    if name == "elastic" or shape == "linear":
                        b.add(f"speed, {name}", axes, judge, {**options, "dt": 0.003 if method == "explicit" else 0.5, "duration": 10.0},
                              bar(8, 2, material, 0.00064 * factor, "plane-stress"))
                if method in ("implicit", "quasi-static"):  # the others ring for ever
                    weight = 0.0625 * factor
                    b.add("weight", {"weight over the usual": f"{factor:g}", "run": f"{method}, {form}, {shape}"},
                          lambda folder, other, g=weight: column(folder, g), {**options, "dt": 5.0, "duration": 100.0},
                          scene({"width": 0.6, "height": 2.0}, {"left": "slip", "bottom": "slip"},
                                {"metal": {**ELASTIC, "poisson-ratio": 0.0}},
                                [{"name": "column", "material": "metal", "shape": {"rectangle": [0, 0, 0.4, 1.6]}}], gravity=[0, -weight]))


def column(folder, weight):
    """sigma_yy is the weight above, and by linear functions constant in a cell, a sixteenth of the height; shortened by its strain."""
    start, last = State(folder, 0), State(folder)
    stress = -10.0 * weight * (1.6 - start.position[:, 1])
    strain = 10.0 * weight * 1.6 / 1000.0
    return [Finding(rms(last.yy - stress) / rms(stress), 0.05 + 2 * strain, "stress against the weight above", ANY)]


def speeds(b):
    """Impact at up to a hundred times the usual speed, against half the step."""
    for factor in (1, 10, 30, 100):
        for shape in SHAPES:
            for method, form in WAYS:
                if method == "quasi-static":
                    continue
                axes = {"run": f"{method}, {form}, {shape}", "speed over the usual": factor}
                options = {"shape": shape, "method": method, "form": form}
                dt = (1.5e-8 if method == "explicit" else 2e-7) * min(1.0, 3 / factor)  # two thirds of the stable one
                bar_options = {**options, "speed": 227 * factor, "duration": 1e-5 / factor, "dt": dt}
                b.add("taylor bar", axes, against_half, bar_options, program="taylor_bar", other={**bar_options, "dt": dt / 2},
                      watched=True)
                duration = 40 / factor
                dt = min(0.024 if method == "explicit" else 0.24, duration / 100)
                options = {**options, "duration": duration, "dt": dt, "cell-size": 0.05}
                b.add("disks", axes, lambda folder, other: against_half(folder, other) + balanced(folder), options,
                      disks(0.001 * factor), other={**options, "dt": dt / 2}, watched=True)


def disks(speed):
    """Elastic disks 0.08 m apart that meet."""
    disk = lambda name, x, v: {"name": name, "material": "metal", "shape": {"disk": [x, x, 0.2]}, "velocity": [v, v]}
    return scene({"finite-rotation": False, "width": 1.0, "height": 1.0}, {}, {"metal": {**ELASTIC, "density": 1000.0}},
                 [disk("lower", 0.33, speed), disk("upper", 0.67, -speed)])


def balanced(folder):
    """Particles of one mass whose mean velocity is zero: explicit steps keep it to round-off, others to --newton-tolerance, 1e-6."""
    kept = 1e-9 if common.summary(folder)["parameters"]["method"] == "explicit" else 1e-6
    return [Finding(float(np.abs(State(folder).velocity.mean(axis=0)).max()) / rms(State(folder, 0).velocity), kept, "momentum")]


OFFSETS = (0.0, 1e-12, -1e-12, 1e-8, -1e-8, 1e-4, -1e-4, 1e-2, -1e-2)  # of a cell, from an edge


def write_particles(file, **given):
    """A CSV file of particles, four a cell by volume."""
    x = given["x"]
    table = {**given, "volume": np.full(x.size, CELL**2 / 4)}
    np.savetxt(file, np.stack(list(table.values()), axis=1), "%.17g", ",", header=",".join(table), comments="")
    return str(file)


def edges(b, folder):
    """Particles almost on the edges of cells: a bar in its first mode whose last column lies there, and bodies that float and fall."""
    folder.mkdir(parents=True, exist_ok=True)
    cells, v0 = 16, 0.01
    length = cells * CELL
    for offset in OFFSETS:
        x = np.append((np.arange(2 * cells - 1) + 0.5) / 2, cells + offset) * CELL
        x, y = (field.ravel() for field in np.meshgrid(x, (np.arange(6) + 0.5) / 2 * CELL))
        file = write_particles(folder / f"bar {offset:g}.csv", x=x, y=y, velocity_x=v0 * np.sin(np.pi * x / 2 / length))
        vibrating = scene({"finite-rotation": False, "width": 2.0, "height": 0.3}, {"left": "slip", "bottom": "slip", "top": "slip"},
                          {"metal": {**ELASTIC, "poisson-ratio": 0.0}}, [{"name": "bar", "material": "metal", "particles": file}])
        x, y = (field.ravel() + offset * CELL for field in np.meshgrid(np.arange(4, 11) * CELL / 2, np.arange(10, 17) * CELL / 2))
        file = write_particles(folder / f"float {offset:g}.csv", x=x, y=y, velocity_x=np.full(x.size, 0.03),
                               velocity_y=np.full(x.size, -0.02))
        for method, form in WAYS:
            for shape in SHAPES:
                axes = {"run": f"{method}, {form}, {shape}", "cells from an edge": f"{offset:g}"}
                options = {"method": method, "form": form, "shape": shape}
                if method != "quasi-static":
                    b.add("edges, vibrating", axes, lambda folder, other: first_mode(folder, v0, length),
                          {**options, "dt": 0.002, "duration": 0.16}, vibrating)
                for name, gravity in (("translation", 0.0), ("fall", -0.05)):
                    if method == "quasi-static" and (name == "fall" or offset):
                        continue
                    floating = scene({"width": 2.0, "height": 1.2}, {}, {"metal": ELASTIC},
                                     [{"name": "block", "material": "metal", "particles": file}], gravity=[0, gravity])
                    b.add(f"edges, {name}", axes, lambda folder, other, g=gravity: falls(folder, g, 0.003),
                          {**options, "dt": 0.003, "duration": 4.0}, floating)


def first_mode(folder, v0, length):
    """A quarter of a period after the start: T is 0.64 s. The stress of every particle, those of little mass, too."""
    start, last = State(folder, 0), State(folder)
    E, speed = 1000.0, 10.0
    k = np.pi / 2 / length
    stress = E * k * v0 / (k * speed) * np.cos(k * start.position[:, 0]) * np.sin(k * speed * last.time)
    size = np.abs(stress).max()
    return [Finding(float(np.abs(last.xx - stress).max()) / size, 0.15, "stress against the first mode", ANY),
            Finding(rms(last.xx - stress) / size, 0.06, "stress (rms) against the first mode", ANY)]


def falls(folder, gravity, dt):
    """Nothing strains what falls: stress below 1e-9 E; velocity to the tolerance of Newton's method; way to half a step."""
    start, last = State(folder, 0), State(folder)
    t = last.time
    velocity = start.velocity + [0, gravity * t]
    late = abs(gravity) * t * dt / CELL
    way = start.position + start.velocity * t + [0, 0.5 * gravity * t * t]
    return [Finding(float(np.abs(last.stress).max()) / 1000.0, 1e-9, "stress of what floats over E", ANY),
            Finding(float(np.abs(last.velocity - velocity).max()) / 0.03, 1e-5, "velocity of what floats", ANY),
            Finding(float(np.abs(last.position - way).max()) / CELL, 1e-5 + late, "way of what floats, in cells", ANY)]


def grips(b):
    """All of a bar, also what lies beside its grip."""
    for geometry in GEOMETRIES:
        for shape in SHAPES:
            for per_side in (1, 2, 3, 4):
                judge = lambda folder, other, g=geometry: beside_grip(folder, g)
                options = {"shape": shape, "particles-per-side": per_side, "method": "quasi-static", "dt": 0.5, "duration": 10.0}
                b.add("beside a grip", {"run": f"{shape}, {per_side} x {per_side}", "geometry": geometry}, judge, options,
                      bar(8, 2, METAL, 0.00064, geometry))


def beside_grip(folder, geometry):
    last = State(folder)
    stress = point(1000.0, 0.3, 6.0, 200.0, float(np.log1p(0.008)), geometry)[0]
    return [Finding(float(np.abs(last.yy - stress).max()) / stress, 0.1, "stress of the worst particle", f"{ANY}|{BESIDE}"),
            Finding(rms(last.yy - stress) / stress, 0.05, "stress (rms)", f"{ANY}|{BESIDE}")]


def tolerances(b):
    scenes = {"bar that slips": bar(8, 2, METAL, 0.0064), "billet": bar(6, 4, METAL, -0.06, "axisymmetric", sticks=True)}
    for tolerance in (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-30):
        for name, text in scenes.items():
            for solver in ("newton-cg", "newton-gmres", "kinsol-gmres"):
                for method, form in WAYS:
                    if method == "explicit" or form == "momentum" and solver.endswith("cg"):
                        continue
                    options = {"method": method, "form": form, "dt": 0.1, "duration": 1.0, "solver": solver}
                    promised = min(max(1e-4, 1e3 * tolerance), 0.1)
                    judge = lambda folder, other, p=promised: differences(folder, other, p, " against a tolerance of 1e-9")
                    b.add(f"tolerance, {name}", {"run": f"{method}, {form}, {solver}", "--newton-tolerance": f"{tolerance:g}"}, judge,
                          {**options, "newton-tolerance": tolerance}, text,
                          other={**options, "solver": "newton-gmres", "newton-tolerance": 1e-9})


def growing(gravity):
    """The table of a body force that grows over the first second; nothing without one."""
    return f"[body-force]\nhistory = [[0, 0, 0], [1, {gravity[0]}, {gravity[1]}]]\n" if gravity else ""


def floor(block, gap, speed, friction=0.0, gravity=None, width=1.2):
    """A block of 0.4 m by 0.2 m above a floor whose surface it touches; gravity grows over a second."""
    text = scene({"bottom": -0.1, "width": width, "height": 0.7}, {}, {"metal": block},
                 [{"name": "block", "material": "metal", "shape": {"rectangle": [0.2, gap, 0.6, gap + 0.2]}, "velocity": [0, speed]}],
                 [{"name": "floor", "shape": {"rectangle": [0, -0.1, width, 0]}, "contact": "surface", "friction": friction}])
    return text + growing(gravity)


def couple(gap, speed, friction=0.0, gravity=None, width=1.2):
    """Two such blocks, of which the upper one falls on the other, that floats; or lies on a long one, whose base is fixed."""
    contact = {"contact": "surface", "friction": friction}
    lower = [0.0, 0.0, width, 0.2] if gravity else [0.2, 0.3, 0.6, 0.5]
    top = lower[3] + gap
    text = scene({"width": width, "height": 1.0}, {"bottom": "fixed"} if gravity else {}, {"metal": ELASTIC},
                 [{"name": "upper", "material": "metal", "shape": {"rectangle": [0.2, top, 0.6, top + 0.2]}, "velocity": [0, speed], **contact},
                  {"name": "lower", "material": "metal", "shape": {"rectangle": lower}, **contact}])
    return text + growing(gravity)


def meets(folder):
    """Two blocks of one mass keep their momentum."""
    start, last = State(folder, 0), State(folder)
    change = float((last.velocity - start.velocity)[:, 1].mean())
    return [Finding(abs(change) / np.abs(start.velocity).max(), 1e-4, "momentum of both"),
            Finding(common.summary(folder)["extra"]["deepest_contact_cells"], 0.05, "cells within the other", DEEP)]


def touches(folder):
    """The floor got the momentum that the block lost (steps that end in the run know it to Newton's tolerance), and the block is above it."""
    history, start, last = Run(folder).history, State(folder, 0), State(folder)
    mass = 10.0 * 0.4 * 0.2
    lost = mass * float((start.velocity - last.velocity)[:, 1].mean())
    got = float((history["floor_force_y_N"] * history["dt_s"]).sum())
    return [Finding(abs(got - lost) / (mass * rms(start.velocity)), 1e-4, "momentum that the floor got"),
            Finding(common.summary(folder)["extra"]["deepest_contact_cells"], 0.05, "cells below the floor", DEEP)]


def contacts(b):
    """Surfaces: a block that lands and leaves, one on a slope, both on another block, a bar between plates, and a tool that cuts in."""
    for method, form in WAYS:
        for shape in SHAPES:
            options = {"method": method, "form": form, "shape": shape}
            if form == "momentum" and method != "explicit":  # refused: once is enough
                b.add("contact, slope", {"run": f"{method}, {form}, {shape}, 0.003 s", "friction": "0"}, lambda folder, other: [],
                      {**options, "dt": 0.003, "duration": 6.0}, floor(ELASTIC, 0.0, 0.0, 0.0, [0.05, -0.05 * np.sqrt(3)], 2.6))
                continue
            if method != "quasi-static":
                for factor in (1e-6, 1e-2, 1, 10, 100):  # of a strain of a hundredth
                    speed = 0.1 * factor
                    gap = 0.1 * CELL
                    duration = gap / speed + 0.12
                    dt = min(0.003 if method == "explicit" else 0.006, 0.3 * CELL / speed)
                    dt = max(dt, duration / 20000)  # what waits longest
                    if method == "explicit" and dt > 0.003:
                        continue
                    judge = lambda folder, other: against_half(folder, other) + touches(folder)
                    run = {**options, "dt": dt, "duration": duration}
                    b.add("contact, landing", {"run": f"{method}, {form}, {shape}", "speed": f"{speed:g}"}, judge, run,
                          floor(ELASTIC, gap, -speed), other={**run, "dt": dt / 2}, watched=True)
                for factor in FACTORS[:6]:
                    dt = 0.0045 * factor
                    if method == "explicit" and factor > 3:
                        continue
                    run = {**options, "dt": dt, "duration": max(0.22, 2.02 * dt)}
                    judge = lambda folder, other: against_half(folder, other) + touches(folder)
                    b.add("contact, steps", {"run": f"{method}, {form}, {shape}", "step over the explicit one": factor}, judge, run,
                          floor(ELASTIC, 0.1 * CELL, -0.1), other={**run, "dt": dt / 2}, watched=True)
                for friction in (0, 1e-3, 0.2, 0.5, 0.57, 0.585, 1.0, 100.0):
                    for dt in (0.003,) if method == "explicit" else (0.003, 0.03):
                        judge = lambda folder, other, mu=friction: slides(folder, mu)
                        b.add("contact, slope", {"run": f"{method}, {form}, {shape}, {dt} s", "friction": f"{friction:g}"}, judge,
                              {**options, "dt": dt, "duration": 6.0},
                              floor(ELASTIC, 0.0, 0.0, friction, [0.05, -0.05 * np.sqrt(3)], 2.6))
            if method != "quasi-static":
                for speed in (1e-3, 0.1, 10.0):
                    duration = 0.1 * CELL / speed + 0.12
                    dt = max(min(0.003 if method == "explicit" else 0.006, 0.3 * CELL / speed), duration / 20000)
                    judge = lambda folder, other: against_half(folder, other) + meets(folder)
                    run = {**options, "dt": dt, "duration": duration}
                    b.add("contact, two blocks", {"run": f"{method}, {form}, {shape}", "speed": f"{speed:g}"}, judge, run,
                          couple(0.1 * CELL, -speed), other={**run, "dt": dt / 2}, watched=True)
                for friction in (0, 0.2, 0.5, 1.0, 100.0):
                    for dt in (0.003,) if method == "explicit" else (0.003, 0.03):
                        judge = lambda folder, other, mu=friction: slides(folder, mu)
                        b.add("contact, block on block", {"run": f"{method}, {form}, {shape}, {dt} s", "friction": f"{friction:g}"}, judge,
                              {**options, "dt": dt, "duration": 6.0},
                              couple(0.0, 0.0, friction, [0.05, -0.05 * np.sqrt(3)], 2.6), limit=120)
            for geometry in GEOMETRIES:
                for strain in (-0.008, -0.08, -0.33, -0.6):
                    judge = lambda folder, other, g=geometry, e=strain, waves=method != "quasi-static": pressed(folder, g, e, waves)
                    run = {**options, "dt": 0.003 if method == "explicit" else 0.25, "duration": 33.3 * abs(strain)}
                    b.add("contact, between plates", {"run": f"{method}, {form}, {shape}", "strain": f"{geometry}, {strain:+.0%}"}, judge,
                          run, between_plates(METAL, strain, geometry))
            for friction in (0, 0.3, 100.0):
                for tool in ("disk", "corner"):
                    dt = 0.003 if method == "explicit" else 0.05
                    run = {**options, "dt": dt, "duration": 4.0}
                    judge = lambda folder, other: means(folder, other, 0.1, STRESS, " at half the step")
                    b.add("contact, tool", {"run": f"{method}, {form}, {shape}", "tool": f"{tool}, {friction:g}"}, judge, run,
                          indented(tool, friction), other={**run, "dt": dt / 2}, watched=True)


def slides(folder, friction):
    """Gravity 0.1 m/s2 on a slope of 30 degrees, which grows over the first second of six; of the first body."""
    last = State(folder)
    speed = max(0.05 - friction * 0.05 * np.sqrt(3), 0.0) * 5.5
    return [Finding(abs(float(last.velocity[last.id < 32, 0].mean()) - speed) / 0.275, 0.01, "speed down the slope", ANY),
            Finding(common.summary(folder)["extra"]["deepest_contact_cells"], 0.05, "cells below the slope", DEEP)]


def between_plates(material, strain, geometry):
    """A bar of 8 by 2 cells on its plane of symmetry under a plate without friction; half of it in x."""
    length, width, wide = 8 * CELL, 2 * CELL, 6 * CELL
    plate = {"name": "grip", "shape": {"rectangle": [0, length, wide, length + CELL]}, "velocity": [0, np.sign(strain) * 0.024],
             "contact": "surface"}
    return scene({"geometry": geometry, "width": wide, "height": length + 3 * CELL}, {"left": "slip", "bottom": "slip"},
                 {"metal": material}, [{"name": "bar", "material": "metal", "shape": {"rectangle": [0, 0, width, length]}}], [plate])


def pressed(folder, geometry, strain, waves):
    """The half away from the plate against the point, to what half a cell less of the bar's length makes, and the plate's wave."""
    exact, more = (point(1000.0, 0.3, 6.0, 200.0, float(np.log1p(part * strain)), geometry) for part in (1.0, 1.0 + 0.5 / 8))
    last, start = State(folder), State(folder, 0)
    far = start.position[:, 1] < 0.4
    wave = 2 * 10.0 * 10.0 * 0.024 if waves else 0.0
    promised = abs(more[0] - exact[0]) + 0.01 * abs(exact[0]) + wave
    error = np.array([last.yy[far] - exact[0], last.xx[far]])
    found = [Finding(float(np.linalg.norm(error.mean(axis=1))), promised, "mean stress against the point [Pa]", STRESS),
             Finding(rms(error), 3 * promised, "stress against the point [Pa]", STRESS)]
    if not waves:
        found.append(Finding(abs(last.plastic[far].mean() - exact[1]), abs(more[1] - exact[1]) + 0.01 * exact[1],
                             "plastic strain against the point", STRESS))
    return found + [Finding(common.summary(folder)["extra"]["deepest_contact_cells"], 0.05, "cells below the plate", DEEP)]


def indented(tool, friction):
    """A block of plastic metal on a base that a tool enters by a cell and leaves."""
    shapes = {"disk": {"disk": [0.6, 0.6, 0.2]}, "corner": {"polygon": [[0.45, 0.4], [0.75, 0.4], [0.85, 0.7], [0.35, 0.7]]}}
    body = {"name": "grip", "shape": shapes[tool], "contact": "surface", "friction": friction}
    text = scene({"width": 1.2, "height": 1.2}, {"bottom": "fixed"}, {"metal": METAL},
                 [{"name": "block", "material": "metal", "shape": {"rectangle": [0.2, 0, 1.0, 0.4]}}])
    entries = "\n".join(f"{key} = {toml(value)}" for key, value in body.items())
    return text + f"[[rigid-bodies]]\n{entries}\nhistory = [[0, 0, -0.04], [2.5, 0, -0.04], [2.5, 0, 0.04], [4, 0, 0.04]]\n"


def build(work):
    b = Book()
    for chapter in (solvers, steps, strains, poisson, yields, contrasts, loads, speeds, grips, tolerances, contacts):
        chapter(b)
    edges(b, work.resolve() / "particles")
    return b


def draw(results, folder):
    """A heat map a map."""
    by_map = {}
    for result in results:
        by_map.setdefault(result.case.map, []).append(result)
    for name, part in by_map.items():
        rows, columns = part[0].case.axes
        slug = name.replace("'", "").replace(", ", "_").replace(" ", "_")
        maps.heat_map(part, rows, columns, folder / f"stability_points_{slug}.png", f"{name}: the worst error that the oracle saw")


def main():
    arguments = common.jobs_option(common.parser(__doc__, work="out/verification/stability_points")).parse_args()
    b = build(arguments.work)
    others = b.others()
    keys = list(others)
    done = dict(zip(keys, maps.run_cases([others[key] for key in keys], arguments.program.parent, arguments.work, arguments.jobs)))
    results = maps.run_cases(list(b.cases(done)), arguments.program.parent, arguments.work, arguments.jobs)
    draw(results, arguments.results)
    maps.publish(results, "stability_points", arguments.results, "How far material points go", __doc__.split("\n\n")[1])


if __name__ == "__main__":
    main()
