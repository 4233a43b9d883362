#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws what runs left behind: fields or particles at some times (fields.png in each folder), and a curve of history.csv (curve.png,
one line a run; of several runs in the folder that they share). Without options the quantities, times and columns are those that a run
is about.

    ./ductile plot out/upsetting                                   # fields.png and curve.png
    ./ductile plot out/shear_band --field tau,velocity_x --last
    ./ductile plot out/upsetting --field temperature_rise --times 2e-3,5e-3,9.5e-3
    ./ductile plot out/coarse out/fine --curve wall_strain,wall_shear_traction_Pa
    ./ductile plot out/colliding_disks --field pressure --movie    # fields.mp4, without ffmpeg fields.gif
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.collections import PolyCollection

from results import ResultsError, Run

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of the backend)
from matplotlib.animation import FFMpegWriter, PillowWriter  # noqa: E402

WORDS = {  # for names that are no words by themselves
    "dt": "step size", "id": "number of the particle", "material": "number of the material",
    "s": "deviatoric stress $s$", "tau": r"shear stress $\tau$", "q": "deviatoric stress $q$ across the plane",
    "stress_xx": r"stress $\sigma_{xx}$", "stress_yy": r"stress $\sigma_{yy}$", "stress_zz": r"stress $\sigma_{zz}$",
    "stress_xy": r"stress $\sigma_{xy}$", "von_mises_stress": "von Mises stress",
    "deviatoric_magnitude": "magnitude of the deviatoric stress",
}
UNITS = ("Pa", "J", "K", "N", "m", "s", "Ns", "Nms", "1/s", "rad", "kg")  # that end the names of columns
WRITTEN = {"Ns": "N s", "Nms": "N m s", "kg/m^3": "kg/m³"}
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
PREFIXED = {"Pa": 1e6, "J": 1e9, "N": 1e9, "m": 1.0, "s": 1.0, "m/s": 1.0}  # units that take a prefix, and the largest one
DEFAULT_TIMES = 6
ROUND_OFF = 1e-9  # of the largest stress of a figure
DOTS, LARGEST = 150, 25.0  # of a figure: pixels an inch, and inches a side
SIDE = 2.6                 # of a picture [in], of a square one


# --- words and units -------------------------------------------------------------------------------------------------------


def words(name):
    if name in WORDS:
        return WORDS[name]
    text = re.sub(r"_([xy])$", r" in \1", name)
    return text.replace("_", " ")


def name_and_unit(column):
    """load_N: load, N."""
    name, _, unit = column.rpartition("_")
    return (name, unit) if unit in UNITS else (column, "1")


def scale_of(unit, largest):
    """The number to divide by, and the unit with its prefix, so that `largest` is written with few digits."""
    shown = WRITTEN.get(unit, unit)
    if unit not in PREFIXED or not 0 < largest < np.inf:
        return 1.0, shown
    allowed = [(factor, prefix) for factor, prefix in PREFIXES if factor <= PREFIXED[unit]]
    factor, prefix = next((entry for entry in allowed if largest >= (0.1 if entry[0] == 1.0 else 0.999) * entry[0]), allowed[-1])
    return factor, prefix + shown


def label(text, unit):
    return text if unit == "1" else f"{text} [{unit}]"


# --- what is drawn ---------------------------------------------------------------------------------------------------------


class Quantity:
    """Pictures of one field, with one scale of colours for all of them."""

    def __init__(self, text, values, unit):
        self.text, self.values, self.unit = text, values, unit
        limits = np.array([np.percentile(array[np.isfinite(array)], [0, 0.1, 99.9, 100]) for array in values if np.isfinite(array).any()])
        if limits.size == 0:
            raise ResultsError(f"the {text} has no finite value at these times; choose others")
        low, inner_low, inner_high, high = *limits[:, :2].min(axis=0), *limits[:, 2:].max(axis=0)
        smallest, largest = low, high
        # A few extreme cells must not turn the rest into one colour: the scale leaves them out, and its bar ends in a point.
        margin = 0.25 * (inner_high - inner_low)
        if margin > 0:
            low, high = (low if low > inner_low - margin else inner_low), (high if high < inner_high + margin else inner_high)
        signed = low < -0.01 * high
        if signed:
            high = max(abs(low), abs(high))
            low = -high
        if not high - low > 1e-6 * max(abs(high), 1e-300):  # one value, but for round-off
            low, high = (low - 0.1 * abs(high), high + 0.1 * abs(high)) if high else (0.0, 1.0)
        self.limits, self.signed = (low, high), signed
        self.size = max(abs(smallest), abs(largest)) and max(abs(low), abs(high))
        self.colours = "RdBu_r" if signed else "viridis" if unit == "Pa" else "inferno"
        self.extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[int(smallest < low), int(largest > high)]
        self.measure(self.size)

    def measure(self, size):
        """Takes the unit that suits `size`; what is round-off beside it shows no pattern."""
        low, high = self.limits
        least = ROUND_OFF * size
        if max(abs(low), abs(high)) < least:
            low, high = (-least if self.signed else 0.0), least
        self.factor, shown = scale_of(self.unit, size)
        self.low, self.high = low / self.factor, high / self.factor
        self.label = label(self.text, shown)


class Values:
    """A field, or the magnitude of a vector, at some times, read when asked for: all of a movie may be more than the memory holds."""

    def __init__(self, name, snapshots):
        self.name, self.snapshots = name, snapshots
        self.vector = snapshots[0][name].ndim > snapshots[0].run.dimensions

    def __getitem__(self, number):
        values = self.snapshots[number][self.name]
        return np.linalg.norm(values, axis=-1) if self.vector else values


def quantity(name, snapshots):
    values = Values(name, snapshots)
    return Quantity(("magnitude of the " if values.vector else "") + words(name), values, snapshots[0].units(name))


def quantities_of(names, snapshots):
    """Those of a figure, all stresses in one unit."""
    drawn = [quantity(name, snapshots) for name in names]
    stresses = [one for one in drawn if one.unit == "Pa"]
    for one in stresses:
        one.measure(max(other.size for other in stresses))
    return drawn


def default_fields(run):
    """What flows, the pressure, and how large the deviatoric stress is."""
    last = run.snapshots[-1]
    flow = [name for name in ("effective_temperature", "plastic_strain") if name in last.names and np.any(last[name])]
    return flow[:1] + ["pressure", "deviatoric_magnitude" if run.carrier == "grid" else "von_mises_stress"]


def default_curve(run):
    if run.carrier == "point":
        return "accumulated_shear_strain", "deviatoric_magnitude_Pa"
    if run.carrier == "grid" and run.parameters.get("shear-traction"):
        return "time_s", "wall_strain"
    if "wall_strain" in run.history:
        return "wall_strain", "wall_shear_traction_Pa"
    curve = run.parameters.get("curve", {})
    return curve.get("x", "time_s"), curve.get("y", "total_energy_J")


def choose(run, times, last):
    """The snapshots to draw: those nearest to `times`, the last, or some evenly chosen."""
    snapshots = run.snapshots
    if last:
        return snapshots[-1:]
    if times is None:
        numbers = np.unique(np.linspace(0, len(snapshots) - 1, min(len(snapshots), DEFAULT_TIMES)).round().astype(int))
        return [snapshots[number] for number in numbers]
    slack = 1e-9 * abs(run.times[-1])
    for time in times:
        if not run.times[0] - slack <= time <= run.times[-1] + slack:
            raise ResultsError(f"{run.folder}: no snapshot at {time:g} s; they go from {run.times[0]:g} to {run.times[-1]:g} s")
    return [snapshots[number] for number in dict.fromkeys(int(np.argmin(np.abs(run.times - time))) for time in times)]


class View:
    """Where a run is drawn, and with which lengths."""

    def __init__(self, run, snapshots):
        self.run = run
        self.box = np.array(run.grid.box)
        if run.carrier == "points":
            self.sides = particle_sides(run)
            self.neighbours = Neighbours(run, self.sides)
            self.box = self.fit(snapshots)
        self.unit_length, self.unit = scale_of("m", np.max(self.box[2:] - self.box[:2]))
        self.aspect = (self.box[3] - self.box[1]) / (self.box[2] - self.box[0])
        self.names = ("radius x", "height y") if run.geometry == "axisymmetric" else ("x", "y")

    def fit(self, snapshots):
        """Around all particles and rigid bodies, within the grid."""
        margin = 0.75 * self.sides
        boxes = [body.box(snapshot.time) for body in self.run.rigid_bodies for snapshot in snapshots]
        for snapshot in snapshots:
            position = snapshot["position"][:, :2]
            boxes.append((*position.min(axis=0), *position.max(axis=0)))
        boxes = np.array(boxes)
        low = np.maximum(boxes[:, :2].min(axis=0) - margin, self.box[:2])
        high = np.minimum(boxes[:, 2:].max(axis=0) + margin, self.box[2:])
        return np.concatenate([low, high])

    def extent(self, box):
        left, bottom, right, top = np.asarray(box) / self.unit_length
        return left, right, bottom, top

    def prepare(self, axes):
        left, right, bottom, top = self.extent(self.box)
        # The ground is no colour of a scale, nor that of rigid bodies.
        axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", facecolor="0.9")
        axes.locator_params(nbins=4 if self.aspect <= 1.25 else 3, axis="x")
        axes.locator_params(nbins=5, axis="y")

    def draw(self, axes, snapshot, quantity, values):
        """Adds the picture of a snapshot's values to the axes; returns all that it is made of, what has the colours first."""
        if self.run.carrier == "grid":
            return [self.draw_cells(axes, quantity, values)]
        return [self.draw_particles(axes, snapshot, quantity, values)] + self.draw_rigid(axes, snapshot.time)

    def draw_cells(self, axes, quantity, values):
        grid, box = self.run.grid, np.array(self.run.grid.box)
        if values.shape[0] == grid.y_corner.size:  # a cell around each corner
            half = np.array([grid.x_corner[1] - grid.x_corner[0], grid.y_corner[1] - grid.y_corner[0]]) / 2
            box += np.concatenate([-half, half])
        image = axes.imshow(values / quantity.factor, origin="lower", extent=self.extent(box), cmap=quantity.colours,
                            norm=plt.Normalize(quantity.low, quantity.high),
                            interpolation="nearest" if max(values.shape) < 300 else "antialiased")  # more cells than pixels
        self.prepare(axes)
        return image

    def draw_particles(self, axes, snapshot, quantity, values):
        particles = PolyCollection(self.neighbours.outlines(snapshot) / self.unit_length, array=values / quantity.factor,
                                   cmap=quantity.colours, norm=plt.Normalize(quantity.low, quantity.high), edgecolors="face",
                                   linewidths=0.5, rasterized=True)
        axes.add_collection(particles, autolim=False)
        self.prepare(axes)
        return particles

    def draw_rigid(self, axes, time):
        left, bottom, right, top = self.box
        dots = [int(2 * SIDE * DOTS * side / max(right - left, top - bottom)) + 2 for side in (right - left, top - bottom)]
        x, y = (start + (np.arange(count) + 0.5) * (end - start) / count for start, end, count in
                ((left, right, dots[0]), (bottom, top, dots[1])))
        covered = np.zeros((y.size, x.size), bool)
        for body in self.run.rigid_bodies:
            covered |= body.inside(x[None, :], y[:, None], time)
        if not covered.any():
            return []
        picture = np.zeros((*covered.shape, 4))
        picture[covered] = matplotlib.colors.to_rgba("0.5")
        image = axes.imshow(picture, origin="lower", extent=self.extent(self.box), interpolation="nearest", zorder=3)
        self.prepare(axes)
        return [image]


def particle_sides(run):
    """Width and height of a particle at the start [m]: those of a cell over how many particles share it along one."""
    position, grid = run.snapshots[0]["position"], run.grid
    sides = np.array([grid.x_corner[1] - grid.x_corner[0], grid.y_corner[1] - grid.y_corner[0]])
    cell = np.floor((position[:, :2] - grid.box[:2]) / sides)
    _, counts = np.unique(cell, axis=0, return_counts=True)
    return sides / max(1, round(np.sqrt(np.percentile(counts, 75))))


class Neighbours:
    """Which particles were beside each other at the start: their present distances say how a particle is stretched and turned. Where
    particles were not in rows and columns they are drawn as they were."""

    LARGEST = 4.0  # stretch: beyond it former neighbours have parted

    def __init__(self, run, sides):
        self.sides, start = sides, run.snapshots[0]
        self.id = start["id"]
        place = np.round((start["position"][:, :2] - run.grid.box[:2]) / sides - 0.5).astype(int)
        numbers = {tuple(where): number for number, where in enumerate(place.tolist())}
        regular = start.time == 0 and len(numbers) == len(place)
        step = lambda number, across, up: numbers.get((place[number, 0] + across, place[number, 1] + up), number) if regular else number
        self.pairs = [np.array([[step(number, -across, -up), step(number, across, up)] for number in range(len(place))])
                      for across, up in ((1, 0), (0, 1))]

    def outlines(self, snapshot):
        """The four corners of each particle [m]."""
        position = snapshot["position"][:, :2]
        halves = []
        for k, pairs in enumerate(self.pairs):
            half = np.tile(np.eye(2)[k] * self.sides[k] / 2, (len(position), 1))
            if np.array_equal(snapshot["id"], self.id):
                between = np.sum(pairs != np.arange(len(pairs))[:, None], axis=1)  # neighbours, on both sides, one or none
                seen = (position[pairs[:, 1]] - position[pairs[:, 0]]) / (2 * np.maximum(between, 1))[:, None]
                known = (between > 0) & (np.hypot(*seen.T) < self.LARGEST * self.sides[k] / 2)
                half[known] = seen[known]
            halves.append(half)
        across, up = halves
        return np.stack([position - across - up, position + across - up, position + across + up, position - across + up], axis=1)


def time_label(time, largest):
    factor, unit = scale_of("s", largest)
    return f"t = {time / factor:.4g} {unit}"


# --- figures ---------------------------------------------------------------------------------------------------------------


class Sheet:
    """A figure with a picture for each of some times and quantities, and a bar of colours for each quantity."""

    def __init__(self, view, times, quantities):
        count, several = len(quantities), len(quantities) > 1
        self.down = view.aspect <= 1.25 and several  # times go down, quantities across
        if several:
            rows, columns = (times, count) if self.down else (count, times)
        else:
            across = 4 if view.aspect <= 1.25 else DEFAULT_TIMES
            rows = -(-times // across)
            columns = -(-times // rows)
        width = np.clip(SIDE / np.sqrt(view.aspect), 1.5, 6.0)
        width *= min(1.0, 5.0 / (width * view.aspect))
        beside, above = (0.9, 1.2) if self.down else (1.6, 0.7)
        size = np.array([columns * (width + 0.25) + beside, rows * (width * view.aspect + 0.35) + above])
        size *= min(1.0, LARGEST / size.max())
        self.figure, self.axes = plt.subplots(rows, columns, squeeze=False, sharex=True, sharey=True, layout="compressed", figsize=size)
        self.view, self.several, self.times = view, several, times
        for axes in self.axes[-1]:
            axes.set_xlabel(f"{view.names[0]} [{view.unit}]")
        for axes in self.axes[:, 0]:
            axes.set_ylabel(f"{view.names[1]} [{view.unit}]")
        for empty in self.axes.flat[times:] if not several else ():
            empty.set_visible(False)
            above = self.axes[rows - 2, empty.get_subplotspec().colspan.start]
            above.set_xlabel(f"{view.names[0]} [{view.unit}]")
            above.tick_params(labelbottom=True)

    def axes_of(self, time, quantity):
        if not self.several:
            return self.axes.flat[time]
        return self.axes[time, quantity] if self.down else self.axes[quantity, time]

    def entitle(self, time, text):
        if self.down:
            axes = self.axes[time, 0]
            axes.set_ylabel(f"{text}\n\n{self.view.names[1]} [{self.view.unit}]")
        else:
            self.axes_of(time, 0).set_title(text, fontsize="medium")

    def bar(self, quantity, number, image):
        beside = self.axes if not self.several else self.axes[:, number] if self.down else self.axes[number]
        colour_bar(self.figure, image, quantity, beside, "top" if self.down or self.view.aspect < 0.3 else "right")


def colour_bar(figure, image, quantity, beside, location):
    bar = figure.colorbar(image, ax=beside, location=location, label=quantity.label, extend=quantity.extend, aspect=25, shrink=0.95,
                          pad=0.02)
    bar.ax.locator_params(nbins=4 if location == "top" else 6)
    bar.formatter.set_powerlimits((-3, 4))
    bar.formatter.set_useOffset(False)


def draw_fields(run, names, snapshots, path):
    view = View(run, snapshots)
    quantities = quantities_of(names, snapshots)
    sheet = Sheet(view, len(snapshots), quantities)
    for number, one in enumerate(quantities):
        for k, snapshot in enumerate(snapshots):
            parts = view.draw(sheet.axes_of(k, number), snapshot, one, one.values[k])
        sheet.bar(one, number, parts[0])
    for k, snapshot in enumerate(snapshots):
        sheet.entitle(k, time_label(snapshot.time, snapshots[-1].time))
    write(path, lambda temporary: sheet.figure.savefig(temporary, dpi=DOTS, bbox_inches="tight"))
    plt.close(sheet.figure)


def draw_movie(run, names, snapshots, path):
    """One frame a snapshot, ten seconds in all if they are enough."""
    view = View(run, snapshots)
    quantities = quantities_of(names, snapshots)
    sheet = Sheet(view, 1, quantities)
    rate = int(np.clip(len(snapshots) / 10, 4, 25))
    # H.264 as all players read it wants even sides.
    writer = FFMpegWriter(fps=rate, codec="libx264", extra_args=["-pix_fmt", "yuv420p", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"]) \
        if path.suffix == ".mp4" else PillowWriter(fps=rate)

    def frames(temporary):
        with writer.saving(sheet.figure, temporary, DOTS):
            for k, snapshot in enumerate(snapshots):
                parts = [view.draw(sheet.axes_of(0, number), snapshot, one, one.values[k]) for number, one in enumerate(quantities)]
                if k == 0:
                    for number, one in enumerate(quantities):
                        sheet.bar(one, number, parts[number][0])
                sheet.entitle(0, time_label(snapshot.time, snapshots[-1].time))
                if k == 0:
                    sheet.figure.canvas.draw()
                    sheet.figure.set_layout_engine("none")  # frames must not tremble
                writer.grab_frame()
                for part in sum(parts, []):
                    part.remove()

    write(path, frames)
    plt.close(sheet.figure)


def run_labels(runs):
    """As short as they tell the runs apart."""
    names = [run.folder.resolve().name for run in runs]
    return names if len(set(names)) == len(names) else [str(run.folder) for run in runs]


def lines(run, name, x, y):
    """Label, abscissae and ordinates of each line of a run."""
    if run.carrier != "point":
        return [(name, run.history[x], run.history[y])]
    method, tolerance = run.history["method"], run.history["tolerance"]
    kept = []
    for one in dict.fromkeys(method):
        finest = (method == one) & (tolerance == tolerance[method == one].min())
        kept.append((f"{name}, {one}" if name else one, run.history[x][finest], run.history[y][finest]))
    return kept


def plot_lines(axes, drawn, x, y):
    """Lines of a label, abscissae and ordinates each, of two columns of history.csv."""
    factors, labels = [], []
    for column, k in ((x, 1), (y, 2)):
        name, unit = name_and_unit(column)
        factor, unit = scale_of(unit, max(np.max(np.abs(line[k][np.isfinite(line[k])]), initial=0.0) for line in drawn))
        factors.append(factor)
        labels.append(label(words(name), unit))
    for number, (name, across, up) in enumerate(drawn):
        axes.plot(across / factors[0], up / factors[1], label=name, linewidth=1.5, linestyle=("-", "--", "-.", ":")[number // 10 % 4])
    axes.set(xlabel=labels[0], ylabel=labels[1])
    axes.grid(color="0.9", linewidth=0.8)
    axes.ticklabel_format(scilimits=(-3, 4), useMathText=True)
    axes.spines[["top", "right"]].set_visible(False)


def draw_curves(runs, x, y, path):
    names = run_labels(runs) if len(runs) > 1 else [""]
    drawn = [line for run, name in zip(runs, names) for line in lines(run, name, x, y)]
    for _, *columns in drawn:
        for column, values in zip((x, y), columns):
            if values.dtype.kind != "f":
                raise ResultsError(f"the column '{column}' holds words; choose one with numbers")
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    plot_lines(axes, drawn, x, y)
    if 1 < len(drawn) <= 6:
        axes.legend(frameon=False)
    elif len(drawn) > 6:
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), frameon=False, fontsize="small", ncol=-(-len(drawn) // 22))
        figure.set_figwidth(9.0)
    write(path, lambda temporary: figure.savefig(temporary, dpi=DOTS))
    plt.close(figure)


def write(path, save):
    """Through a temporary name: a file of an earlier run stays until this one is whole."""
    temporary = path.with_name(f"{path.stem}.part{path.suffix}")
    try:
        save(temporary)
        os.replace(temporary, path)
    except (OSError, subprocess.CalledProcessError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ResultsError(f"{path}: cannot be written ({reason}); choose another place with --output") from None
    finally:
        temporary.unlink(missing_ok=True)
    print(f"figure: {path}")


# --- the command -----------------------------------------------------------------------------------------------------------


class Parser(argparse.ArgumentParser):
    """Mistakes are one line."""

    def error(self, message):
        print(f"{self.prog}: {message}; see --help", file=sys.stderr)
        sys.exit(2)


def obey(parser, act):
    """Does what the command line says; returns the exit status."""
    options = parser.parse_args()
    try:
        act(options)
        sys.stdout.flush()
    except ResultsError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # of `head` and the like
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return 0


def numbers(text):
    return [float(word) for word in text.split(",")]


def pair(text):
    x, y = text.split(",")
    return x, y


def places(options, runs):
    """Where fields of each run and the curve go."""
    moving = ".mp4" if shutil.which("ffmpeg") else ".gif"
    kind = f"fields{moving}" if options.movie else "fields.png"
    common = Path(os.path.commonpath([run.folder.resolve() for run in runs]))
    if options.output is None:
        curve = runs[0].folder if len(runs) == 1 else Path(os.path.relpath(common))
        return [run.folder / kind for run in runs], curve / "curve.png"
    if options.output.suffix:
        if options.movie and options.output.suffix == ".mp4" and moving != ".mp4":
            raise ResultsError("an .mp4 needs ffmpeg, which is not installed; install it, or name a .gif")
        allowed = (".mp4", ".gif") if options.movie else (".png", ".pdf", ".svg")
        if options.output.suffix not in allowed:
            raise ResultsError(f"{options.output}: the ending must be {' or '.join(allowed)}, or none for a folder")
        return [options.output] * len(runs), options.output
    try:
        options.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultsError(f"{options.output}: cannot be made ({error.strerror}); choose another --output") from None
    names = [label.replace("/", "-").lstrip(".-") + "-" for label in run_labels(runs)] if len(runs) > 1 else [""]
    return [options.output / f"{name}{kind}" for name in names], options.output / "curve.png"


def draw(options):
    runs = [Run(folder) for folder in options.out]
    asked_fields = bool(options.field or options.times or options.last or options.movie)
    if asked_fields and any(run.carrier == "point" for run in runs):
        raise ResultsError(f"{next(run for run in runs if run.carrier == 'point').folder}: material_point has no snapshots; "
                           "draw a --curve of its history")
    with_fields = [run for run in runs if asked_fields or run.has_snapshots]
    do_fields, do_curve = asked_fields or not options.curve, bool(options.curve) or not asked_fields
    fields, curve = places(options, runs)
    if options.output and options.output.suffix and len(with_fields) * do_fields + do_curve > 1:
        raise ResultsError(f"{options.output}: these are several figures; give a folder, or choose one by --field or --curve")
    if do_fields:
        for run, path in zip(runs, fields):
            if run not in with_fields:
                print(f"{run.folder}: it has no snapshots, and gets a curve only")
                continue
            snapshots = run.snapshots if options.movie and not options.times else choose(run, options.times, options.last)
            names = options.field or default_fields(run)
            for name in names:
                snapshots[0].check(name)
            (draw_movie if options.movie else draw_fields)(run, names, snapshots, path)
    if do_curve:
        draw_curves(runs, *(options.curve or default_curve(runs[0])), curve)


def main():
    parser = Parser(prog="plot", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT", nargs="+", type=Path, help="a folder that a run left; several share the curve")
    parser.add_argument("--field", metavar="NAME[,NAME]", type=lambda text: text.split(","),
                        help="quantities of fields.h5; a wrong name lists them")
    chosen = parser.add_mutually_exclusive_group()
    chosen.add_argument("--times", metavar="T1[,T2]", type=numbers, help="the snapshots nearest to these times [s]")
    chosen.add_argument("--last", action="store_true", help="the last snapshot only")
    parser.add_argument("--curve", metavar="X,Y", type=pair, help="columns of history.csv; a wrong name lists them")
    parser.add_argument("--movie", action="store_true", help="all snapshots one after the other (or those of --times)")
    parser.add_argument("--output", metavar="PLACE", type=Path,
                        help="a folder, or the file of a single figure (default: beside the results)")
    return obey(parser, draw)


if __name__ == "__main__":
    sys.exit(main())
