#!/usr/bin/python3
"""Draws the snapshots of a fields.h5: one row a time, and in the columns the effective temperature chi (or the plastic
strain), the pressure p and the deviatoric magnitude sbar, as in Fig. 2 of Lu & Rycroft.

    plot_fields.py out/shear_band/fields.h5 [--output figure.png]
"""

import argparse
import os
import sys

import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of the backend)

FORMAT = "ductile fields 1"


class InputError(Exception):
    """The file is not what it should be; the message is one line."""


def dataset(group, name):
    if name not in group or not isinstance(group[name], h5py.Dataset):
        raise InputError(f"dataset {group.name.rstrip('/')}/{name} is missing")
    return group[name][()]


def attribute(group, name):
    if name not in group.attrs:
        raise InputError(f"attribute {name} of {group.name} is missing")
    value = group.attrs[name]
    return value.decode() if isinstance(value, bytes) else value


class Fields:
    """What the figure shows: coordinates in metres, times in seconds, and a list of columns."""

    def __init__(self, path):
        if not os.path.isfile(path):
            raise InputError("no such file")
        try:
            file = h5py.File(path, "r")
        except OSError as error:
            raise InputError(f"not a readable HDF5 file ({error})") from None
        with file:
            found = attribute(file, "format")
            if found != FORMAT:
                raise InputError(f"its format is '{found}', this script reads '{FORMAT}'")
            self.program = attribute(file, "program")
            self.x, self.y = (dataset(file, f"grid/{name}").ravel() for name in ("x_corner", "y_corner"))
            self.x = with_last_edge(self.x, dataset(file, "grid/x_centre").size)
            self.y = with_last_edge(self.y, dataset(file, "grid/y_centre").size)
            self.time_unit = file.attrs.get("time_unit_s")
            yield_stress = file.attrs.get("yield_stress_Pa")

            if "snapshots" not in file or len(file["snapshots"]) == 0:
                raise InputError("it has no /snapshots")
            groups = [file["snapshots"][name] for name in sorted(file["snapshots"])]
            self.times = [float(attribute(group, "time_s")) for group in groups]

            def column(name, label, colours, unit=1.0, symmetric=False, shared=False):
                values = [dataset(group, name) / unit for group in groups]
                for group, field in zip(groups, values):
                    if field.shape != (self.y.size - 1, self.x.size - 1):
                        raise InputError(f"{group.name}/{name} has the shape {field.shape}, the grid has "
                                         f"{self.y.size - 1} rows of {self.x.size - 1} cells")
                return Column(values, label, colours, symmetric, shared)

            stress = (1e6, "MPa") if yield_stress is None else (float(yield_stress), "s_Y")
            in_unit = rf"\;/\;s_Y$" if stress[1] == "s_Y" else r"$ (MPa)"
            if "effective_temperature" in groups[0]:
                internal = column("effective_temperature", r"effective temperature $\chi$ (K)", "inferno", shared=True)
            else:
                internal = column("plastic_strain", "plastic strain", "inferno", shared=True)
            self.columns = [
                internal,
                column("pressure", rf"pressure $p{in_unit}", "RdBu_r", stress[0], symmetric=True),
                column("deviatoric_magnitude", rf"deviatoric magnitude $\bar s{in_unit}", "viridis", stress[0]),
            ]


def with_last_edge(corners, cells):
    """Edges of `cells` cells; a periodic direction may leave out the last one."""
    if corners.size == cells and cells >= 2:
        corners = np.append(corners, 2 * corners[-1] - corners[-2])
    if corners.size != cells + 1:
        raise InputError(f"its grid has {corners.size} corners for {cells} cells")
    return corners


class Column:
    """One quantity at all times. Stresses grow by orders of magnitude from yield to localisation, so that each of their
    pictures has a colour scale of its own; the others share one."""

    def __init__(self, values, label, colours, symmetric, shared):
        self.values, self.label, self.colours, self.shared = values, label, colours, shared
        self.scales = [Scale(values, label, symmetric)] * len(values) if shared else [
            Scale([field], label, symmetric) for field in values]


class Scale:
    """From which value to which the colours go, and at which ends values lie beyond."""

    def __init__(self, fields, label, symmetric):
        finite = np.concatenate([field[np.isfinite(field)] for field in fields])
        if finite.size == 0:
            raise InputError(f"{label}: no finite value")
        self.low, self.high = finite.min(), finite.max()
        # A few extreme cells must not turn the rest into one colour: the scale then leaves them out,
        # and the bar of the scale ends in a point.
        low, high = np.percentile(finite, [0.1, 99.9])
        if high > low and self.high - self.low > 1.5 * (high - low):
            self.low, self.high = low, high
        if symmetric:
            self.high = max(abs(self.low), abs(self.high))
            self.low = -self.high
        if not self.high - self.low > 1e-6 * max(abs(self.high), 1e-3):  # one value, but for round-off
            margin = 0.1 * max(abs(self.high), 1.0)
            self.low, self.high = self.low - margin, self.high + margin
        below, above = finite.min() < self.low, finite.max() > self.high
        self.extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[int(below), int(above)]


def time_label(seconds, unit):
    if unit is None:
        return f"t = {seconds:.4g} s"
    time = seconds / float(unit)
    if time == 0.0:
        return "$t = 0$"
    power = int(np.floor(np.log10(abs(time)) + 1e-9))
    if -2 <= power <= 3:
        return rf"$t = {time:.4g}\,t_s$"
    power -= 1 if power > 0 else 0  # 11.5e4 as in the paper, not 1.15e5
    return rf"$t = {time / 10**power:.4g}\times 10^{{{power}}}\,t_s$"


def draw(fields, path):
    rows, columns = len(fields.times), len(fields.columns)
    length, unit = next((u for u in ((1.0, "m"), (1e-2, "cm"), (1e-3, "mm"), (1e-6, "µm"))
                         if max(np.ptp(fields.x), np.ptp(fields.y)) >= u[0]), (1e-6, "µm"))
    x, y = fields.x / length, fields.y / length
    aspect = np.ptp(y) / np.ptp(x)
    width = 3.1 if aspect <= 1.0 else 3.1 / aspect
    figure, axes = plt.subplots(rows, columns, squeeze=False, sharex=True, sharey=True, layout="compressed",
                                figsize=(columns * width + 1.2, rows * width * aspect + 1.4))
    for c, column in enumerate(fields.columns):
        for r, (field, scale) in enumerate(zip(column.values, column.scales)):
            image = axes[r][c].pcolormesh(x, y, field, cmap=column.colours, vmin=scale.low, vmax=scale.high,
                                          rasterized=True)
            axes[r][c].set_aspect("equal")
            axes[r][c].locator_params(nbins=5)
            # One bar above a column that shares its scale, else one above every picture, the first with the name.
            if r == 0 or not column.shared:
                bar = figure.colorbar(image, ax=axes[:, c] if column.shared else axes[r][c], location="top",
                                      label=column.label if r == 0 else None, extend=scale.extend, aspect=25,
                                      shrink=0.95, pad=0.01 if column.shared else 0.02)
                bar.ax.locator_params(nbins=5)
                bar.formatter.set_powerlimits((-2, 4))
                bar.formatter.set_useOffset(False)
        axes[-1][c].set_xlabel(f"x ({unit})")
    for r, time in enumerate(fields.times):
        axes[r][0].set_ylabel(f"{time_label(time, fields.time_unit)}\n\ny ({unit})")
    temporary = f"{path}.part.png"  # a figure of an earlier run stays until this one is whole
    figure.savefig(temporary, dpi=150)
    os.replace(temporary, path)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fields", help="the fields.h5 that a program wrote")
    parser.add_argument("--output", metavar="PNG", help="the figure (default: fields.png beside the input)")
    options = parser.parse_args()
    output = options.output or os.path.splitext(options.fields)[0] + ".png"
    try:
        fields = Fields(options.fields)
    except InputError as error:
        print(f"plot_fields: {options.fields}: {error}", file=sys.stderr)
        return 2
    try:
        draw(fields, output)
    except OSError as error:
        print(f"plot_fields: {output}: cannot be written ({error.strerror or error})", file=sys.stderr)
        return 2
    print(f"figure: {output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
