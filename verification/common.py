# SPDX-License-Identifier: GPL-3.0-or-later
"""What the verification studies share: runs of shear_band that are kept and found again, final fields in natural units, the
norm of Lu & Rycroft's Eq. (59), interpolation between grids that do not nest, orders of accuracy, and result files."""

import argparse
import concurrent.futures
import csv
import datetime
import os
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import h5py
import matplotlib
import numpy as np

from results import ResultsError, Run

matplotlib.use("Agg")

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "verification" / "results"

LENGTH = 0.01            # L [m]: the domain is [-L, L]^2
TIME = 4.05e-6           # t_s [s]
WALL = 2e-7 * LENGTH / TIME  # U [m/s]
YIELD = 0.85e9           # s_Y [Pa]
BULK, SHEAR = 122e9, 37.4e9  # K, mu [Pa]
STEADY = 900.0           # chi_inf [K]
DURATION = 1.4175        # 35e4 t_s [s]
GRIDS = (280, 360, 504)  # of Sec. 8
FIELDS = ("v", "sigma", "chi")


def constant_step(cells):
    """0.5e4 t_s h/L with h = 2 L/cells [s] (Sec. 8.1)."""
    return 1e4 / cells * TIME


# --- runs ------------------------------------------------------------------------------------------------------------------

BOOKKEEPING = ("output", "threads", "quiet", "restart", "checkpoint-every")  # options that do not change the result


def parser(description, work="out/verification/runs"):
    p = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--program", metavar="PATH", type=Path, default=ROOT / "build/release/shear_band",
                   help="shear_band, as ./ductile build makes it (default: build/release/shear_band of this repository)")
    p.add_argument("--work", metavar="DIR", type=Path, default=Path(work), help="where runs are kept (default: %(default)s)")
    p.add_argument("--results", metavar="DIR", type=Path, default=RESULTS, help="where tables and figures go")
    return p


def jobs_option(p):
    p.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at a time, each on one thread (default: %(default)s)")
    return p


def reference_option(p):
    p.add_argument("--reference", metavar="N", type=int, default=2520, help="cells of the reference (default: %(default)s)")
    return p


def command(program, options):
    """`program` may be a list of words: a program and a scene file."""
    words = [str(word) for word in (program if isinstance(program, list) else [program])]
    for name, value in options.items():
        words += [f"--{name}", ""] if value == "" else [f"--{name}={value}"]
    return words


def canonical(value):
    """One form for what TOML and JSON write differently: numbers in quotes, lists as text, lists of one element."""
    if isinstance(value, str) and "," in value:
        value = value.split(",")
    if isinstance(value, dict):
        return {name: canonical(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return canonical(value[0]) if len(value) == 1 else [canonical(element) for element in value]
    try:
        return float(value)
    except ValueError:
        return value


def decisive(parameters):
    """The options that decide the result."""
    return {name: canonical(value) for name, value in parameters.items() if name not in BOOKKEEPING}


def summary(folder):
    """summary.json of a run that has ended, or None."""
    try:
        return Run(folder).summary
    except ResultsError:
        return None


def step_seconds(summary):
    """Wall seconds of the steps alone, without files."""
    return sum(value for phase, value in summary["phase_seconds"].items() if phase != "output")


def stopped_with(folder, wanted):
    """Whether the folder holds a checkpoint of an unfinished run with these parameters."""
    try:
        with h5py.File(folder / "checkpoint.h5", "r") as file:
            return wanted.items() <= decisive(tomllib.loads(file["config"][()].decode())).items()
    except OSError:
        return False


def run(program, folder, options, threads=1, timed=False):
    """Runs shear_band into `folder`: not at all if it has been run, from the checkpoint if it was stopped (but not if it is timed).
    Returns `folder`."""
    printed = subprocess.run(command(program, options) + ["--print-config"], check=True, capture_output=True, text=True)
    wanted = decisive(tomllib.loads(printed.stdout))
    done = summary(folder)
    if done and done["status"] == "completed" and wanted.items() <= decisive(done["parameters"]).items():
        return folder
    common = {"threads": threads, "quiet": "true", "checkpoint-every": 120}
    if not timed and stopped_with(folder, wanted):
        started = command(program, {"restart": folder / "checkpoint.h5", **common})
    else:
        started = command(program, {**options, "output": folder, **common})
    print(shlex.join(started), flush=True)
    subprocess.run(started, check=True)
    return folder


def run_all(program, work, runs, jobs, timed=False):
    """Runs {name: options} into work/name, the largest grids first, and returns {name: folder}."""
    names = sorted(runs, key=lambda name: -int(runs[name]["cells"]))
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        return dict(zip(names, pool.map(lambda name: run(program, work / name, runs[name], timed=timed), names)))


# --- fields ----------------------------------------------------------------------------------------------------------------


class Fields:
    """A snapshot in natural units: v/U [2][N + 1][N] at corners (the repeated column left out); sigma/s_Y [4][N][N] as
    p, s, tau, q and chi/chi_inf [1][N][N] at cells."""

    def __init__(self, v, sigma, chi):
        self.v, self.sigma, self.chi = v, sigma, chi

    @property
    def cells(self):
        return self.chi.shape[-1]

    def map(self, function):
        return Fields(*(function(getattr(self, name)) for name in FIELDS))

    def __sub__(self, other):
        return Fields(*(getattr(self, name) - getattr(other, name) for name in FIELDS))


def load(folder, index=-1):
    """A snapshot of a run, by default the last; `.time` is in t_s."""
    snapshot = Run(folder).snapshots[index]
    read = lambda names, unit: np.stack([snapshot[name] for name in names]) / unit
    fields = Fields(read(("velocity_x", "velocity_y"), WALL)[:, :, :-1],
                    read(("pressure", "s", "tau", "q"), YIELD), read(("effective_temperature",), STEADY))
    fields.time = snapshot.time / TIME
    return fields


def norms(error):
    """Eq. (59) of each field: trapezoid in y at corners, midpoint at cells; Frobenius norm of the 3x3 stress."""
    trapezoid = np.ones(error.v.shape[1])
    trapezoid[[0, -1]] = 0.5
    v = np.mean(np.sum(error.v**2, axis=0) * trapezoid[:, None]) * error.v.shape[1] / (error.v.shape[1] - 1)
    p, s, tau, q = error.sigma
    sigma = np.mean(3 * p**2 + 2 * s**2 + 2 * tau**2 + 6 * q**2)
    chi = np.mean(error.chi**2)
    return {"v": np.sqrt(v), "sigma": np.sqrt(sigma), "chi": np.sqrt(chi)}


# --- interpolation ---------------------------------------------------------------------------------------------------------

DEGREE = 9  # of the local polynomials in y


def points(rows, corners):
    """y (or x) of corners or centres on [-1, 1]."""
    return np.linspace(-1, 1, rows) if corners else -1 + (2 * np.arange(rows) + 1) / rows


def fourier_in_x(field, cells, corners):
    """The trigonometric interpolant of a row-periodic field at the points of a grid with `cells` columns."""
    fine = field.shape[-1]
    wave = np.fft.fftfreq(fine, 1 / fine).astype(int)
    offset = 0.0 if corners else 1 / cells - 1 / fine  # from the first fine to the first coarse point
    spectrum = np.fft.fft(field) * np.exp(1j * np.pi * wave * offset)
    folded = np.zeros(field.shape[:-1] + (cells,), complex)
    np.add.at(np.moveaxis(folded, -1, 0), wave % cells, np.moveaxis(spectrum, -1, 0))
    return np.fft.ifft(folded).real * (cells / fine)


def lagrange_matrix(source, target, degree):
    """[target][source]: polynomial interpolation through the degree + 1 nearest of equidistant points."""
    spacing = source[1] - source[0]
    matrix = np.zeros((target.size, source.size))
    for row, y in enumerate(target):
        first = int(np.clip(np.floor((y - source[0]) / spacing) - degree // 2, 0, source.size - degree - 1))
        t = (y - source[first]) / spacing
        nodes = np.arange(degree + 1)
        for k in nodes:
            others = nodes[nodes != k]
            matrix[row, first + k] = np.prod((t - others) / (k - others))
    return matrix


def nested(fine, coarse):
    """Whether the corners and centres of `coarse` cells a side are among those of `fine` ones."""
    return fine % coarse == 0 and (fine // coarse) % 2 == 1


def thin(fields, factor):
    """Every factor-th point (odd factor): a grid whose centres and corners are among those of the fine one."""
    middle = factor // 2
    return Fields(fields.v[:, ::factor, ::factor], *(f[:, middle::factor, middle::factor] for f in (fields.sigma, fields.chi)))


def interpolate(fields, cells, degree=DEGREE):
    """Fields at the corners and centres of a square grid with `cells` cells a side: picked out where the grids nest."""
    if nested(fields.cells, cells):
        return thin(fields, fields.cells // cells)

    def one(field, corners):
        rows = cells + 1 if corners else cells
        in_y = lagrange_matrix(points(field.shape[-2], corners), points(rows, corners), degree)
        return in_y @ fourier_in_x(field, cells, corners)

    return Fields(one(fields.v, True), one(fields.sigma, False), one(fields.chi, False))


def interpolation_errors(fields, factor=3):
    """What interpolation from a grid `factor` times coarser than `fields` does to them: a bound on the error of
    interpolating `fields` itself, in the norms of the study."""
    return norms(interpolate(thin(fields, factor), fields.cells) - fields)


# --- orders ----------------------------------------------------------------------------------------------------------------


def slope(h, errors):
    """Linear regression of log error against log h."""
    return np.polyfit(np.log(h), np.log(errors), 1)[0]


def corrected_slope(h, errors, h_reference):
    """p of E = C (h^p - h_reference^p), least squares of log E: what remains when the reference has the error C h_reference^p
    of the same shape in space. Returns p and C."""
    h, log_errors = np.asarray(h), np.log(errors)

    def misfit(p):
        residual = log_errors - np.log(h**p - h_reference**p)
        return np.var(residual)

    orders = np.linspace(0.05, 6.0, 5951)
    p = orders[np.argmin([misfit(order) for order in orders])]
    return p, np.exp(np.mean(log_errors - np.log(h**p - h_reference**p)))


# --- results ---------------------------------------------------------------------------------------------------------------


def provenance():
    """One line for the head of a result file: date and command, without the options that only say where things are."""
    script = Path(sys.argv[0]).resolve().relative_to(ROOT)
    places = ("--program", "--work", "--results", "--jobs")
    kept = [word for before, word in zip(sys.argv, sys.argv[1:]) if before not in places and word not in places]
    return f"{datetime.date.today():%Y-%m-%d}, `{shlex.join([str(script), *kept])}`"


def markdown_table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def write_csv(path, header, rows):
    with open(path, "w", newline="") as file:
        file.write(f"# {provenance()}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def publish(results, name, text, header, rows):
    """Prints the report and keeps it as NAME.md beside its numbers, NAME.csv."""
    results.mkdir(parents=True, exist_ok=True)
    print(text)
    (results / f"{name}.md").write_text(text)
    write_csv(results / f"{name}.csv", header, rows)
