#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact of material points with rigid bodies: by the nodes that those hold, as in the paper, and by surfaces, against closed forms;
of bodies with each other; and a load on an edge.

    verification/contact.py            # a minute
"""

import math

import common
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from results import Run

GRAVITY, SLOPE = 10.0, math.radians(30.0)
SHAPES = ("linear", "gimp", "bspline")
METHODS = {"explicit": {"method": "explicit", "implicit-dt": "auto"}, "implicit": {"method": "implicit"}, "midpoint": {"method": "midpoint"}}

BLOCK = """carrier = "points"
cell-size = 0.05
duration = 1
snapshots = [0]
[grid]
bottom = -0.1
width = {width}
height = 0.6
[materials.stone]
law = "linear-elastic"
young-modulus = 1e7
poisson-ratio = 0.2
density = 1000
[[bodies]]
name = "block"
material = "stone"
shape = {{rectangle = [0.1, {bottom}, 0.5, {top}]}}
velocity = [0, {speed}]
[[rigid-bodies]]
name = "floor"
shape = {{rectangle = [0, -0.1, {width}, 0]}}
{contact}
[body-force]
acceleration = [{ax}, {ay}]
[[observables]]
name = "speed"
quantity = "velocity-x"
[[observables]]
name = "height"
quantity = "position-y"
take = "smallest"
"""
PAIR = """carrier = "points"
cell-size = 0.05
snapshots = [0]
[grid]
width = {width}
height = 0.7
[sides]
bottom = "{bottom}"
[materials.stone]
law = "linear-elastic"
young-modulus = 1e7
poisson-ratio = 0.2
density = 1000
[[bodies]]
name = "upper"
material = "stone"
shape = {{rectangle = [0.1, {from_}, 0.5, {to}]}}
velocity = [0, {speed}]
{contact}
[[bodies]]
name = "lower"
material = "stone"
shape = {{rectangle = [{left}, 0, {right}, 0.2]}}
{contact}
[body-force]
history = [[0, 0, 0], [0.1, {ax}, {ay}]]
[[observables]]
name = "height"
of = "upper"
quantity = "position-y"
take = "smallest"
[[observables]]
name = "top"
of = "lower"
quantity = "position-y"
take = "largest"
[[observables]]
name = "speed"
of = "upper"
quantity = "velocity-x"
[[observables]]
name = "fall"
of = "upper"
quantity = "velocity-y"
"""
NODES, SURFACE = 'holds = ["y"]', 'contact = "surface"\nfriction = {friction}'


def scene_file(work, name, text):
    path = work / f"{name}.toml"
    path.write_text(text)
    return path


def run(arguments, name, text, options):
    """The history of a scene's run."""
    folder = arguments.work / name
    common.run([arguments.program.parent / "scene", scene_file(arguments.work, name, text)], folder, options)
    return Run(folder)


def flow_load(way):
    """Of the billet of `upsetting` without friction: steel, bilinear, incompressible [N]."""
    young, yield_stress, hardening = 200e9, 0.7e9, 0.3e9
    height = 15e-3 - np.maximum(way - 1e-3, 0.0)
    strain = np.log(15e-3 / height)
    stress = np.minimum(young * strain, (yield_stress + hardening * strain) / (1.0 + hardening / young))
    return stress * math.pi * 1e-4 * 15e-3 / height


def upsetting(arguments):
    """Rows of the billet's load, and curves to draw."""
    rows, curves = [], {}
    for contact in ("nodes", "surface"):
        for shape in SHAPES:
            for cell, dt in ((1e-3, 1e-4), (1e-3, 2.5e-5), (5e-4, 2.5e-5)):
                options = {"shape": shape, "cell-size": cell, "dt": dt, "contact": contact, "snapshots": 0}
                if contact == "nodes":
                    options["frictionless"] = "true"
                folder = arguments.work / f"upsetting-{contact}-{shape}-{cell:g}-{dt:g}"
                common.run(arguments.program.parent / "upsetting", folder, options)
                history = Run(folder).history
                way, load = history["deflection_m"], history["load_N"]
                touching = way > 1.1e-3
                error = load[touching] / flow_load(way[touching]) - 1.0
                rows.append([contact, shape, f"{1e3 * cell:g}", f"{dt:g}", f"{1e-3 * abs(load[way < 1e-3]).max():.3g}",
                             f"{100 * error.mean():.2f}", f"{100 * abs(error).max():.2f}",
                             f"{1e-3 * abs(np.diff(load[touching])).max():.3g}"])
                if cell == 1e-3 and dt == 2.5e-5:
                    curves[f"{contact}, {shape}"] = way, load
    return rows, curves


def landing(arguments):
    """A block at 0.1 m/s: where it first feels the floor, and what pulls it when it leaves."""
    rows = []
    wave = 1000.0 * math.sqrt(1e7 / 1000.0)  # rho c
    for kind, contact in (("nodes", NODES), ("surface", SURFACE.format(friction=0))):
        for shape in SHAPES:
            for method in ("explicit", "implicit"):
                text = BLOCK.format(width=0.6, bottom=0.1, top=0.3, speed=-0.1, contact=contact, ax=0, ay=0)
                found = run(arguments, f"landing-{kind}-{shape}-{method}", text,
                            {"shape": shape, "duration": 1.6, "implicit-dt": 1e-4, "history-every": 1, **METHODS[method]}).history
                force, gap = found["floor_force_y_N"], found["height"] - 0.25 * 0.05
                acting = np.flatnonzero(abs(force) > 1e-3 * abs(force).max())
                rows.append([kind, shape, method, f"{gap[acting[0]] / 0.05:.3f}", f"{max(force.max(), 0.0) / (0.4 * wave * 0.1):.3f}"])
    return rows


def meeting(arguments):
    """The same of a block that lands on another: the force from the change of its speed."""
    rows = []
    wave = 1000.0 * math.sqrt(1e7 / 1000.0)  # rho c
    for kind, contact in (("nodes", ""), ("surface", 'contact = "surface"')):
        for shape in SHAPES:
            for method in METHODS:
                text = PAIR.format(width=0.6, bottom="slip", from_=0.3, to=0.5, speed=-0.1, left=0.1, right=0.5, contact=contact, ax=0, ay=0)
                found = run(arguments, f"meeting-{kind}-{shape}-{method}", text,
                            {"shape": shape, "duration": 1.6, "implicit-dt": 1e-4, "history-every": 1, **METHODS[method]}).history
                force = np.diff(found["fall"]) / np.diff(found["time_s"]) * 1000.0 * 0.4 * 0.2
                gap = (found["height"] - found["top"] - 0.5 * 0.05) / 0.05
                acting = np.flatnonzero(abs(force) > 1e-3 * abs(force).max())
                rows.append([kind, shape, method, f"{gap[acting[0]]:.3f}", f"{max(-force.min(), 0.0) / (0.4 * wave * 0.1):.3f}"])
    return rows


def pairs(arguments):
    """A block on another, on a slope, from when gravity is whole."""
    rows = []
    for friction in (0.0, 0.2, 0.4, 0.55, 0.6):
        expected = max(GRAVITY * (math.sin(SLOPE) - friction * math.cos(SLOPE)), 0.0)
        for shape in SHAPES:
            for method in METHODS:
                contact = f'contact = "surface"\nfriction = {friction}'
                text = PAIR.format(width=2.2, bottom="fixed", from_=0.2, to=0.4, speed=0, left=0, right=2.2, contact=contact,
                                   ax=GRAVITY * math.sin(SLOPE), ay=-GRAVITY * math.cos(SLOPE))
                found = run(arguments, f"pair-{friction:g}-{shape}-{method}", text,
                            {"shape": shape, "duration": 0.7, "implicit-dt": 2e-3, **METHODS[method]}).history
                late = found["time_s"] > 0.1
                rows.append([f"{friction:g}", shape, method, f"{np.polyfit(found['time_s'][late], found['speed'][late], 1)[0]:.4f}",
                             f"{expected:.4f}"])
    return rows


def slope(arguments):
    rows = []
    for friction in (0.0, 0.2, 0.4, 0.55, 0.6):
        expected = max(GRAVITY * (math.sin(SLOPE) - friction * math.cos(SLOPE)), 0.0)
        for shape in SHAPES:
            for method, options in METHODS.items():
                text = BLOCK.format(width=3.4, bottom=0, top=0.2, speed=0, contact=SURFACE.format(friction=friction),
                                    ax=GRAVITY * math.sin(SLOPE), ay=-GRAVITY * math.cos(SLOPE))
                found = run(arguments, f"slope-{friction:g}-{shape}-{method}", text, {"shape": shape, "implicit-dt": 2e-3, **options})
                rows.append([f"{friction:g}", shape, method, f"{found.history['speed'][-1]:.4f}", f"{expected:.4f}"])
    return rows


def thick_cylinder(snapshot):
    """Displacement of the outer surface, from C r + D/r fitted to what is elastic, and the radius of the plastic zone of this area."""
    x, y = snapshot["position"].T[:2]
    radius = np.hypot(x, y)
    way = (x * snapshot["displacement_x"] + y * snapshot["displacement_y"]) / radius
    elastic = radius > 0.13
    (c, d), *_ = np.linalg.lstsq(np.c_[radius, 1.0 / radius][elastic], way[elastic], rcond=None)
    plastic = snapshot["volume"][snapshot["plastic_strain"] > 1e-9].sum()
    return c * 0.2 + d / 0.2, math.sqrt(0.1**2 + 4.0 * plastic / math.pi)


def scenes(arguments):
    """The scene files: Hertz, the rolling cylinder, rings."""
    folder = arguments.program.resolve().parents[2] / "drivers" / "scenes"
    rows = []

    def scene(name, label, options):
        work = arguments.work / f"{name}-{label}"
        common.run([arguments.program.parent / "scene", folder / f"{name}.toml"], work, options)
        return Run(work).history

    modulus = 1e6 / (1.0 - 0.3**2)
    for shape in ("gimp", "bspline"):
        for cell in (0.1, 0.05, 0.025):
            history = scene("hertz", f"{shape}-{cell:g}", {"shape": shape, "cell-size": cell})
            low, high = 1.0, 1e6  # force of the whole cylinder
            for _ in range(100):
                force = math.sqrt(low * high)
                width = math.sqrt(4.0 * force / (math.pi * modulus))
                way = 2.0 * force / (math.pi * modulus) * (math.log(4.0 / width) - 0.5)
                low, high = (force, high) if way < history["way_m"][-1] else (low, force)
            rows.append(["Hertz: force [N/m]", f"{shape}, {cell:g} m", f"{2.0 * history['plate_force_y_N'][-1]:.5g}", f"{force:.5g}"])
    for cell in (0.1, 0.05, 0.025):
        history = scene("hertz-cylinders", f"{cell:g}", {"cell-size": cell})
        rows.append(["Hertz, two cylinders: force [N/m]", f"gimp, {cell:g} m", f"{-history['plane_force_y_N'][-1]:.5g}", "3477.3"])
    for shape in SHAPES:
        for side in (2, 3, 4):
            work = arguments.work / f"thick-cylinder-{shape}-{side}"
            common.run([arguments.program.parent / "scene", folder / "thick-cylinder.toml"], work,
                       {"shape": shape, "particles-per-side": side})
            way, radius = thick_cylinder(Run(work).snapshots[-1])
            how = f"{shape}, {side} x {side} particles a cell"
            rows.append(["thick cylinder: way outside [mm]", how, f"{1e3 * way:.5f}", "0.08721"])
            rows.append(["thick cylinder: plastic radius [mm]", how, f"{1e3 * radius:.2f}", "120.51"])
    for cell in (0.1, 0.05):
        for label, options in {"explicit": {}, "midpoint, affine": {"method": "midpoint", "transfer": "affine", "dt": 0.05 * cell}}.items():
            history = scene("rolling-cylinder", f"{label.split(',')[0]}-{cell:g}", {"cell-size": cell, **options})
            rows.append(["rolling cylinder: way [m]", f"{label}, {cell:g} m", f"{history['way_m'][-1]:.4f}", f"{5.001 / 3.0:.4f}"])
    return rows


def main():
    arguments = common.parser(__doc__, work="out/verification/contact").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    billet, curves = upsetting(arguments)
    parts = {
        "Upsetting without friction, against homogeneous compression (a gap of 1 mm; force before it closes; error and jumps after)":
            (["contact", "shape functions", "cells [mm]", "dt [s]", "before contact [kN]", "mean error [%]", "largest [%]",
              "largest jump [kN]"], billet),
        "A block that lands at 0.1 m/s and leaves: gap at which it first feels the floor [cells], largest pull [rho c v]":
            (["contact", "shape functions", "method", "gap", "pull"], landing(arguments)),
        "A block on a slope of 30 degrees: speed after a second [m/s], against g (sin - mu cos) t":
            (["friction", "shape functions", "method", "speed", "closed form"], slope(arguments)),
        "A block that lands on another at 0.1 m/s: gap at which it first feels that [cells], largest pull [rho c v]":
            (["contact", "shape functions", "method", "gap", "pull"], meeting(arguments)),
        "A block on another on this slope, once gravity has grown for 0.1 s: acceleration [m/s^2], against g (sin - mu cos)":
            (["friction", "shape functions", "method", "acceleration", "closed form"], pairs(arguments)),
        "Scenes": (["what", "how", "found", "closed form"], scenes(arguments)),
    }
    text = f"# Contact\n\n{common.provenance()}\n"
    for title, (header, rows) in parts.items():
        text += f"\n{title}:\n\n{common.markdown_table(header, rows)}"
    common.publish(arguments.results, "contact", text, ["what", "numbers"],
                   [[title.split(":")[0].split(",")[0], " ".join(map(str, row))] for title, (_, rows) in parts.items() for row in rows])
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), sharey=True, layout="constrained")
    for axis, shape in zip(axes, SHAPES):
        for contact, style in (("nodes", "C1-"), ("surface", "C0-")):
            way, load = curves[f"{contact}, {shape}"]
            axis.plot(1e3 * way, 1e-3 * load, style, linewidth=1, label=contact)
        axis.plot(1e3 * way, 1e-3 * flow_load(way), "k--", linewidth=0.8, label="closed form")
        axis.set_xlabel("way of the platen [mm]")
        axis.set_title(f"{shape}, 1 mm cells")
    axes[0].set_ylabel("load [kN]")
    axes[0].legend()
    figure.savefig(arguments.results / "contact.png", dpi=100)


if __name__ == "__main__":
    main()
