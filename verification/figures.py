#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 1, 2, 4, 9, 10, 11 and 13 of Sulsky & Kaul and the numbers that the paper quotes from them: stress along the bars, the
colliding disks, the billet by step and by mesh, Newton iterations where particles cross cells.

The other figures: Fig. 3 is drawn by energy.py, Fig. 12 by upsetting.py. Figs. 9b to 9d show residuals by iteration, which the
programs do not record. Runs are kept in the work folder.

    verification/figures.py           # a minute
"""

import types

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle
from matplotlib.tri import Triangulation

import common
import tables
from results import Run

# --- the paper's scenes and numbers ----------------------------------------------------------------------------------------

YOUNG, YIELD_STRESS, HARDENING = 1000.0, 6.0, 5000.0  # of the bars [Pa]
BAR_LENGTH, GRIP_SPEED = 0.3, 1e-3                    # [m], [m/s]
GRIP_LEFT, BAR_LEFT, BAR_BOTTOM = 0.3, 0.4, 0.1       # [m]; the grip is a cell wide and as high as the bar, 0.3 m
BAR_CELL = 0.1                                        # [m]
POISSON = (0, 0.3)                                    # what gives the printed stress, and what the paper states
BARS = {  # times of Figs. 1b and 4 [s], printed last stress [Pa]
    "elastic": ([1, 2, 3, 4, 5, 6, 7, 8, 9, 10], 34.5),  # the first steps from there on are those printed, 1.13, 2.36, 3.34, ...
    "plastic": ([2, 5, 7, 10, 12, 14, 17, 19, 22, 24], 68.5),
}
BAR_STEPS = {"dt": 0.5, "dt-start": 0.005, "step-growth": 1.2}  # they meet the printed times

DISK_RADIUS, DISK_SPEED, DISK_CENTRE, DISK_CELL = 0.2, 1e-3, 0.27, 0.05  # [m], [m/s] in x and in y; the centre is not printed
PRINTED_IMPACT = 75.0                                                    # [s]
DISKS = {"explicit": {"method": "explicit", "dt": "auto", "stable-step": "bar"}, "mu = 1, dt = 0.02438 s": {"dt": 0.02438},
         "mu = 1, dt = 0.2438 s": {"dt": 0.2438}, "mu = 1, dt = 2.438 s": {"dt": 2.438},
         "midpoint, dt = 0.2438 s": {"method": "midpoint", "dt": 0.2438}}
DRAWN_DISKS = "mu = 1, dt = 0.02438 s"
DISK_TIMES = (25.0, 75.0, 100.0, 150.0)  # [s]

BILLET_RADIUS, BILLET_HEIGHT = 10e-3, 15e-3  # [m]
PLATEN, PLATEN_SPEED = 16e-3, 1.0            # lower face at the start [m]; downwards [m/s]
BILLET_END = 9.5e-3                          # [s]
PRINTED_RADIUS = 16.5e-3                     # [m], of the explicit run
BILLET_STEPS, REFINED_STEP = (1e-6, 1e-5, 1e-4, 1e-3), 1e-4  # [s]
BILLET_CELLS = (1e-3, 5e-4, 2.5e-4)                          # [m], with REFINED_STEP

CROSSING_STEP, CROSSING_DURATION = 0.004778, 100.0  # [s]
PRINTED_PEAKS = {12694: 46, 25402: 15}              # Newton iterations of the steps that took more than ten
AFTER_CROSSING = 1.0                                # [s] in which a crossing may be felt
PAPER_WAY = tables.PAPER | tables.GMRES | {"newton-tolerance": 1e-6, "linear-tolerance": 1e-4}  # of Table V
BILLET_TOLERANCES = {"newton-tolerance": 1e-4, "linear-tolerance": 1e-2}                        # of Table VI
VARIATIONS = {"as drawn": {}, "Newton tolerance 1e-4": {"newton-tolerance": 1e-4}, "Newton tolerance 1e-7": {"newton-tolerance": 1e-7},
              "velocity form": {"form": "velocity"}, "Poisson's ratio 0": {"poisson-ratio": 0}, "dt = 0.05 s": {"dt": 0.05},
              "dt = 0.5 s": {"dt": 0.5}}

HEADER = ["figure", "quantity", "case", "paper", "here"]


def times(values):
    return ",".join(f"{value:g}" for value in values)


def load(folder):
    """All snapshots of a run with their fields by name and the particles in the order of their numbers."""
    return [types.SimpleNamespace(time=snapshot.time, **{name: snapshot[name] for name in snapshot.names})
            for snapshot in Run(folder).snapshots]


def nearest(snapshots, moment):
    return min(snapshots, key=lambda snapshot: abs(snapshot.time - moment))


def draw_mesh(axis, right, top, cell):
    for x in np.arange(0, right + cell / 2, cell):
        axis.plot([x, x], [0, top], color="0.85", linewidth=0.6, zorder=0)
    for y in np.arange(0, top + cell / 2, cell):
        axis.plot([0, right], [y, y], color="0.85", linewidth=0.6, zorder=0)


# --- Figs. 1 and 4: the bars -----------------------------------------------------------------------------------------------


def closed_form(bar, strain):
    """Uniaxial stress [Pa] under the engineering strain."""
    elastic = YOUNG * strain
    hardened = YIELD_STRESS + YOUNG * HARDENING / (YOUNG + HARDENING) * (strain - YIELD_STRESS / YOUNG)
    return elastic if bar == "elastic" else np.minimum(elastic, hardened)


def along_the_middle(snapshot):
    """Places [m] and stresses [Pa] of the two rows of particles on either side of the middle, each pair averaged."""
    middle = BAR_BOTTOM + BAR_LENGTH / 2
    rows = np.abs(snapshot.position[:, 1] - middle) < BAR_CELL / 2
    order = np.argsort(snapshot.position[rows, 0])
    pairs = lambda values: values[rows][order].reshape(-1, 2).mean(axis=1)
    return pairs(snapshot.position[:, 0]), pairs(snapshot.stress_xx)


def draw_bar(axis, start):
    draw_mesh(axis, 0.7, 0.5, BAR_CELL)
    axis.add_patch(Rectangle((GRIP_LEFT, BAR_BOTTOM), BAR_CELL, BAR_LENGTH, facecolor="0.9", edgecolor="0.4", hatch="///", linewidth=0.8))
    axis.annotate("", (GRIP_LEFT - 0.14, 0.25), (GRIP_LEFT - 0.01, 0.25), arrowprops={"arrowstyle": "-|>", "color": "black"})
    axis.text(GRIP_LEFT - 0.075, 0.27, "1 mm/s", ha="center")
    axis.text(GRIP_LEFT + BAR_CELL / 2, 0.43, "rigid body", ha="center")
    axis.text(BAR_LEFT + BAR_LENGTH / 2 + 0.03, 0.43, "bar", ha="center")
    axis.plot(*start.position.T, "o", color="C0", markersize=4)
    axis.plot([0.7, 0.7], [0, 0.5], color="black", linewidth=3, solid_capstyle="butt")
    axis.text(0.69, 0.03, "no slip", ha="right")
    axis.set(title="(a) initial configuration", xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-0.01, 0.72), ylim=(-0.01, 0.51))


def bars(run, results):
    figure, axes = plt.subplots(2, 3, figsize=(13, 7.6), layout="constrained")
    colours = plt.colormaps["viridis"](np.linspace(0, 0.88, 10))
    table, numbers = [], []
    for row, (bar, (wanted, printed)) in enumerate(BARS.items()):
        for column, poisson in enumerate(POISSON, start=1):
            options = {**BAR_STEPS, "poisson-ratio": poisson, "duration": wanted[-1], "snapshots": times([0, *wanted])}
            folder = run(f"{bar}_bar", f"{bar}-bar-{poisson}", options)
            start, *snapshots = load(folder)
            history = Run(folder).history
            axis = axes[row, column]
            for colour, snapshot in zip(colours, snapshots):
                expected = closed_form(bar, GRIP_SPEED * snapshot.time / BAR_LENGTH)
                axis.axhline(expected, color=colour, linewidth=0.8, linestyle=":")
                axis.plot(*along_the_middle(snapshot), "o-", color=colour, markersize=3.5, linewidth=1.2, label=f"{snapshot.time:.2f}")
            letter, kind = "bcef"[2 * row + column - 1], {"elastic": "elastic", "plastic": "elastic-plastic"}[bar]
            axis.set(title=f"({letter}) {kind} bar, Poisson's ratio {poisson}", xlabel="x [m]",
                     xlim=(BAR_LEFT - 0.02, BAR_LEFT + BAR_LENGTH), ylim=(0, 50 if bar == "elastic" else 105))
            if column == 1:
                axis.set_ylabel(r"stress $\sigma_{xx}$ in the middle rows [Pa]")
            else:
                handles, labels = axis.get_legend_handles_labels()
                axis.legend(handles[::-1], labels[::-1], title="time [s]", fontsize=8, title_fontsize=9, loc="center left",
                            bbox_to_anchor=(1.0, 0.5), frameon=False)
            axes[1, 0].plot(100 * history["nominal_strain"], history["mean_stress_xx_Pa"], color=f"C{row}",
                            linestyle="--" if poisson else "-", label=f"{bar}, Poisson's ratio {poisson}")
            last = snapshots[-1]
            strain, stress = GRIP_SPEED * last.time / BAR_LENGTH, last.stress_xx
            table.append([bar, poisson, f"{last.time:.2f}", f"{100 * strain:.2f}", f"{printed}", f"{closed_form(bar, strain):.2f}",
                          f"{stress.mean():.2f}", f"{stress.min():.2f} to {stress.max():.2f}"])
            figure_number, case = {"elastic": "1b", "plastic": "4"}[bar], f"Poisson's ratio {poisson}, t = {last.time:.2f} s"
            numbers += [[figure_number, "last mean stress [Pa]", case, printed, f"{stress.mean():.4f}"],
                        [figure_number, "uniaxial closed form [Pa]", case, printed, f"{closed_form(bar, strain):.4f}"]]
            if bar == "plastic":
                at_eight = np.interp(0.08, history["nominal_strain"], history["mean_stress_xx_Pa"])
                case = f"Poisson's ratio {poisson}, strain 8 %"
                numbers += [[figure_number, "mean stress [Pa]", case, printed, f"{at_eight:.4f}"],
                            [figure_number, "uniaxial closed form [Pa]", case, printed, f"{closed_form(bar, 0.08):.4f}"]]
        axes[1, 0].plot(100 * history["nominal_strain"], closed_form(bar, history["nominal_strain"]), "k:", linewidth=2,
                        label="uniaxial closed forms" if bar == "plastic" else None)
    draw_bar(axes[0, 0], start)
    axes[1, 0].set(title="(d) mean stress of the bar", xlabel="engineering strain [%]", ylabel=r"stress $\sigma_{xx}$ [Pa]",
                   xlim=(0, 8.5), ylim=(0, 105))
    axes[1, 0].legend(fontsize=9)
    figure.savefig(results / "bars.png", dpi=130)
    plt.close(figure)

    printed = BARS["plastic"][1]
    strain_of_printed = YIELD_STRESS / YOUNG + (printed - YIELD_STRESS) * (YOUNG + HARDENING) / (YOUNG * HARDENING)
    text = "## Figs. 1 and 4: the bars\n\n[bars.png](bars.png)\n\n"
    text += common.markdown_table(["bar", "Poisson's ratio", "t [s]", "strain [%]", "paper [Pa]", "uniaxial closed form [Pa]",
                                   "mean stress [Pa]", "of all particles [Pa]"], table)
    text += (f"\nFirst step {BAR_STEPS['dt-start']} s, growing by 20 % to {BAR_STEPS['dt']} s; the steps that reach t = 1, 2, ..., 10 s "
             "then end at the times printed, 1.13, 2.36, 3.34, ..., 10.34 s. At 8 % strain the closed form of the plastic bar is "
             f"{closed_form('plastic', 0.08):.2f} Pa; the printed {printed} Pa belong to {100 * strain_of_printed:.2f} %.\n\n"
             "The strain is the engineering one, as the grid is reset in every step and no particle leaves its cell. Poisson's ratio 0 "
             "gives uniaxial stress, but for the contraction that plastic flow brings. With the stated 0.3 a bar with free sides bears "
             f"{1 / (1 - 0.3**2):.2f} times as much in plane strain, and more where the ends, which may not contract, hold it: it is as "
             "high as long.\n")
    return text, numbers


# --- Fig. 2: the disks -----------------------------------------------------------------------------------------------------


def disks(run, results):
    around_impact = np.arange(60, 70, 0.5)
    taken = times([0, DISK_TIMES[0], *around_impact, *DISK_TIMES[1:]])
    folders = {case: run("colliding_disks", f"disks-{number}", {**options, "snapshots": taken})
               for number, (case, options) in enumerate(DISKS.items())}
    table, numbers = [], []
    for case, folder in folders.items():
        history, snapshots = Run(folder).history, load(folder)
        lower = snapshots[0].position.sum(axis=1) < 1
        strain_energy = history["strain_energy_J"]
        felt = history["time_s"][strain_energy > 0.01 * history["total_energy_J"][0]][0]
        impact = history["time_s"][np.argmax(strain_energy)]
        kept = history["total_energy_J"][-1] / history["total_energy_J"][0]
        rebound = abs(snapshots[-1].velocity_x[lower].mean()) / DISK_SPEED
        centre = {wanted: nearest(snapshots, wanted).position[lower, 0].mean() for wanted in (0, *DISK_TIMES)}
        table.append([case, f"{felt:.1f}", f"{impact:.1f}", f"{kept:.4f}", f"{rebound:.3f}",
                      *(f"{value:.4f}" for value in centre.values())])
        numbers += [["2", "time of largest strain energy [s]", case, PRINTED_IMPACT, f"{impact:.4f}"],
                    ["2", "energy left at t = 150 s of that at the start", case, "", f"{kept:.6f}"],
                    ["2", "speed after over speed before", case, "", f"{rebound:.6f}"]]
        numbers += [["2", f"centre of the lower disk at t = {wanted:g} s [m]", case, "", f"{value:.6f}"]
                    for wanted, value in centre.items()]
        if case == DRAWN_DISKS:
            drawn, drawn_impact, drawn_lower = snapshots, impact, lower

    figure, axes = plt.subplots(2, 2, figsize=(9.2, 9.4), sharex=True, sharey=True, layout="constrained")
    shown = (DISK_TIMES[0], drawn_impact, *DISK_TIMES[2:])
    for letter, axis, wanted in zip("abcd", axes.flat, shown):
        snapshot = nearest(drawn, wanted)
        draw_mesh(axis, 1.0, 1.0, DISK_CELL)
        for part, colour in ((drawn_lower, "C0"), (~drawn_lower, "C3")):
            axis.plot(*snapshot.position[part].T, "o", color=colour, markersize=2.6)
            centre = snapshot.position[part].mean(axis=0)
            velocity = np.array([snapshot.velocity_x[part].mean(), snapshot.velocity_y[part].mean()])
            if np.abs(velocity).max() > 0.1 * DISK_SPEED:
                axis.annotate("", centre + 0.15 * velocity / DISK_SPEED, centre,
                              arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.8, "mutation_scale": 16, "shrinkA": 0})
        axis.set(title=f"({letter}) t = {snapshot.time:.1f} s", aspect="equal", xlim=(0, 1), ylim=(0, 1))
    for axis in axes[1]:
        axis.set_xlabel("x [m]")
    for axis in axes[:, 0]:
        axis.set_ylabel("y [m]")
    figure.suptitle(f"{DRAWN_DISKS}; arrows: mean velocity of a disk")
    figure.savefig(results / "disks.png", dpi=130)
    plt.close(figure)

    approach = 2 * np.sqrt(2) * DISK_SPEED
    touch = (np.sqrt(2) * (1 - 2 * DISK_CENTRE) - 2 * DISK_RADIUS) / approach
    numbers.append(["2", "time at which the outlines would touch [s]", f"centres at {DISK_CENTRE} and {1 - DISK_CENTRE}",
                    PRINTED_IMPACT, f"{touch:.4f}"])
    text = "\n## Fig. 2: the disks\n\n[disks.png](disks.png)\n\n"
    text += common.markdown_table(["method", "first felt [s]", "largest strain energy [s]", "energy left", "speed after over before",
                                   *(f"x at {wanted:g} s [m]" for wanted in (0, *DISK_TIMES))], table)
    text += ("\n\"First felt\": the strain energy exceeds a hundredth of the energy. x: mean of the lower disk's particles; y is the "
             f"same. Impact, at the largest strain energy: {drawn_impact:.1f} s with {DRAWN_DISKS}. The outlines would touch at "
             f"{touch:.1f} s only; the velocity field of the grid joins the disks while {approach * (touch - drawn_impact):.3f} m are "
             f"between them (diagonal of a cell: {np.sqrt(2) * DISK_CELL:.3f} m).\n\n"
             f"The paper shows the impact at t = {PRINTED_IMPACT:g} s and prints no centres. Here they are ({DISK_CENTRE}, "
             f"{DISK_CENTRE}) and ({1 - DISK_CENTRE}, {1 - DISK_CENTRE}); the paper's must have been about "
             f"{1e3 * DISK_SPEED * (PRINTED_IMPACT - drawn_impact):.0f} mm further out in x and in y. The figure shows the impact when "
             "it happens here. The paper finds its figure unchanged by the step; here that holds until the impact, after which the "
             "speed is what the energy taken by the step (Fig. 3) leaves.\n")
    return text, numbers


# --- Figs. 10, 11 and 13: the billet ---------------------------------------------------------------------------------------


def lattice(start, cell):
    """Column and row of every particle of the undeformed billet, two a cell's side."""
    return np.floor(start.position / (cell / 2)).astype(int).T


def triangulation(start, end, cell):
    """The billet at the end: every square of four neighbours at the start in two triangles, however it has been deformed since."""
    columns, rows = lattice(start, cell)
    number = np.empty((columns.max() + 1, rows.max() + 1), int)
    number[columns, rows] = np.arange(columns.size)
    corners = np.stack([number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()], axis=1)
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return Triangulation(*(1e3 * end.position.T), triangles)


def billets(run, results):
    ends = times([0, BILLET_END])
    runs = {"explicit": run("upsetting", "billet-explicit", {"method": "explicit", "dt": "auto", "stable-step": "bar", "history-every": 50, "snapshots": ends})}
    runs |= {f"dt = {dt:g} s": run("upsetting", f"billet-{dt:g}", {"dt": dt, "snapshots": ends}) for dt in BILLET_STEPS}
    meshes = {cell: run("upsetting", f"billet-cell-{cell:g}", {"dt": REFINED_STEP, "cell-size": cell, "snapshots": ends})
              for cell in BILLET_CELLS[1:]}
    snapshots = {case: load(folder) for case, folder in runs.items()}
    refined = {BILLET_CELLS[0]: snapshots[f"dt = {REFINED_STEP:g} s"]} | {cell: load(folder) for cell, folder in meshes.items()}
    cases = {case: (runs[case], snapshots[case]) for case in runs}
    cases |= {f"dt = {REFINED_STEP:g} s, cells of {1e3 * cell:g} mm": (meshes[cell], refined[cell]) for cell in meshes}

    # the runs stop at different heights: radii are compared at the greatest of them
    histories = {case: Run(folder).history for case, (folder, _) in cases.items()}
    same = max(history["height_m"][-1] for history in histories.values())
    table, numbers = [], []
    for case, (folder, (start, end)) in cases.items():
        history = histories[case]
        radius, height = history["radius_m"][-1], history["height_m"][-1]
        radius_at_same = np.interp(-same, -history["height_m"], history["radius_m"])
        outer, upper = start.position[:, 0] > BILLET_RADIUS / 2, start.position[:, 1] > BILLET_HEIGHT / 2
        centre, fold = end.plastic_strain[~outer & ~upper].max(), end.plastic_strain[outer & upper].max()
        face = PLATEN - PLATEN_SPEED * end.time
        passed = np.count_nonzero(end.position[:, 1] > face)
        table.append([case, common.summary(folder)["steps"], f"{1e3 * end.time:.2f}", f"{1e3 * face:.2f}", passed,
                      f"{1e3 * height:.2f}", f"{1e3 * radius:.2f}", f"{1e3 * radius_at_same:.2f}", f"{centre:.2f}", f"{fold:.2f}"])
        printed = PRINTED_RADIUS if case == "explicit" else ""
        numbers += [["10, 13", "radius of the outermost particle at the end [m]", case, printed, f"{radius:.6f}"],
                    ["10, 13", "height of the highest particle at the end [m]", case, "", f"{height:.6f}"],
                    ["10, 13", f"radius of the outermost particle at height {1e3 * same:.2f} mm [m]", case, "", f"{radius_at_same:.6f}"],
                    ["10", "particles above the platen's lower face at the end", case, "", passed],
                    ["11", "largest plastic strain at the centre", case, "", f"{centre:.6f}"],
                    ["11", "largest plastic strain where the side meets the platen", case, "", f"{fold:.6f}"]]
    draw_billets(results, snapshots, refined)

    text = "\n## Figs. 10, 11 and 13: the billet\n\n[billets.png](billets.png)\n\n"
    text += common.markdown_table(["run", "steps", "t [ms]", "platen [mm]", "particles above it", "height [mm]", "radius [mm]",
                                   f"radius [mm] at height {1e3 * same:.2f} mm", "plastic strain at the centre", "at the platen's edge"],
                                  table)
    text += ("\nCells of 1 mm where nothing else is said. Platen: height of its lower face. Height and radius: of the highest and the "
             f"outermost particle, at the start {1e3 * BILLET_CELLS[0] / 4:g} mm inside the surface on 1 mm. The paper reads a radius of "
             f"about {1e3 * PRINTED_RADIUS:g} mm off its Fig. 10b. Plastic strain: the largest among the particles of the inner lower "
             "quarter, \"the centre\", and of the outer upper quarter of the undeformed section, which holds the place where the side "
             "folds against the platen, the paper's maximum.\n\n"
             "Bodies meet through the grid, up to a cell before they touch: the finer the mesh, the later the platen meets the billet, "
             "the less of its height is gone at the same time and the smaller the radius. Radii of meshes are therefore compared at the "
             "same height, too.\n")
    return text, numbers


def draw_billets(results, snapshots, refined):
    """`snapshots`: start and end by case, 1 mm; `refined`: by the size of a cell."""
    figure = plt.figure(figsize=(12.6, 9.8), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=[5.6, 4.2])
    grid = upper.add_gridspec(3, 3, width_ratios=[0.75, 1, 1])
    final = {"aspect": "equal", "xlim": (0, 17.5), "ylim": (0, 7), "xticks": (0, 5, 10, 15), "yticks": (0, 2, 4, 6)}
    first = upper.add_subplot(grid[:, 0])
    start = snapshots["explicit"][0]
    first.plot(*(1e3 * start.position.T), "o", color="C0", markersize=2.4)
    first.add_patch(Rectangle((0, 1e3 * PLATEN), 24, 1.4, facecolor="0.9", edgecolor="0.4", hatch="///", linewidth=0.8))
    first.text(6.5, 17.6, "platen, 1 m/s downwards", ha="center")
    first.set(title="Fig. 10a: initial configuration", xlabel="r [mm]", ylabel="z [mm]", aspect="equal", xlim=(0, 13), ylim=(0, 18.8),
              xticks=(0, 5, 10), yticks=(0, 5, 10, 15))
    places = [grid[0, 1], grid[0, 2], grid[1, 1], grid[1, 2], grid[2, 1]]
    for letter, place, (case, (_, end)) in zip("bcdef", places, snapshots.items()):
        axis = upper.add_subplot(place)
        axis.plot(*(1e3 * end.position.T), "o", color="C0", markersize=1.8)
        axis.set(title=f"Fig. 10{letter}: {case}, t = {1e3 * end.time:.2f} ms", **final)
        if letter in "bdf":
            axis.set_ylabel("z [mm]")
        if letter == "f":
            axis.set_xlabel("r [mm]")
    side = upper.add_subplot(grid[2, 2])
    columns, rows = lattice(start, BILLET_CELLS[0])
    outermost = np.flatnonzero(columns == columns.max())
    outermost = outermost[np.argsort(rows[outermost])]
    for (case, (_, end)), style in zip(snapshots.items(), ("-", "--", "-.", ":", "-")):
        side.plot(*(1e3 * end.position[outermost].T), linestyle=style, linewidth=1.3, label=case)
    side.set(title="outer column of particles, all steps", xlabel="r [mm]", **final)
    side.legend(loc="lower left", fontsize=8)

    largest = max(end.plastic_strain.max() for _, end in refined.values())
    levels = np.arange(0, np.ceil(largest / 0.2) + 1) * 0.2
    panels = lower.subplots(2, 3, sharex=True, sharey=True)
    for number, (cell, (start, end)) in enumerate(refined.items()):
        strain, points = panels[:, number]
        filled = strain.tricontourf(triangulation(start, end, cell), end.plastic_strain, levels=levels, cmap="viridis")
        points.plot(*(1e3 * end.position.T), "o", color="C0", markersize=1.8 * (cell / BILLET_CELLS[0]) ** 0.75)
        strain.set(title=f"Fig. 11{'abc'[number]}: plastic strain, {1e3 * cell:g} mm", **final)
        points.set(title=f"Fig. 13{'abc'[number]}: {1e3 * cell:g} mm", xlabel="r [mm]", **final)
    for panel in panels[:, 0]:
        panel.set_ylabel("z [mm]")
    lower.colorbar(filled, ax=panels, label="equivalent plastic strain", shrink=0.9, aspect=25, pad=0.02)
    figure.savefig(results / "billets.png", dpi=130)
    plt.close(figure)


# --- Fig. 9: Newton iterations where particles cross cells -----------------------------------------------------------------


def columns_of(snapshots):
    """Times of the snapshots, and place and mean stress of every column of particles at them. The rigid body has no particles in
    snapshots; it moves steadily, with two columns a cell's width."""
    moments = np.array([snapshot.time for snapshot in snapshots])
    position = np.array([snapshot.position[:, 0] for snapshot in snapshots])
    stress = np.array([snapshot.stress_xx for snapshot in snapshots])
    places = {f"rigid body, column {number}": GRIP_LEFT + quarter * BAR_CELL - GRIP_SPEED * moments
              for number, quarter in ((1, 0.25), (2, 0.75))}
    stresses = {}
    for number, start in enumerate(np.unique(position[0].round(9)), start=1):
        members = np.isclose(position[0], start)
        places[f"bar, column {number}"] = position[:, members].min(axis=1)
        stresses[f"bar, column {number}"] = stress[:, members].mean(axis=1)
    return moments, places, stresses


def crossings(moments, places):
    """(column, edge [m], time [s]) in the order of time. Columns move steadily until they cross and may jump then, so the time
    is extrapolated from the last two snapshots before."""
    found = []
    for name, path in places.items():
        for edge in BAR_CELL * np.arange(1, 7):
            before = np.flatnonzero(path > edge + 1e-9)
            if 1 < before.size < path.size:
                last = before[-1]
                speed = (path[last - 1] - path[last]) / (moments[last] - moments[last - 1])
                found.append((name, edge, moments[last] + (path[last] - edge) / speed))
    return sorted(found, key=lambda crossing: crossing[2])


def line_search(run, results):
    base = PAPER_WAY | {"dt": CROSSING_STEP, "duration": CROSSING_DURATION}
    often = times(np.arange(0, CROSSING_DURATION + 0.1, 0.25))
    without = run("plastic_bar", "crossing-none", base | {"line-search": "none", "snapshots": often})
    searched = run("plastic_bar", "crossing-residual", base | {"line-search": "residual", "snapshots": 0})
    moments, places, stresses = columns_of(load(without))
    found = crossings(moments, places)
    histories = {"none": Run(without).history, "residual": Run(searched).history}
    steps, seconds, iterations = (histories["none"][name] for name in ("step", "time_s", "newton_iterations"))
    differing = np.count_nonzero(np.any([histories["none"][name] != histories["residual"][name]
                                         for name in ("newton_iterations", "linear_iterations", "total_energy_J")], axis=0))

    table, numbers, elsewhere = [], [], np.ones(steps.size, bool)
    for name, edge, moment in found:
        after = (seconds >= moment - 1e-9) & (seconds < moment + AFTER_CROSSING)
        elsewhere &= ~after
        step, peak, several = int(steps[after][0]), int(iterations[after].max()), np.count_nonzero(iterations[after] > 1)
        table.append([name, f"{edge:.1f}", f"{moment:.2f}", step, peak, several])
        numbers += [["9a", "step in which it enters a new cell", name, "", step],
                    ["9a", f"largest number of Newton iterations in {AFTER_CROSSING:g} s after it", name, "", peak]]
    varied = []
    for number, (case, options) in enumerate(VARIATIONS.items()):
        folder = run("plastic_bar", f"crossing-{number}", base | {"line-search": "none", "snapshots": 0, **options}) if options else without
        counts = Run(folder).history["newton_iterations"]
        varied.append([case, int(counts.sum()), int(counts.max()), np.count_nonzero(counts > 1)])
        numbers.append(["9a", "largest number of Newton iterations", case, max(PRINTED_PEAKS.values()), int(counts.max())])
    billet_options = PAPER_WAY | BILLET_TOLERANCES | {"dt": REFINED_STEP, "snapshots": 0}
    billet = {search: run("upsetting", f"billet-search-{search}", billet_options | {"line-search": search})
              for search in ("none", "residual")}
    summaries = {search: common.summary(folder) for search, folder in billet.items()}
    numbers += [["9", f"upsetting, {name.replace('_', ' ')}", f"line search {search}", "", summary[name]]
                for search, summary in summaries.items() for name in ("steps", "rejected_steps", "newton_iterations")]
    draw_line_search(results, histories, (moments, places, stresses), found, billet)

    first, second = PRINTED_PEAKS
    rigid = max(moment for name, _, moment in found if name.startswith("rigid"))
    text = "\n## Fig. 9: line search\n\n[line_search.png](line_search.png)\n\n"
    text += common.markdown_table(["enters a new cell", "edge [m]", "t [s]", "step",
                                   f"largest number of Newton iterations in {AFTER_CROSSING:g} s", "steps of two and more"], table)
    text += (f"\nElastic-plastic bar to t = {CROSSING_DURATION:g} s in steps of {CROSSING_STEP} s in the paper's way (momentum form, "
             f"difference quotients, tolerances of Table V): {int(steps[-1])} steps, {int(iterations.sum())} Newton iterations; outside "
             f"the seconds after a crossing no step takes more than {int(iterations[elsewhere].max())}. Steps that differ between line "
             f"search none and residual: {differing}.\n\n"
             "Why rows that cross make peaks: nodes that the rigid body touches have its velocity. A column of the bar that has left "
             "for the rigid body's cell therefore no longer deforms and bears nothing; the column left behind in the first free cell "
             "must bear all by itself, at twice the stress. When the last column of the rigid body leaves, the nodes at 0.4 m become "
             "unknowns at once, and the bar springs back.\n\n"
             f"The paper has {PRINTED_PEAKS[first]} iterations in step {first} (the first row of the bar enters a new cell) and "
             f"{PRINTED_PEAKS[second]} in step {second} (the last row of the rigid body does). In steps of {CROSSING_STEP} s step "
             f"{second} would be at t = {second * CROSSING_STEP:.1f} s, after the end. The rigid body's last row crosses at {rigid:.1f} "
             f"s by its speed alone; for that the step must be {rigid / second:.5f} s, and step {first} is then at "
             f"{first * rigid / second:.1f} s, where no row crosses here. The paper's run therefore had another step, and another layout "
             "or way of holding the bar, than this one.\n\n"
             "Peaks with other settings, line search none:\n\n")
    text += common.markdown_table(["", "Newton iterations", "largest number in a step", "steps of two and more"], varied)
    text += (f"\nUpsetting in the paper's way, cells of 1 mm, dt = {REFINED_STEP:g} s at most (a step that does not converge is repeated "
             "with half its length; iterations include those of repeated steps):\n\n")
    text += common.markdown_table(["line search", "steps", "repeated", "Newton iterations", "linear iterations"],
                                  [[search, s["steps"], s["rejected_steps"], s["newton_iterations"], s["linear_iterations"]]
                                   for search, s in summaries.items()])
    text += "\nFigs. 9b to 9d, residuals by iteration, are not drawn: the history has numbers of iterations alone.\n"
    return text, numbers


def draw_line_search(results, histories, columns, found, billet):
    moments, places, stresses = columns
    last = histories["none"]["step"][-1]
    figure, axes = plt.subplots(4, 1, figsize=(10.5, 12.6), layout="constrained")
    for axis in axes[:3]:
        for _, _, moment in found:
            axis.axvline(moment / CROSSING_STEP, color="0.6", linewidth=1, linestyle="--", zorder=0)
        axis.axvspan(last, 28000, color="0.93", zorder=0)
        axis.set(xlim=(0, 28000), xlabel="step")
    for (search, history), colour, size in zip(histories.items(), ("C0", "C1"), (6, 2)):
        axes[0].plot(history["step"], history["newton_iterations"], "o", color=colour, markersize=size, label=f"line search {search}")
    for step, printed in PRINTED_PEAKS.items():
        axes[0].annotate(f"paper: step {step},\n{printed} iterations", (step, 4.9), (step, 3.3), ha="center", va="top", color="C3",
                         fontsize=10, arrowprops={"arrowstyle": "-|>", "color": "C3"})
    axes[0].text((last + 28000) / 2, 0.2, f"after t = {CROSSING_DURATION:g} s", fontsize=10, ha="center")
    axes[0].set(title=f"(a) Fig. 9a: elastic-plastic bar, dt = {CROSSING_STEP} s", ylabel="Newton iterations", ylim=(-0.3, 4.9),
                yticks=range(5))
    axes[0].legend(loc="upper left", fontsize=10, framealpha=1)

    for name, path in places.items():
        rigid = name.startswith("rigid")
        axes[1].plot(moments / CROSSING_STEP, path, color="black" if rigid else f"C{int(name[-1]) - 1}", linestyle="-." if rigid else "-")
    for edge in BAR_CELL * np.arange(2, 8):
        axes[1].axhline(edge, color="0.3", linewidth=0.8)
    for name, edge, moment in found:
        axes[1].plot([moment / CROSSING_STEP], [edge], "o", markersize=9, markerfacecolor="none", markeredgecolor="C3", markeredgewidth=1.8)
    axes[1].plot([], [], "k-.", label="rigid body")
    axes[1].plot([], [], "o", markersize=9, markerfacecolor="none", markeredgecolor="C3", markeredgewidth=1.8, label="enters a new cell")
    axes[1].set(title="(b) places of the columns of particles and edges of cells", ylabel="x [m]", ylim=(0.19, 0.71))
    for name, path in stresses.items():
        axes[2].plot(moments / CROSSING_STEP, path, color=f"C{int(name[-1]) - 1}", label=name)
    axes[2].set(title="(c) mean stress of the columns", ylabel=r"stress $\sigma_{xx}$ [Pa]", ylim=(0, 400))
    for axis in axes[1:3]:
        axis.legend(loc="center right", fontsize=10, framealpha=1)

    for (search, folder), marker, colour in zip(billet.items(), ("x", "o"), ("C0", "C1")):
        history, summary = Run(folder).history, common.summary(folder)
        axes[3].plot(1e3 * history["deflection_m"], history["newton_iterations"], marker=marker, color=colour, linewidth=0.8, markersize=4,
                     markerfacecolor="none", label=f"line search {search}: {summary['steps']} steps, {summary['rejected_steps']} repeated")
    axes[3].set(title=f"(d) upsetting, 1 mm, dt = {REFINED_STEP:g} s at most: iterations of the steps that converged",
                xlabel="way of the platen [mm]", ylabel="Newton iterations", xlim=(0, 9.7), ylim=(0, 65))
    axes[3].legend(loc="upper left", fontsize=10)
    figure.savefig(results / "line_search.png", dpi=120)
    plt.close(figure)


def main():
    arguments = common.parser(__doc__, work="out/verification/figures").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    arguments.results.mkdir(parents=True, exist_ok=True)
    plt.rcParams.update({"font.size": 11, "axes.titlesize": 11})

    def run(program, name, options):
        return common.run(arguments.program.parent / program, arguments.work / name, options)

    text, numbers = f"# Figures of Sulsky & Kaul\n\n{common.provenance()}\n\n", []
    for part in (bars, disks, billets, line_search):
        part_text, part_numbers = part(run, arguments.results)
        text += part_text
        numbers += part_numbers
    common.publish(arguments.results, "figures", text, HEADER, numbers)


if __name__ == "__main__":
    main()
