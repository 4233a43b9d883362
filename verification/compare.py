#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far two runs are apart: the quantities that both have at the last time at which both have a snapshot, and the columns of
history.csv that both have. Prints a Markdown table; --output keeps it and draws a figure beside it.

    ./ductile compare out/coarse out/fine
    ./ductile compare out/grid out/points --time 1.4175 --output out/carriers.md

Runs on one grid are compared value by value, runs of the same particles particle by particle. Otherwise what is compared are means over
the cells of one of the runs: those of another grid by cubic interpolation of its sums over cells, which keeps sums and is exact for
linear fields, those of particles by averaging the particles in a cell. Differences are those of B from A.
"""

import argparse
import os
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import plot
from common import BOOKKEEPING, lagrange_matrix, markdown_table
from results import ResultsError, Run

DRAWN = 3  # quantities at most


def rms(values):
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else 0.0


# --- fields ----------------------------------------------------------------------------------------------------------------


def common_time(a, b, wanted):
    """The snapshots of both at the last time that they share, or at `wanted`."""
    slack = 1e-9 * max(abs(a.times[-1]), abs(b.times[-1]))
    pairs = [(one, other) for one in a.snapshots for other in b.snapshots if abs(one.time - other.time) <= slack]
    if not pairs:
        raise ResultsError(f"{a.folder} and {b.folder} share no time of a snapshot; run both with the same --snapshots")
    if wanted is None:
        return pairs[-1]
    for pair in pairs:
        if abs(pair[0].time - wanted) <= 1e-6 * abs(wanted) + slack:
            return pair
    raise ResultsError(f"{a.folder} and {b.folder} share no snapshot at {wanted:g} s; they share "
                       + ", ".join(f"{pair[0].time:g}" for pair in pairs) + " s")


def mean_matrix(source, target):
    """[target cells][source cells]: means over the cells between the edges `target` of what has the given means between `source`."""
    sums = np.tril(np.ones((source.size, source.size - 1)), -1) * (source[1] - source[0])
    at_target = lagrange_matrix(source, target, min(3, source.size - 1)) @ sums
    return np.diff(at_target, axis=0) / np.diff(target)[:, None]


def cell_means(run, snapshot, name, grid):
    """Over the cells of `grid`; nan where particles are missing."""
    values = snapshot[name]
    if run.carrier == "points":
        return particle_means(snapshot["position"][:, :2], values, grid)
    if snapshot.centring(name) == "corner":
        values = (values[1:, 1:] + values[:-1, 1:] + values[1:, :-1] + values[:-1, :-1]) / 4
    if same_grid(run.grid, grid):
        return values
    across, up = mean_matrix(run.grid.x_corner, grid.x_corner), mean_matrix(run.grid.y_corner, grid.y_corner)
    return np.einsum("ij,jk...,lk->il...", up, values, across)


def particle_means(position, values, grid):
    shape = grid.y_centre.size, grid.x_centre.size
    left, bottom, right, top = grid.box
    column = np.floor((position[:, 0] - left) / (right - left) * shape[1]).astype(int)
    row = np.floor((position[:, 1] - bottom) / (top - bottom) * shape[0]).astype(int)
    within = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    cell = (row * shape[1] + column)[within]
    count = np.bincount(cell, minlength=shape[0] * shape[1])
    columns = values[within].reshape(cell.size, -1).T
    with np.errstate(invalid="ignore"):
        means = np.stack([np.bincount(cell, one, count.size) / count for one in columns], axis=-1)
    return means.reshape(*shape, *values.shape[1:])


def same_grid(one, other):
    size = max(np.ptp(one.x_corner), np.ptp(one.y_corner))
    return all(p.size == q.size and np.allclose(p, q, rtol=0, atol=1e-9 * size)
               for p, q in ((one.x_corner, other.x_corner), (one.y_corner, other.y_corner)))


def same_particles(a, b):
    first, second = a.snapshots[0], b.snapshots[0]
    size = np.ptp(a.grid.x_corner)
    return np.array_equal(first["id"], second["id"]) and np.allclose(first["position"], second["position"], rtol=0, atol=1e-9 * size)


class Fields:
    """The quantities that both runs have, as arrays alike: `a`, `b` and `units` by name; `how` says what is compared."""

    def __init__(self, a, b, wanted):
        self.runs = a, b
        self.snapshots = first, second = common_time(a, b, wanted)
        self.time = first.time
        self.particles = False
        kinds = {a.carrier, b.carrier}
        names = [name for name in first.names if name in second.names] if len(kinds) == 1 else \
            [name for name in (first if a.carrier == "grid" else second).names if name in first.quantities and name in second.quantities]
        names += [name for name in plot.default_fields(a) if name not in names and name in second.quantities]
        left_out = {"id", "material"}
        if kinds == {"grid"} and same_grid(a.grid, b.grid):
            self.grid_run, self.how = a, "value by value"
            take = lambda run, snapshot, name: snapshot[name]
        elif kinds == {"points"} and same_particles(a, b):
            self.particles, self.how = True, "particle by particle"
            take = lambda run, snapshot, name: snapshot[name]
        else:
            left_out.add("position")
            self.grid_run = self.target(a, b)
            take = lambda run, snapshot, name: cell_means(run, snapshot, name, self.grid_run.grid)
            cells = f"{self.grid_run.grid.x_centre.size} x {self.grid_run.grid.y_centre.size} cells of {'AB'[self.grid_run is b]}"
            self.how = f"means over the {cells}" + {
                1: ", by cubic interpolation of sums over cells" if kinds == {"grid"} else ", each of the particles in a cell",
                2: ", those of points of the particles in a cell"}[len(kinds)]
        names = [name for name in names if name not in left_out]
        self.a, self.b = ({name: take(run, snapshot, name) for name in names} for run, snapshot in zip(self.runs, self.snapshots))
        self.units = {name: first.units(name) for name in names}
        if "points" in kinds and not self.particles:
            self.count_cells()

    @staticmethod
    def target(a, b):
        """The run whose cells are taken: the one with a grid, of two alike the coarser."""
        if a.carrier != b.carrier:
            return a if a.carrier == "grid" else b
        size = max(np.ptp(a.grid.x_corner), np.ptp(a.grid.y_corner))
        if a.carrier == "grid" and not np.allclose(a.grid.box, b.grid.box, rtol=0, atol=1e-9 * size):
            raise ResultsError(f"{a.folder} and {b.folder}: their domains differ ({', '.join(f'{side:g}' for side in a.grid.box)} and "
                               f"{', '.join(f'{side:g}' for side in b.grid.box)} m: left, bottom, right, top); compare runs on one domain")
        return min(a, b, key=lambda run: run.grid.x_centre.size * run.grid.y_centre.size)

    def count_cells(self):
        seen = [np.isfinite(values).reshape(*values.shape[:2], -1).all(axis=-1) for values in
                (next(iter(self.a.values())), next(iter(self.b.values())))]
        both, either = int((seen[0] & seen[1]).sum()), int((seen[0] | seen[1]).sum())
        if 2 * both < either:
            raise ResultsError(f"only {both} of {either} cells have particles of both runs; compare runs of one body, or with larger cells")
        self.how += f" ({both} cells; {either - both} without particles of one are left out)"

    def rows(self):
        for name, a in self.a.items():
            b, unit = self.b[name], self.units[name]
            known = np.isfinite(a) & np.isfinite(b)
            a, b = a[known], b[known]
            limits = lambda values: f"{values.min():.5g} to {values.max():.5g}"
            yield [plot.label(name, unit), f"{rms(b - a):.4g}", f"{np.abs(b - a).max():.4g}",
                   limits(a), limits(b)]


# --- histories -------------------------------------------------------------------------------------------------------------


def series(run):
    """The history, of material_point one of each method and tolerance: columns of numbers by label."""
    history = run.history
    if run.carrier != "point":
        return {"": dict(history)}
    kinds = dict.fromkeys(zip(history["method"].tolist(), history["tolerance"].tolist()))
    return {f"{method}, {tolerance:g}: ": {name: column[(history["method"] == method) & (history["tolerance"] == tolerance)]
                                           for name, column in history.items() if name not in ("method", "tolerance")}
            for method, tolerance in kinds}


class Histories:
    """Columns that both runs have, at the times of the one with fewer rows, the other's interpolated linearly."""

    def __init__(self, a, b):
        ours, theirs = series(a), series(b)
        self.pairs = {}
        for kind in ours:
            if kind in theirs:
                self.pairs.update(self.align(kind, ours[kind], theirs[kind]))
        if not self.pairs:
            raise ResultsError(f"{a.folder} and {b.folder}: their histories share no column and time; compare runs of one kind")

    @staticmethod
    def align(kind, a, b):
        rows = min((a["time_s"], b["time_s"]), key=len)
        first, last = (choose(a["time_s"][end], b["time_s"][end]) for choose, end in ((max, 0), (min, -1)))
        times = rows[(rows >= first) & (rows <= last)]
        for name in a:
            if name in b and name not in ("time_s", "step", "dt_s") and times.size and a[name].dtype.kind == b[name].dtype.kind == "f":
                at = lambda run: run[name] if np.array_equal(run["time_s"], times) else np.interp(times, run["time_s"], run[name])
                yield kind + name, (times, at(a), at(b))

    def rows(self):
        for name, (_, a, b) in self.pairs.items():
            known = np.isfinite(a) & np.isfinite(b)
            if not known.any():
                continue
            a, b = a[known], b[known]
            largest, spread = np.abs(b - a).max(), max(a.max(), b.max()) - min(a.min(), b.min())
            yield [name, f"{largest:.4g}", f"{rms(b - a):.4g}", f"{largest / spread:.3g}" if spread > 0 else "0"]


# --- report and figure -----------------------------------------------------------------------------------------------------


def parameters(a, b):
    """Those of both that differ, with their values if these are short."""
    found = []
    for name in a.parameters:
        values = [run.parameters.get(name) for run in (a, b)]
        if name not in BOOKKEEPING and name in b.parameters and values[0] != values[1]:
            short = all(not isinstance(value, (dict, list)) for value in values)
            found.append(f"{name} ({values[0]}, {values[1]})" if short else name)
    return found


def report(a, b, fields, histories):
    differing = parameters(a, b)
    text = "# Difference of two runs\n\n"
    text += ", ".join(f"{letter}: {run.folder} ({run.program}, {run.summary['status']})" for letter, run in (("A", a), ("B", b)))
    text += f".\nParameters that differ: {', '.join(differing) if differing else 'none'}.\n"
    if fields:
        text += f"\n## Fields at {fields.time:.6g} s\n\nCompared {fields.how}.\n\n"
        text += markdown_table(["quantity", "root mean square of B - A", "largest", "range of A", "range of B"], fields.rows())
    text += "\n## Histories\n\nAt the times of the run with fewer rows, linear between those of the other.\n\n"
    return text + markdown_table(["column", "largest of B - A", "root mean square", "largest over the range"], histories.rows())


def draw(a, b, fields, histories, path):
    """A row for each of some quantities, A, B and B - A, and a row for the curve that the runs are about."""
    names = []
    if fields:
        names = [name for name in plot.default_fields(a) if name in fields.a] or list(fields.a)
        names = names[:DRAWN]
        shown = 0 if fields.particles or fields.grid_run is a else 1
        view = plot.View((a, b)[shown], [fields.snapshots[shown]])
        height = plot.SIDE * np.clip(view.aspect, 0.3, 1.6)
    figure = plt.figure(figsize=(11, (len(names) * (height + 0.8) if names else 0) + 3.4), layout="constrained")
    parts = figure.subfigures(2 if names else 1, 1, squeeze=False, height_ratios=[len(names) * (height + 0.8), 3.4] if names else None)
    if names:
        axes = parts[0, 0].subplots(len(names), 3, squeeze=False, sharex=True, sharey=True)
    for row, name in enumerate(names):
        size = lambda values: np.linalg.norm(values, axis=-1) if values.ndim > (1 if fields.particles else 2) else values
        both = plot.Quantity(plot.words(name), [size(fields.a[name]), size(fields.b[name])], fields.units[name])
        difference = plot.Quantity("B − A", [size(fields.b[name] - fields.a[name])], fields.units[name])
        for column, (one, k, title) in enumerate(((both, 0, "A"), (both, 1, "B"), (difference, 0, "B − A"))):
            here = axes[row, column]
            image = view.draw_cells(here, one, one.values[k]) if not fields.particles else \
                view.draw_particles(here, fields.snapshots[k], one, one.values[k])
            if row == 0:
                here.set_title(title, fontsize="medium")
            if column:
                plot.colour_bar(parts[0, 0], image, one, axes[row, :2] if column == 1 else here, "right")
        axes[row, 0].set_ylabel(f"{view.names[1]} [{view.unit}]")
    if names:
        for here in axes[-1]:
            here.set_xlabel(f"{view.names[0]} [{view.unit}]")
    left, right = parts[-1, 0].subplots(1, 2)
    x, y = plot.default_curve(a)
    compared = {name.rpartition(": ")[2]: pair for name, pair in reversed(histories.pairs.items())}
    if y not in compared or x not in a.history or x not in b.history:
        x, y = "time_s", list(compared)[-1]
    plot.plot_lines(left, [plot.lines(run, letter, x, y)[0] for run, letter in ((a, "A"), (b, "B"))], x, y)
    left.lines[1].set_linestyle("--")
    left.legend(frameon=False)
    times, first, second = compared[y]
    plot.plot_lines(right, [("", times, second - first)], "time_s", y)
    right.set_title("B − A", fontsize="medium")
    plot.write(path, lambda temporary: figure.savefig(temporary, dpi=plot.DOTS))
    plt.close(figure)


def compare(options):
    a, b = Run(options.a), Run(options.b)
    if ("point" in (a.carrier, b.carrier)) and a.carrier != b.carrier:
        raise ResultsError(f"{a.folder} and {b.folder}: one point and a body share nothing; compare two runs of material_point")
    if options.output and options.output.suffix != ".md":
        raise ResultsError(f"{options.output}: the name must end in .md; the figure goes beside it")
    fields = Fields(a, b, options.time) if a.carrier != "point" else None
    histories = Histories(a, b)
    text = report(a, b, fields, histories)
    print(text)
    if options.output:
        temporary = options.output.with_suffix(".part.md")
        try:
            temporary.write_text(text)
            os.replace(temporary, options.output)
        except OSError as error:
            raise ResultsError(f"{options.output}: cannot be written ({error.strerror}); choose another --output") from None
        draw(a, b, fields, histories, options.output.with_suffix(".png"))


def main():
    parser = plot.Parser(prog="compare", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("a", metavar="A", type=Path, help="the folder that a run left")
    parser.add_argument("b", metavar="B", type=Path, help="the folder that another run left")
    parser.add_argument("--time", metavar="T", type=float, help="the time of the fields [s] (default: the last that both have)")
    parser.add_argument("--output", metavar="FILE.md", type=Path, help="keep the tables here, and a figure beside them")
    return plot.obey(parser, compare)


if __name__ == "__main__":
    sys.exit(main())
