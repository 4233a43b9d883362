#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a change keeps the bits: records history.csv and the snapshots of small runs of every scheme, method, form, shape and
solver, and compares two records number by number.

    verification/guard.py record out/guard/before                    # with build/release, some minutes
    verification/guard.py record out/guard/after
    verification/guard.py compare out/guard/before out/guard/after   # status 1 if a bit differs

Rows at t = 0 are left out. Columns and datasets that only one record has are named, and are no difference.
"""

import argparse
import concurrent.futures
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from results import Run

ROOT = Path(__file__).resolve().parent.parent

SCHEMES = ("euler", "substepped", "incremental", "extrapolated", "ralston", "bogacki-shampine", "dormand-prince", "chebyshev", "arkode-2",
           "arkode-3", "arkode-4", "arkode-5", "cvode-adams", "cvode-bdf", "ida", "mri")
FIXED = ("euler", "substepped", "incremental", "extrapolated", "mri")  # have a fixed step by nature
SCENES = {
    "paper": ("--initial", "paper"),
    "uniform": ("--initial", "uniform", "--initial-base", "660"),
    "gaussian": ("--initial", "gaussian", "--initial-base", "620", "--initial-amplitude", "60", "--initial-length", "0.002"),
    "random": ("--initial", "random", "--initial-amplitude", "10", "--initial-length", "0.002"),
    "reversal": ("--initial", "paper", "--wall-history", "0:5e-4,0.4:5e-4,0.4:-5e-4"),
}
PROGRAMS = {  # a short part of each; steps of implicit methods are a hundred explicit ones
    "elastic_bar": ("0.00484", "0.484", "4"),
    "plastic_bar": ("0.004778", "0.4778", "4"),
    "colliding_disks": ("0.0243", "0.24", "80"),
    "upsetting": ("9.5585e-8", "9.5585e-6", "2.0e-3"),
    "vibrating_bar": ("0.02", "0.2", "20"),
    "taylor_bar": ("1e-8", "1e-7", "2e-5"),
}
SOLVERS = ("newton-cg", "newton-gmres", "kinsol-gmres", "kinsol-fgmres", "kinsol-bicgstab", "kinsol-cg")


def cases():
    """name: program and options"""
    for scene, options in SCENES.items():
        for model in ("full", "reduced"):
            for scheme in SCHEMES:
                if scene != "paper" and scheme in ("ida", "mri"):
                    continue  # slow, and the same code
                step = "fixed" if scheme in FIXED else "adaptive"
                yield f"{scheme}, {model}, {scene}", ("shear_band", "--cells", "64", "--model", model, "--scheme", scheme, "--step", step,
                                                      "--duration", "0.7", "--snapshots", "0.7", *options)
    for scheme in ("incremental", "extrapolated"):
        yield f"{scheme}, adaptive", ("shear_band", "--cells", "64", "--scheme", scheme, "--step", "adaptive", "--duration", "0.7", "--snapshots", "0.7")
    for base in ("700", "1200"):  # gentle, and so stiff that the other method takes over
        yield f"auto from {base} K", ("shear_band", "--cells", "32", "--scheme", "auto", "--initial-base", base, "--snapshots", "1.4175")
    yield "cholesky", ("shear_band", "--cells", "64x48", "--equilibrium", "cholesky", "--scheme", "bogacki-shampine", "--duration", "0.7", "--snapshots", "0.7")
    for program, (stable, step, duration) in PROGRAMS.items():
        common = (program, "--duration", duration, "--snapshots", "0")
        for shape in ("linear", "gimp", "bspline"):
            short = str(float(duration) / 20)
            yield f"{program}, explicit, {shape}", (program, "--method", "explicit", "--dt", stable, "--duration", short, "--snapshots", "0", "--shape", shape)
            for method in ("implicit", "midpoint", "quasi-static"):
                if method == "quasi-static" and program in ("colliding_disks", "vibrating_bar", "taylor_bar"):
                    continue  # nothing holds these bodies
                yield f"{program}, {method}, {shape}", (*common, "--method", method, "--dt", step, "--shape", shape)
        yield f"{program}, implicit, momentum", (*common, "--method", "implicit", "--form", "momentum", "--dt", step)
        for solver in SOLVERS:
            yield f"{program}, {solver}", (*common, "--method", "implicit", "--dt", step, "--solver", solver)


def numbers(folder):
    """history/COLUMN without the rows at t = 0, and fields/SNAPSHOT/DATASET."""
    found = {}
    run = Run(folder)
    for name, column in run.history.items():
        found[f"history/{name}"] = column[run.history["step"] > 0]
    for snapshot in run.snapshots:
        for name in snapshot.names:
            found[f"fields/{snapshot.name}/{name}"] = snapshot[name]
    return found


def record_one(programs, target, number, name, words):
    folder = target / "runs" / f"{number:03}"
    shutil.rmtree(folder, ignore_errors=True)
    done = subprocess.run([programs / words[0], *words[1:], "--quiet", "--threads", "1", "--output", folder], capture_output=True, text=True)
    found = {"status": np.array(done.returncode)}
    if (folder / "history.csv").exists() and (folder / "fields.h5").exists():
        found.update(numbers(folder))
    np.savez(target / f"{number:03}.npz", name=name, **{key.replace("/", "|"): value for key, value in found.items()})
    shutil.rmtree(folder, ignore_errors=True)


def record(programs, target, jobs):
    target.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for done in [pool.submit(record_one, programs, target, k, name, words) for k, (name, words) in enumerate(cases())]:
            done.result()


def load(folder):
    records = {}
    for file in sorted(folder.glob("*.npz")):
        with np.load(file) as stored:
            records[str(stored["name"])] = {key.replace("|", "/"): stored[key] for key in stored.files if key != "name"}
    return records


def largest_difference(a, b):
    """Relative to the largest number of the first."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape:
        return f"{a.shape} against {b.shape}"
    size = np.nanmax(np.abs(a), initial=0.0)
    return f"{np.nanmax(np.abs(a - b), initial=0.0) / (size or 1.0):.1e}"


def compare(before, after):
    """Prints what differs; returns the number of runs that differ."""
    differing, only = 0, set()
    before, after = load(before), load(after)
    for name in before.keys() | after.keys():
        if name not in before or name not in after:
            print(f"{name}: in one record only")
            differing += 1
            continue
        a, b = before[name], after[name]
        only |= {key for key in a.keys() ^ b.keys()}
        differences = [f"{key} {largest_difference(a[key], b[key])}" for key in a if key in b and a[key].tobytes() != b[key].tobytes()]
        if differences:
            differing += 1
            print(f"{name}: {'; '.join(differences)}")
    print(f"{len(before) - differing} of {len(before)} runs keep every bit")
    if only:
        print("in one record only: " + ", ".join(sorted(only)))
    return differing


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sub = p.add_subparsers(dest="action", required=True)
    recording = sub.add_parser("record", help="run everything and keep the numbers")
    recording.add_argument("folder", type=Path)
    recording.add_argument("--programs", type=Path, default=ROOT / "build/release", help="folder of the programs (default: build/release)")
    recording.add_argument("--jobs", type=int, default=os.cpu_count())
    comparing = sub.add_parser("compare", help="compare two records")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    arguments = p.parse_args()
    if arguments.action == "record":
        record(arguments.programs, arguments.folder, arguments.jobs)
    else:
        sys.exit(1 if compare(arguments.before, arguments.after) else 0)


if __name__ == "__main__":
    main()
