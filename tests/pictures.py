#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of verification/results.py, plot.py and compare.py on small runs of the programs: pictures.py FOLDER_OF_THE_PROGRAMS.
Status 77 where the modules of the figures are missing."""

import contextlib
import csv
import io
import json
import math
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

try:
    import h5py
    import matplotlib.image
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}; the figures need numpy, h5py and matplotlib of {sys.executable}")
    sys.exit(77)

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "verification"))
sys.dont_write_bytecode = True

import compare  # noqa: E402
import plot  # noqa: E402
from results import ResultsError, RigidBody, Run  # noqa: E402

BLOCK = ROOT / "drivers/scenes/glass-block.toml"
RUNS = {  # programs and options
    "many": ("shear_band", "--cells", "16", "--duration", "0.1", "--snapshots", "0", "--snapshots-every", "0.001"),
    "grid": ("shear_band", "--cells", "16", "--duration", "0.6", "--snapshots", "0,0.6"),
    "oblong": ("shear_band", "--cells", "22x10", "--duration", "0.6", "--snapshots", "0,0.6"),
    "narrow": ("shear_band", "--cells", "16", "--width", "0.01", "--duration", "0.1", "--snapshots", "0,0.1"),
    "creep": ("scene", ROOT / "drivers/scenes/creep.toml", "--cells", "16", "--duration", "0.1", "--snapshots-every", "0.05"),
    "billet": ("upsetting", "--dt", "2e-4", "--duration", "3e-3", "--snapshots", "0,1e-3,2e-3,3e-3"),
    "fine billet": ("upsetting", "--dt", "2e-4", "--cell-size", "5e-4", "--duration", "3e-3", "--snapshots", "0,3e-3"),
    "bar": ("plastic_bar",),
    "disks": ("colliding_disks", "--duration", "80", "--snapshots", "0,80"),
    "strip": ("scene", ROOT / "drivers/scenes/strip-with-hole.toml", "--cell-size", "1e-3", "--duration", "0.04", "--snapshots", "0,0.04"),
    "block": ("scene", BLOCK, "--cells", "8", "--duration", "0.1", "--snapshots", "0,0.1"),
    "point": ("material_point",),
}


def setUpModule():
    global place
    place = Path(tempfile.mkdtemp(prefix="pictures-"))
    unittest.addModuleCleanup(shutil.rmtree, place)
    for name, (program, *words) in RUNS.items():
        done = subprocess.run([programs / program, *words, "--output", place / name, "--quiet", "--threads", "1"], capture_output=True,
                              text=True, timeout=60)
        assert done.returncode == 0, f"{program} {words}: {done.stderr}"


def call(module, *words):
    """Status and what was printed on both channels."""
    out, err = io.StringIO(), io.StringIO()
    with mock.patch.object(sys, "argv", ["x", *map(str, words)]), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = module.main()
        except SystemExit as stop:
            status = stop.code
    return status, out.getvalue(), err.getvalue()


def changed(name, copy, change=None):
    """A copy of a run, its fields.h5 changed by a function."""
    target = place / copy
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(place / name, target)
    if change:
        with h5py.File(target / "fields.h5", "r+") as file:
            change(file)
    return target


def rows(text):
    """The cells of a Markdown report's tables by their first word."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    return {row[0].split(" [")[0]: row[1:] for row in cells}


class Test(unittest.TestCase):
    maxDiff = None

    def refused(self, module, *words, says):
        status, _, err = call(module, *words)
        self.assertEqual(status, 2, err)
        self.assertEqual(err.count("\n"), 1, err)
        for word in says:
            self.assertIn(word, err)

    def fine(self, module, *words):
        status, out, err = call(module, *words)
        self.assertEqual((status, err), (0, ""))
        self.assertEqual(list(place.rglob("*.part.*")), [])
        return out

    def picture(self, path):
        """Pixels of a PNG of sane size that shows something."""
        with open(path, "rb") as file:
            width, height = struct.unpack(">II", file.read(24)[16:])
        for side in (width, height):
            self.assertTrue(200 < side < 4000, f"{path}: {width} x {height}")
        pixels = matplotlib.image.imread(path)[..., :3]
        self.assertGreater(pixels.std(), 0.02, path)
        return pixels


class Results(Test):
    def test_history_and_summary(self):
        for name in RUNS:
            run = Run(place / name)
            with open(place / name / "history.csv", newline="") as file:
                table = list(csv.DictReader(file))
            self.assertEqual(list(run.history), list(table[0]))
            for column, values in run.history.items():
                read = [row[column] for row in table]
                self.assertEqual(values.tolist(), read if values.dtype.kind == "U" else list(map(float, read)))
            summary = json.loads((place / name / "summary.json").read_text())
            self.assertEqual((run.summary, run.parameters), (summary, summary["parameters"]))
        self.assertEqual([Run(place / name).carrier for name in ("grid", "billet", "point")], ["grid", "points", "point"])
        self.assertEqual(Run(place / "point").history["method"].dtype.kind, "U")

    def test_snapshots(self):
        for name in ("oblong", "billet"):
            run = Run(place / name)
            with h5py.File(place / name / "fields.h5") as file:
                groups = [file["snapshots"][group] for group in sorted(file["snapshots"])]
                self.assertEqual(run.times.tolist(), [group.attrs["time_s"] for group in groups])
                for snapshot, group in zip(run.snapshots, groups):
                    self.assertEqual(sorted(snapshot.names), sorted(name for name in group if not name.startswith("rigid_body_")))
                    self.assertEqual(snapshot.step, group.attrs["step"])
                    order = np.argsort(group["id"][()]) if "id" in group else ...
                    for field in snapshot.names:
                        np.testing.assert_array_equal(snapshot[field], group[field][()][order])
                        self.assertEqual(snapshot.units(field), group[field].attrs["units"])
        run = Run(place / "oblong")
        self.assertEqual(run.snapshots[1].centring("velocity_x"), "corner")
        self.assertEqual((run.grid.x_corner.size, run.grid.y_centre.size), (23, 10))
        with h5py.File(place / "oblong" / "fields.h5") as file:
            np.testing.assert_allclose(run.grid.x_centre, file["grid/x_centre"][()], atol=1e-15)
        np.testing.assert_allclose(Run(place / "billet").grid.box, (0, 0, 0.024, 0.018), atol=1e-15)

    def test_particles_in_the_order_of_their_numbers(self):
        def shuffle(file):
            for group in file["snapshots"].values():
                order = np.random.default_rng(1).permutation(group["id"].size)
                for name, dataset in group.items():
                    if not name.startswith("rigid_body_"):
                        dataset[...] = dataset[()][order]

        shuffled, straight = Run(changed("billet", "shuffled", shuffle)).snapshots[-1], Run(place / "billet").snapshots[-1]
        for name in straight.quantities:
            np.testing.assert_array_equal(shuffled[name], straight[name])

    def test_what_follows_from_stress(self):
        last = Run(place / "grid").snapshots[-1]
        stored = {name: last[name] for name in ("pressure", "s", "tau", "q", "deviatoric_magnitude")}
        np.testing.assert_allclose(last["von_mises_stress"], math.sqrt(3) * stored["deviatoric_magnitude"], rtol=1e-12)
        np.testing.assert_allclose(last["stress_xx"] + last["stress_yy"] + last["stress_zz"], -3 * stored["pressure"], atol=1e-3)
        last = Run(place / "billet").snapshots[-1]
        xx, yy, zz = (last[f"stress_{name}"] for name in ("xx", "yy", "zz"))
        np.testing.assert_allclose(-last["pressure"] + last["s"] - last["q"], xx, atol=1e-3)
        np.testing.assert_allclose(-last["pressure"] - last["s"] - last["q"], yy, atol=1e-3)
        np.testing.assert_allclose(-last["pressure"] + 2 * last["q"], zz, atol=1e-3)
        self.assertEqual(last.units("von_mises_stress"), "Pa")

    def test_rigid_bodies(self):
        run = Run(place / "billet")
        platen, = run.rigid_bodies
        deflection = np.interp(run.times, run.history["time_s"], run.history["deflection_m"])
        np.testing.assert_allclose([platen.displacement(time)[1] for time in run.times], -deflection, atol=1e-12)
        with h5py.File(changed("billet", "with points") / "fields.h5", "r+") as file:
            for group in file["snapshots"].values():
                if "rigid_body_platen" not in group:  # in files of before they were stored
                    group["rigid_body_platen"] = np.array([[0.002, 0.017 - group.attrs["time_s"]]])
        stored = Run(place / "with points")
        first, last = stored.snapshots[0], stored.snapshots[-1]
        self.assertEqual((last.rigid_bodies, "rigid_body_platen" in last.quantities), (["platen"], False))
        for snapshot in (first, last):
            self.assertTrue(platen.inside(*snapshot.rigid_points("platen").T, snapshot.time).all())
        for way in last.rigid_points("platen") - first.rigid_points("platen"):
            np.testing.assert_allclose(way, (0, -3e-3), atol=1e-9)
        with self.assertRaisesRegex(ResultsError, "'plate' is missing. Did you mean 'platen'"):
            last.rigid_points("plate")
        shape = {"difference": [{"union": [{"rectangle": [0, 0, 2, 2]}, {"polygon": [[2, 0], [4, 0], [2, 2]]}]}, {"disk": [1, 1, 0.5]}]}
        body = RigidBody({"name": "x", "shape": shape, "history": [[1, 2, 0], [2, 4, 0], [2, 0, -1], [3, 0, -1]]})
        # 2 m/s for a second, 3 m/s on the average for another, then downwards
        for time, way in ((0, (0, 0)), (1, (2, 0)), (2, (5, 0)), (2.5, (5, -0.5)), (5, (5, -3))):
            np.testing.assert_allclose(body.displacement(time), way, atol=1e-12)
        x, y = np.array([0.1, 1.0, 2.5, 3.5, -1.0]), np.array([0.1, 1.0, 0.5, 1.5, 0.5])
        self.assertEqual(body.inside(x, y, 0).tolist(), [True, False, True, False, False])
        self.assertEqual(body.inside(x + 2, y, 1).tolist(), [True, False, True, False, False])
        self.assertEqual(body.box(1), (2, 0, 6, 2))

    def test_mistakes(self):
        empty = place / "empty"
        empty.mkdir(exist_ok=True)
        self.refused(plot, place / "nowhere", says=["nowhere", "no such folder"])
        self.refused(plot, place / "grid" / "fields.h5", says=["fields.h5", "a file; give the folder"])
        self.refused(plot, empty, says=["empty", "no summary.json"])
        for content in ("{", "[1]", '{"program": "x"}'):
            (empty / "summary.json").write_text(content)
            self.refused(plot, empty, says=["summary.json"])
        for partial in ("history.csv.partial", "fields.h5.partial"):
            (changed("grid", "unfinished") / partial).touch()
            self.refused(plot, place / "unfinished", says=[partial, "has not ended", "--restart"])
            (place / "unfinished" / "checkpoint.h5").unlink()
            self.refused(plot, place / "unfinished", says=[partial, "run the program again"])
        other = changed("grid", "other", lambda file: file.attrs.__setitem__("format", "ductile fields 99"))
        self.refused(plot, other, says=["fields.h5", "'ductile fields 99'", "'ductile fields 1'"])
        none = changed("grid", "none", lambda file: file["snapshots"].clear())
        self.refused(plot, none, "--last", says=["fields.h5", "no snapshots"])
        (none / "fields.png").unlink(missing_ok=True)
        self.assertIn("gets a curve only", self.fine(plot, none))
        self.assertTrue((none / "curve.png").exists() and not (none / "fields.png").exists())
        (changed("grid", "damaged") / "fields.h5").write_text("no HDF5")
        self.refused(plot, place / "damaged", says=["fields.h5", "not a readable HDF5 file"])
        (place / "damaged" / "fields.h5").unlink()
        self.refused(plot, place / "damaged", says=["fields.h5", "missing"])
        with open(changed("grid", "torn") / "history.csv", "a") as file:
            file.write("1,2\n")
        self.refused(plot, place / "torn", "--curve", "time_s,wall_strain", says=["history.csv, line", "2 values"])
        (place / "torn" / "history.csv").write_text("")
        self.refused(plot, place / "torn", "--curve", "time_s,wall_strain", says=["history.csv", "empty"])
        self.refused(plot, place / "grid", "--field", "presure", says=["'presure' is missing", "Did you mean 'pressure'?"])
        self.refused(plot, place / "grid", "--curve", "time_s,xyz", says=["history.csv", "'xyz' is missing", "wall_strain"])


class Plot(Test):
    def test_defaults(self):
        for name in ("creep", "billet", "bar", "disks", "strip"):  # the other grids are drawn below
            self.fine(plot, place / name)
            fields = self.picture(place / name / "fields.png")
            self.picture(place / name / "curve.png")
            grey = np.all(np.abs(fields - 0.5) < 0.01, axis=-1).sum()
            self.assertEqual(grey > 1000, name in ("billet", "bar", "strip"), f"{name}: {grey} pixels of rigid bodies")
        self.fine(plot, place / "point")
        self.picture(place / "point" / "curve.png")
        self.assertFalse((place / "point" / "fields.png").exists())

    def test_many_snapshots(self):
        run = Run(place / "many")
        self.assertEqual(len(run.snapshots), 101)
        chosen = [snapshot.time for snapshot in plot.choose(run, None, False)]
        np.testing.assert_allclose(chosen, [0, 0.02, 0.04, 0.06, 0.08, 0.1], atol=1e-12)
        self.fine(plot, run.folder, "--field", "tau,velocity_x")
        self.picture(run.folder / "fields.png")
        sheet = plot.Sheet(plot.View(run, run.snapshots[:1]), 101, [None])
        self.assertLess(plot.DOTS * sheet.figure.get_size_inches().max(), 3800)
        plot.plt.close(sheet.figure)

    def test_times(self):
        run = Run(place / "billet")
        chosen = lambda *arguments: [snapshot.time for snapshot in plot.choose(run, *arguments)]
        self.assertEqual(chosen(None, True), [3e-3])
        self.assertEqual(chosen([0.9e-3, 1.1e-3, 3e-3], False), [1e-3, 3e-3])
        self.refused(plot, run.folder, "--times", "1", says=["no snapshot at 1 s", "0 to 0.003 s"])

    def test_movie(self):
        with mock.patch("plot.shutil.which", return_value=None):
            self.fine(plot, place / "billet", "--movie", "--field", "plastic_strain")
            self.refused(plot, place / "billet", "--movie", "--output", place / "x.mp4", says=["needs ffmpeg", ".gif"])
        with open(place / "billet" / "fields.gif", "rb") as file:
            content = file.read()
        self.assertTrue(content.startswith(b"GIF89a"))
        self.assertEqual(content.count(b"\x21\xf9\x04"), 4, "frames")
        if shutil.which("ffmpeg"):
            self.fine(plot, place / "billet", "--movie", "--field", "plastic_strain")
            self.assertGreater((place / "billet" / "fields.mp4").stat().st_size, 1000)

    def test_several_folders(self):
        out = place / "together"
        printed = self.fine(plot, place / "grid", place / "oblong", "--output", out)
        self.assertEqual(printed.count("figure: "), 3)
        for name in ("grid-fields.png", "oblong-fields.png", "curve.png"):
            self.picture(out / name)
        drawn = []
        with mock.patch("plot.plot_lines", side_effect=lambda axes, lines, x, y: drawn.extend((line[0], x, y) for line in lines)):
            call(plot, place / "grid", place / "oblong", "--curve", "time_s,wall_strain", "--output", out)
        self.assertEqual(drawn, [("grid", "time_s", "wall_strain"), ("oblong", "time_s", "wall_strain")])
        self.fine(plot, place / "grid", place / "oblong", "--curve", "time_s,wall_strain")
        self.picture(place / "curve.png")

    def test_vectors_and_unknown_names(self):
        def add(file):
            for group in file["snapshots"].values():
                data = np.zeros((group["id"].size, 2))
                data[:, 0], data[:, 1] = 3e-6 * np.arange(len(data)), 4e-6 * np.arange(len(data))
                group.create_dataset("way_so_far", data=data).attrs["units"] = "m"

        run = Run(changed("bar", "vectors", add))
        one = plot.quantity("way_so_far", run.snapshots)
        np.testing.assert_allclose(one.values[0], 5e-6 * np.arange(36))
        self.assertEqual(one.label, "magnitude of the way so far [µm]")
        self.fine(plot, run.folder, "--field", "way_so_far", "--last")
        self.assertEqual(plot.words("some_flow_y"), "some flow in y")

    def test_scales(self):
        make = lambda unit, *values: plot.Quantity("x", [np.array(value, float) for value in values], unit)
        signed, positive = make("Pa", [-1e6, 2e6], [0, 1e6]), make("K", [600, 700], [900, 800])
        self.assertEqual((signed.low, signed.high, signed.colours, signed.label), (-2, 2, "RdBu_r", "x [MPa]"))
        self.assertEqual((positive.low, positive.high, positive.colours, positive.label), (600, 900, "inferno", "x [K]"))
        peak = make("1", [*np.linspace(0, 1, 3000), 50])
        self.assertEqual((peak.extend, peak.low), ("max", 0))
        self.assertLess(peak.high, 1.01)
        flat = make("Pa", [0, 0])
        self.assertEqual((flat.low, flat.high), (0, 1))  # no stress of von Mises is negative
        self.assertEqual([plot.scale_of(unit, size)[1] for unit, size in (("m", 0.02), ("m", 0.7), ("Pa", 3e9), ("s", 3e-5), ("K", 1e4))],
                         ["mm", "m", "MPa", "µs", "K"])
        wave = 1e-6 * np.sin(np.arange(256)).reshape(16, 16)
        run = Run(changed("grid", "tiny pressure", lambda file: file["snapshots/000001/pressure"].write_direct(wave)))
        pressure, tau = plot.quantities_of(["pressure", "tau"], run.snapshots)
        self.assertEqual((pressure.label, tau.label), ("pressure [MPa]", r"shear stress $\tau$ [MPa]"))
        np.testing.assert_allclose([-pressure.low, pressure.high], 1e-9 * tau.high)
        self.assertEqual(plot.name_and_unit("wall_strain_rate_1/s"), ("wall_strain_rate", "1/s"))
        self.assertEqual(plot.name_and_unit("wall_strain"), ("wall_strain", "1"))

    def test_curves(self):
        run = Run(place / "point")
        lines = plot.lines(run, "", "time_s", "tau_Pa")
        method, tolerance = run.history["method"], run.history["tolerance"]
        self.assertEqual([line[0] for line in lines], list(dict.fromkeys(method)))
        for name, times, tau in lines:
            rows = (method == name) & (tolerance == 1e-8)
            np.testing.assert_array_equal([times, tau], [run.history["time_s"][rows], run.history["tau_Pa"][rows]])
        figure, axes = plot.plt.subplots()
        plot.plot_lines(axes, [("a", np.array([0, 2e-3]), np.array([0, -3e4])), ("b", np.array([0, 1e-3]), np.array([0, np.nan]))],
                        "time_s", "load_N")
        self.assertEqual((axes.get_xlabel(), axes.get_ylabel()), ("time [ms]", "load [kN]"))
        np.testing.assert_allclose(axes.lines[0].get_xydata(), [[0, 0], [2, -30]])
        plot.plt.close(figure)

    def test_particles_are_drawn_as_they_are_stretched(self):
        run = Run(place / "bar")
        view = plot.View(run, run.snapshots)
        np.testing.assert_allclose(view.sides, 0.05)
        first, last = (view.neighbours.outlines(snapshot) for snapshot in run.snapshots)
        np.testing.assert_allclose(np.ptp(first, axis=1), 0.05)
        np.testing.assert_allclose([np.ptp(first[..., 0]), np.ptp(last[..., 0])], [0.3, 0.324], rtol=0.01)
        np.testing.assert_allclose(np.ptp(last[..., 0], axis=1).mean(), 0.05 * 1.08, rtol=0.01)

    def test_mistakes(self):
        grid, point = place / "grid", place / "point"
        self.refused(plot, says=["OUT"])
        self.refused(plot, grid, "--fields", "tau", says=["--fields"])
        self.refused(plot, grid, "--times", "x", says=["--times"])
        self.refused(plot, grid, "--curve", "x", says=["--curve"])
        self.refused(plot, grid, "--times", "0", "--last", says=["not allowed with"])
        self.refused(plot, point, "--last", says=["point", "no snapshots"])
        self.refused(plot, point, "--curve", "time_s,method", says=["'method' holds words"])
        self.refused(plot, grid, "--output", place / "x.png", says=["several figures"])
        self.refused(plot, grid, "--last", "--output", place / "x.doc", says=["x.doc", ".png"])
        self.refused(plot, grid, "--last", "--output", place / "nowhere" / "x.png", says=["x.png", "cannot be written"])
        self.refused(plot, grid, "--output", grid / "summary.json" / "x", says=["cannot be made"])


class Compare(Test):
    def values(self, *words):
        return rows(self.fine(compare, *words))

    def test_with_itself(self):
        for name in ("grid", "billet", "point"):
            for row, (first, second, *_) in self.values(place / name, place / name).items():
                if row not in ("quantity", "column") and not row.startswith("---"):
                    self.assertEqual((float(first), float(second)), (0, 0), f"{name}: {row}")

    def test_shift(self):
        def shift(file):
            file["snapshots/000001/pressure"][...] += 2e6
            file["snapshots/000001/velocity_x"][3, 4] += 5.0

        shifted = changed("grid", "shifted", shift)
        text = (shifted / "history.csv").read_text().splitlines()
        column = text[0].split(",").index("wall_strain")
        lines = [line.split(",") for line in text]
        for line in lines[1:]:
            line[column] = repr(float(line[column]) + 0.25)
        (shifted / "history.csv").write_text("\n".join(map(",".join, lines)) + "\n")
        out = self.values(place / "grid", shifted)
        self.assertEqual([float(cell) for cell in out["pressure"][:2]], [2e6, 2e6])
        np.testing.assert_allclose([float(cell) for cell in out["velocity_x"][:2]], [5 / 17, 5], rtol=1e-3)
        self.assertEqual([float(cell) for cell in out["wall_strain"][:2]], [0.25, 0.25])
        strain = Run(place / "grid").history["wall_strain"].max()
        self.assertAlmostEqual(float(out["wall_strain"][2]), 0.25 / (0.25 + strain), places=3)
        pressure = Run(place / "grid").snapshots[-1]["pressure"]
        low, high = pressure.min(), pressure.max()
        self.assertEqual(out["pressure"][2:], [f"{low:.5g} to {high:.5g}", f"{low + 2e6:.5g} to {high + 2e6:.5g}"])
        at_start = self.values(place / "grid", shifted, "--time", "0")
        self.assertEqual(float(at_start["pressure"][1]), 0)

    def test_linear_field_on_two_grids(self):
        def linear(file):
            for group in file["snapshots"].values():
                for name, dataset in group.items():
                    kind = dataset.attrs["centring"]
                    x, y = (file[f"grid/{axis}_{'corner' if kind in (b'corner', 'corner') else 'centre'}"][()] for axis in "xy")
                    dataset[...] = 3.0 + 200 * x[None, :] - 500 * y[:, None]

        one, other = changed("grid", "linear", linear), changed("oblong", "linear on another", linear)
        for pair in ((one, other), (other, one)):
            text = self.fine(compare, *pair)
            self.assertIn("means over the 22 x 10 cells", text)  # of 256 and 220
            for name in ("pressure", "effective_temperature", "velocity_x"):
                self.assertLess(float(rows(text)[name][1]), 1e-12)
        run, grid = Run(one), Run(other).grid
        for name in ("pressure", "velocity_x"):
            means = compare.cell_means(run, run.snapshots[-1], name, grid)
            np.testing.assert_allclose(means, 3 + 200 * grid.x_centre[None, :] - 500 * grid.y_centre[:, None], atol=1e-11)

    def test_means_keep_sums(self):
        matrix = compare.mean_matrix(np.linspace(0, 1, 13), np.linspace(0, 1, 6))
        np.testing.assert_allclose(matrix.mean(axis=0), 1 / 12, atol=1e-14)
        nested = compare.mean_matrix(np.linspace(0, 1, 13), np.linspace(0, 1, 4))
        np.testing.assert_allclose(nested, np.kron(np.eye(3), np.full(4, 0.25)), atol=1e-13)

    def test_points_beside_a_grid(self):
        def linear(file):
            for group in file["snapshots"].values():
                if "position" in group:
                    x, y = group["position"][()].T
                else:
                    x, y = np.meshgrid(file["grid/x_centre"][()], file["grid/y_centre"][()])
                group["effective_temperature"][...] = 600 + 1000 * x + 3000 * y

        text = self.fine(compare, changed("grid", "linear", linear), changed("block", "linear points", linear), "--time", "0")
        self.assertIn("means over the 16 x 16 cells of A", text)
        self.assertIn("(256 cells; 0 without", text)
        self.assertLess(float(rows(text)["effective_temperature"][1]), 1e-9)
        text = self.fine(compare, place / "billet", place / "fine billet", "--output", place / "billets.md")
        self.assertIn("24 x 18 cells of A", text)
        self.assertEqual((place / "billets.md").read_text().strip(), text[:text.index("figure:")].strip())
        self.picture(place / "billets.png")

    def test_particle_by_particle(self):
        def shift(file):
            file["snapshots/000003/plastic_strain"][7] += 0.5

        out = self.values(place / "billet", changed("billet", "shifted billet", shift), "--output", place / "particles.md")
        self.assertEqual([float(cell) for cell in out["plastic_strain"][:2]], [float(f"{0.5 / math.sqrt(600):.4g}"), 0.5])
        self.picture(place / "particles.png")
        self.fine(compare, place / "grid", place / "oblong", "--output", place / "grids.md")
        self.picture(place / "grids.png")
        self.fine(compare, place / "point", place / "point", "--output", place / "points.md")
        self.picture(place / "points.png")

    def test_histories_at_common_times(self):
        t = np.linspace(0, 1, 11)
        a = {"time_s": t, "load_N": 3 * t}
        b = {"time_s": np.linspace(0.2, 1.4, 5), "load_N": 3 * np.linspace(0.2, 1.4, 5) + 1}
        (_, (times, first, second)), = compare.Histories.align("", a, b)
        np.testing.assert_allclose(times, [0.2, 0.5, 0.8], atol=1e-12)
        np.testing.assert_allclose(second - first, 1)

    def test_mistakes(self):
        grid = place / "grid"
        self.refused(compare, grid, says=["B"])
        self.refused(compare, grid, place / "point", says=["one point"])
        self.refused(compare, grid, grid, "--time", "0.3", says=["at 0.3 s", "0, 0.6 s"])
        self.refused(compare, grid, grid, "--output", "x.txt", says=["x.txt", ".md"])
        self.refused(compare, grid, grid, "--output", place / "nowhere" / "x.md", says=["x.md", "cannot be written"])
        self.refused(compare, grid, place / "narrow", "--time", "0", says=["domains differ"])
        self.refused(compare, place / "billet", place / "disks", says=["only 0 of"])
        later = changed("grid", "later", lambda file: [group.attrs.__setitem__("time_s", 7.0 + k)
                                                        for k, group in enumerate(file["snapshots"].values())])
        self.refused(compare, grid, later, says=["share no time"])


if __name__ == "__main__":
    programs = Path(sys.argv.pop(1)).resolve()
    unittest.main()
