# SPDX-License-Identifier: GPL-3.0-or-later
"""The way to read results in Python: everything that a run of a program left in its output folder, in SI units.

    import results

    run = results.Run("out/upsetting")
    run.summary["warnings"], run.parameters["duration"]    # summary.json as dictionaries
    run.history["load_N"]                                  # a column of history.csv; the unit ends its name
    run.times                                              # of the snapshots [s]
    last = run.snapshots[-1]
    last.names, last.units("stress_yy"), last["stress_yy"] # what fields.h5 holds of it
    last["von_mises_stress"]                               # what follows from the stress is found where it is not stored
    last.at("tau", x, y)                                   # a row for each y, anywhere, if the space is "elements"
    run.grid.x_corner, run.grid.x_centre                   # of the cells, of the background grid with particles
    for body in run.rigid_bodies:
        body.name, body.displacement(last.time), last.rigid_points(body.name)

`run.carrier` says what carries the fields. On a "grid" a field has a row for each y and a column for each x; `last.centring(name)`
says whether at a "cell" or at a "corner". With "points" a field has a value for each particle, in the order of their numbers
`last["id"]`, and they are at `last["position"]`. A "point" (material_point) has no snapshots, and a row of its history for each step of
each `method` and `tolerance`.

What is not there, not finished or of another format is a ResultsError of one line.
"""

import csv
import difflib
import functools
import json
from pathlib import Path

import h5py
import numpy as np

RIGID = "rigid_body_"  # begins the names of datasets that are no fields
CARRIERS = {"ductile fields 1": "grid", "ductile particles 1": "points"}  # by the format of fields.h5


class ResultsError(Exception):
    """What was wrong, where, and what to do, in one line."""


def one_of(name, names, what):
    """Refuses a name that is none of them."""
    if name not in names:
        near = difflib.get_close_matches(name, names, 1)
        raise ResultsError(f"{what} '{name}' is missing." + (f" Did you mean '{near[0]}'?" if near else f" There are: {', '.join(names)}"))


class Columns(dict):
    """Arrays by name; one that is missing is an error that says which there are."""

    def __init__(self, path, columns):
        super().__init__(columns)
        self.path = path

    def __missing__(self, name):
        one_of(name, list(self), f"{self.path}: the column")


class Run:
    """The output folder of a run that has ended, as completed or not (`summary["status"]`)."""

    def __init__(self, folder):
        self.folder = Path(folder)
        if self.folder.is_file():
            raise ResultsError(f"{folder}: this is a file; give the folder that a run left")
        if not self.folder.is_dir():
            raise ResultsError(f"{folder}: no such folder; give the one that a run left")
        for name in ("history.csv.partial", "fields.h5.partial"):
            if (self.folder / name).exists():
                checkpoint = self.folder / "checkpoint.h5"
                again = f"go on with it by --restart {checkpoint}" if checkpoint.exists() else "run the program again"
                raise ResultsError(f"{self.folder / name}: the run has not ended; wait for it, or, if it was killed, {again}")
        path = self.folder / "summary.json"
        try:
            self.summary = json.loads(path.read_text())
        except FileNotFoundError:
            raise ResultsError(f"{folder}: it has no summary.json; give the folder that a run left") from None
        except (OSError, ValueError) as error:
            raise ResultsError(f"{path}: cannot be read ({error}); run the program again") from None
        if not isinstance(self.summary, dict) or not {"program", "status", "parameters"} <= self.summary.keys():
            raise ResultsError(f"{path}: this is not the summary of a run; give the folder that a run left")
        self.program = self.summary["program"]
        self.parameters = self.summary["parameters"]

    @functools.cached_property
    def history(self):
        """Columns of history.csv by name; those that are no numbers hold words."""
        path = self.folder / "history.csv"
        try:
            with open(path, newline="") as file:
                names, *rows = list(csv.reader(file)) or [[]]
        except (OSError, ValueError) as error:
            raise ResultsError(f"{path}: cannot be read ({error}); run the program again") from None
        if not rows:
            raise ResultsError(f"{path}: it is empty; run the program again")
        for number, row in enumerate(rows, 2):
            if len(row) != len(names):
                raise ResultsError(f"{path}, line {number}: {len(row)} values for {len(names)} columns; run the program again")

        def column(values):
            try:
                return np.array(values, float)
            except ValueError:
                return np.array(values)

        return Columns(path, {name: column([row[k] for row in rows]) for k, name in enumerate(names)})

    # --- fields.h5

    def open_fields(self):
        path = self.folder / "fields.h5"
        if not path.exists():
            raise ResultsError(f"{path}: missing; " + ("material_point writes no snapshots" if self.program == "material_point" else
                                                       "run the program again"))
        try:
            return h5py.File(path, "r")
        except OSError as error:
            raise ResultsError(f"{path}: not a readable HDF5 file ({error}); run the program again") from None

    @functools.cached_property
    def attributes(self):
        """Of fields.h5."""
        with self.open_fields() as file:
            found = dict(file.attrs)
        if found.get("format") not in CARRIERS:
            raise ResultsError(f"{self.folder / 'fields.h5'}: its format is '{found.get('format')}', known are "
                               f"{' and '.join(repr(name) for name in CARRIERS)}; read it with the version that wrote it")
        return found

    @functools.cached_property
    def carrier(self):
        """"grid", "points" or "point"."""
        return "point" if self.program == "material_point" else CARRIERS[self.attributes["format"]]

    @property
    def dimensions(self):
        """Of the array of a scalar field; that of a vector has one more."""
        return 1 if self.carrier == "points" else 2

    @functools.cached_property
    def geometry(self):
        """"plane-strain", "plane-stress" or "axisymmetric"."""
        return self.parameters["grid"]["geometry"] if isinstance(self.parameters.get("grid"), dict) else "plane-strain"

    @property
    def has_snapshots(self):
        if self.carrier == "point":
            return False
        with self.open_fields() as file:
            return len(file.get("snapshots", ())) > 0

    @functools.cached_property
    def snapshots(self):
        self.attributes  # refuses other formats
        with self.open_fields() as file:
            if not len(file.get("snapshots", ())):
                raise ResultsError(f"{self.folder / 'fields.h5'}: it has no snapshots; run the program with --snapshots")
            return [Snapshot(self, name, group) for name, group in sorted(file["snapshots"].items())]

    @property
    def times(self):
        """Of the snapshots [s]."""
        return np.array([snapshot.time for snapshot in self.snapshots])

    @functools.cached_property
    def grid(self):
        if self.carrier == "points":
            side = lambda start, size, cells: self.attributes[start] + self.attributes[size] * np.arange(int(self.attributes[cells]) + 1)
            return Grid(side("grid_left_m", "cell_width_m", "cells_x"), side("grid_bottom_m", "cell_height_m", "cells_y"))
        with self.open_fields() as file:
            return Grid(*(file["grid"][name][()] for name in ("x_corner", "y_corner", "x_centre", "y_centre")))

    @property
    def rigid_bodies(self):
        return [RigidBody(entry) for entry in self.parameters.get("rigid-bodies") or []]


class Grid:
    """Corners and centres of the cells [m]. Centres lie where values are taken, of unequal rows not halfway between corners."""

    def __init__(self, x_corner, y_corner, x_centre=None, y_centre=None):
        halfway = lambda edges: (edges[1:] + edges[:-1]) / 2
        self.x_corner, self.y_corner = x_corner, y_corner
        self.x_centre = halfway(x_corner) if x_centre is None else x_centre
        self.y_centre = halfway(y_corner) if y_centre is None else y_centre

    @property
    def box(self):
        """Left, bottom, right, top."""
        return self.x_corner[0], self.y_corner[0], self.x_corner[-1], self.y_corner[-1]


# --- snapshots -------------------------------------------------------------------------------------------------------------

FROM_STRESS = {  # what follows from the stresses xx, yy, zz and xy, alike for both carriers
    "stress_xx": lambda xx, yy, zz, xy: xx,
    "stress_yy": lambda xx, yy, zz, xy: yy,
    "stress_zz": lambda xx, yy, zz, xy: zz,
    "stress_xy": lambda xx, yy, zz, xy: xy,
    "pressure": lambda xx, yy, zz, xy: -(xx + yy + zz) / 3,
    "s": lambda xx, yy, zz, xy: (xx - yy) / 2,
    "tau": lambda xx, yy, zz, xy: xy,
    "q": lambda xx, yy, zz, xy: (2 * zz - xx - yy) / 6,
    "deviatoric_magnitude": lambda xx, yy, zz, xy: von_mises(xx, yy, zz, xy) / np.sqrt(3),
    "von_mises_stress": lambda xx, yy, zz, xy: von_mises(xx, yy, zz, xy),
}


def von_mises(xx, yy, zz, xy):
    return np.sqrt(((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) / 2 + 3 * xy**2)


class Snapshot:
    """Fields at a time, read when asked for."""

    def __init__(self, run, name, group):
        self.run, self.name = run, name
        self.time, self.step = float(group.attrs["time_s"]), int(group.attrs["step"])
        datasets = {key: dataset for key, dataset in group.items() if isinstance(dataset, h5py.Dataset)}
        self.attributes = {key: {"units": "1", "centring": "cell", **dataset.attrs} for key, dataset in datasets.items()
                           if not key.startswith(RIGID)}
        self.rigid_bodies = [key.removeprefix(RIGID) for key in datasets if key.startswith(RIGID)]  # those whose points are stored

    @property
    def names(self):
        """Of what the file holds."""
        return list(self.attributes)

    @property
    def quantities(self):
        """Names of what the file holds and of what follows from it."""
        stress = {"stress_xx", "pressure"} & self.attributes.keys()
        return self.names + [name for name in FROM_STRESS if stress and name not in self.attributes]

    def units(self, name):
        self.check(name)
        return self.attributes[name]["units"] if name in self.attributes else "Pa"

    def centring(self, name):
        """"cell" or "corner", of a grid."""
        self.check(name)
        return self.attributes[name]["centring"] if name in self.attributes else "cell"

    def check(self, name):
        one_of(name, self.quantities, f"{self.run.folder / 'fields.h5'}: the field")

    def __getitem__(self, name):
        self.check(name)
        if name in self.attributes:
            values = self.read(name)
            return values[self.order] if self.run.carrier == "points" else values
        if "stress_xx" in self.attributes:
            return FROM_STRESS[name](*(self[f"stress_{component}"] for component in ("xx", "yy", "zz", "xy")))
        p, s, tau, q = (self[component] for component in ("pressure", "s", "tau", "q"))
        return FROM_STRESS[name](-p + s - q, -p - s - q, -p + 2 * q, tau)

    def at(self, name, x, y):
        """Of a run on elements, the values at the places x, y [m] of the series in x and the polynomials in y: [y][x]."""
        if self.run.parameters.get("space") != "elements":
            raise ResultsError(f"{self.run.folder}: fields are known between cells on elements alone (--space elements)")
        grid, corner = self.run.grid, self.centring(name) == "corner"
        if self.run.parameters.get("snapshot-cells", "auto") != "auto" or self.run.parameters.get("adapt-elements"):
            raise ResultsError(f"{self.run.folder}: snapshots are on equal cells: leave --snapshot-cells and --adapt-elements out")
        values = self[name][:, :-1] if corner else self[name]  # the last column of corners is the first one
        places_x, places_y = (grid.x_corner[:-1], grid.y_corner) if corner else (grid.x_centre, grid.y_centre)
        across = fourier_matrix(places_x, grid.x_corner[-1] - grid.x_corner[0], np.asarray(x))
        return element_matrix(places_y, grid.y_corner[::self.run.parameters["degree"]], np.asarray(y)) @ values @ across.T

    def rigid_points(self, body):
        """Places of the points of a rigid body, a row (x, y) [m] each."""
        one_of(body, self.rigid_bodies, f"{self.run.folder / 'fields.h5'}: the rigid body")
        return self.read(RIGID + body)

    def read(self, name):
        """In the order of the file."""
        with self.run.open_fields() as file:
            return file["snapshots"][self.name][name][()]

    @functools.cached_property
    def order(self):
        return np.argsort(self.read("id"), kind="stable")


def fourier_matrix(points, width, to):
    """[to][points]: of the trigonometric polynomial through the values at equally spaced points."""
    count = len(points)
    waves = 2 * np.pi / width * np.arange(1, (count + 1) // 2)
    phase = to[:, None] - points
    sums = 1 + 2 * np.cos(waves * phase[..., None]).sum(axis=-1)
    return (sums + (np.cos(np.pi * count / width * phase) if count % 2 == 0 else 0)) / count


def element_matrix(points, edges, to):
    """[to][points]: of the polynomials through the values at the points of each element."""
    matrix = np.zeros((len(to), len(points)))
    element = np.clip(np.searchsorted(edges, to, side="right") - 1, 0, len(edges) - 2)
    for e in np.unique(element):
        inside = np.flatnonzero((points >= edges[e]) & (points <= edges[e + 1]))
        rows = np.flatnonzero(element == e)
        for j in inside:
            others = points[inside[inside != j]]
            matrix[rows, j] = np.prod((to[rows, None] - others) / (points[j] - others), axis=1)
    return matrix


# --- rigid bodies ----------------------------------------------------------------------------------------------------------


class RigidBody:
    """A rigid body of a scene: where it is, as its shape and its motion prescribe."""

    def __init__(self, entry):
        self.name, self.shape = entry["name"], entry["shape"]
        self.knots = np.atleast_2d(entry["history"] if "history" in entry else [0.0, *entry["velocity"]])

    def velocity(self, time):
        """[m/s]; linear between knots, constant before the first and after the last."""
        return np.stack([np.interp(time, self.knots[:, 0], self.knots[:, k]) for k in (1, 2)], axis=-1)

    def displacement(self, time):
        """Since t = 0 [m]."""
        knots = np.clip(self.knots[:, 0], 0, time)
        ends = np.unique([0.0, *knots, time])
        middles = (ends[1:] + ends[:-1]) / 2  # a jump of the velocity lies between two of them
        return np.diff(ends) @ self.velocity(middles) if middles.size else np.zeros(2)

    def inside(self, x, y, time):
        """Whether points lie within at a time."""
        across, up = self.displacement(time)
        return inside(self.shape, x - across, y - up)

    def box(self, time):
        """Left, bottom, right, top."""
        across, up = self.displacement(time)
        left, bottom, right, top = box(self.shape)
        return left + across, bottom + up, right + across, top + up


def inside(shape, x, y):
    (kind, numbers), = shape.items()
    if kind == "rectangle":
        left, bottom, right, top = numbers
        return (x > left) & (x < right) & (y > bottom) & (y < top)
    if kind == "disk":
        centre_x, centre_y, radius = numbers
        return np.hypot(x - centre_x, y - centre_y) < radius
    if kind == "polygon":
        odd = np.zeros(np.broadcast(x, y).shape, bool)
        for (x0, y0), (x1, y1) in zip(numbers, numbers[1:] + numbers[:1]):
            if y0 != y1:
                odd ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
        return odd
    first, *others = (inside(part, x, y) for part in numbers)
    for other in others:
        first = first | other if kind == "union" else first & ~other
    return first


def box(shape):
    (kind, numbers), = shape.items()
    if kind == "rectangle":
        return tuple(numbers)
    if kind == "disk":
        centre_x, centre_y, radius = numbers
        return centre_x - radius, centre_y - radius, centre_x + radius, centre_y + radius
    if kind == "polygon":
        return (*np.min(numbers, axis=0), *np.max(numbers, axis=0))
    boxes = np.array([box(part) for part in (numbers if kind == "union" else numbers[:1])])
    return (*boxes[:, :2].min(axis=0), *boxes[:, 2:].max(axis=0))
