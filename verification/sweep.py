#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a scene or a program for all combinations of some values, several at a time, and gathers what the summaries say in one table.

    sweep.py SCENE key=a,b,c [key=d,e ...] [--output DIR] [--jobs N]

SCENE is a file like those of drivers/scenes, or the name of a program; the keys are its options. A value that holds commas stands in
double quotes. Each run writes into a folder of its own below DIR (out/sweep/SCENE by default), named after its values; sweep.csv has a
row for each. A second call keeps what is complete and asked for again, goes on from the checkpoints of what was broken off, and adds
what is new.

    sweep.py upsetting dt=1e-4,5e-5,2.5e-5 shape=linear,gimp
    sweep.py drivers/scenes/creep.toml 'shear-traction="0:0,0.05:8e8","0:0,0.05:9e8"'
"""

import argparse
import concurrent.futures
import csv
import itertools
import os
import re
import signal
import subprocess
import sys
import threading
import zlib
from pathlib import Path

import results

ROOT = Path(__file__).resolve().parent.parent
KEPT = ("output", "threads", "quiet", "restart", "checkpoint-every", "config")  # what the sweep decides itself


class InputError(Exception):
    """What was wrong, where, and what to do, in one line."""


def parse_axis(text):
    """'key=a,b' as the key and its values."""
    key, equals, values = text.partition("=")
    key = key.removeprefix("--")
    if not equals or not re.fullmatch(r"[a-z][a-z0-9-]*", key):
        raise InputError(f"'{text}': give a key and its values as key=a,b,c")
    if key in KEPT:
        raise InputError(f"'{text}': --{key} is the sweep's own; vary options of the scene")
    found = next(csv.reader([values]), [])
    if not found or "" in found:
        raise InputError(f"'{text}': a value is missing; give them as {key}=a,b,c")
    if len(set(found)) < len(found):
        raise InputError(f"'{text}': a value stands there twice")
    return key, found


def command_of(scene, programs):
    """The words that run the scene, and its name."""
    path = Path(scene)
    if path.suffix == ".toml" or path.exists():
        if not path.is_file():
            raise InputError(f"{scene}: no such file; give a scene like those of drivers/scenes, or the name of a program")
        return [programs / "scene", path.resolve()], path.stem
    if not re.fullmatch(r"[a-z][a-z_]*", scene) or not (programs / scene).is_file():
        raise InputError(f"there is no program '{scene}' in {programs}, and no such file; ./ductile help lists the programs, ./ductile "
                         "build makes them")
    return [programs / scene], scene


def folder_name(values):
    """Unlike for unlike values, and good as the name of a folder."""
    text = ",".join(f"{key}={value}" for key, value in values.items())
    short = re.sub(r"[^A-Za-z0-9=.,:+-]", "_", text)
    return short if short == text and len(short) <= 120 else f"{short[:100]}-{zlib.crc32(text.encode()):08x}"


class Sweep:
    def __init__(self, words, axes, folder, jobs):
        self.words, self.folder, self.jobs = words, folder, jobs
        names = [key for key, _ in axes]
        if len(set(names)) < len(names):
            raise InputError("a key stands there twice; give all its values at once, as key=a,b,c")
        self.keys = names
        self.runs = [dict(zip(names, values)) for values in itertools.product(*(values for _, values in axes))]
        self.processes, self.lock, self.stopped = set(), threading.Lock(), False

    def options(self, values):
        return [f"--{key}={value}" for key, value in values.items()]

    def check(self):
        """Every run's options, before the first one starts: the configuration that it would have."""
        for values in self.runs:
            printed = subprocess.run([*self.words, *self.options(values), "--print-config"], capture_output=True, text=True)
            if printed.returncode != 0:
                raise InputError((printed.stderr.strip() or printed.stdout.strip()).removeprefix("error: "))
            yield values, printed.stdout

    def run(self, values, config):
        """How a run ended: "kept", or the status in its summary."""
        folder = self.folder / folder_name(values)
        record = folder.with_name(folder.name + ".toml")
        same = record.exists() and record.read_text() == config
        if same and status_of(folder) == "completed":
            return "kept"
        folder.parent.mkdir(parents=True, exist_ok=True)
        record.write_text(config)
        go_on = same and (folder / "checkpoint.h5").exists()
        words = [*self.words, f"--restart={folder / 'checkpoint.h5'}"] if go_on else [*self.words, *self.options(values)]
        with self.lock:
            if self.stopped:
                return "not started"
            # a process group of its own: an interrupt reaches it once, from here
            process = subprocess.Popen([*words, f"--output={folder}", "--threads=1", "--quiet=true"], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.PIPE, text=True, start_new_session=True)
            self.processes.add(process)
        said = process.communicate()[1].strip()
        with self.lock:
            self.processes.discard(process)
        return status_of(folder) or f"failed: {said.removeprefix('error: ')}"

    def stop(self, *_):
        with self.lock:
            self.stopped = True
            for process in self.processes:
                process.send_signal(signal.SIGTERM)

    def rows(self, endings):
        """A row a run: its values, how it ended, and every number of its summary."""
        found = []
        for values, ending in zip(self.runs, endings):
            row = dict(values)
            folder = self.folder / folder_name(values)
            row["folder"], row["status"] = folder.name, ending
            if (folder / "summary.json").exists():
                summary = results.Run(folder).summary
                row["status"] = summary["status"]
                row["warnings"] = len(summary["warnings"])
                numbers = {**summary, **summary.get("extra", {})}
                row.update({key: value for key, value in numbers.items() if isinstance(value, (int, float)) and key not in self.keys})
            found.append(row)
        return found

    def all(self):
        configs = list(self.check())
        endings = ["not started"] * len(configs)
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            tasks = {pool.submit(self.run, values, config): number for number, (values, config) in enumerate(configs)}
            for done, task in enumerate(concurrent.futures.as_completed(tasks), 1):
                number = tasks[task]
                endings[number] = task.result()
                print(f"{done} of {len(configs)}: {', '.join(self.options(configs[number][0]))}: {endings[number]}", flush=True)
        self.write(self.rows(endings))
        return endings

    def write(self, rows):
        names = list(dict.fromkeys(name for row in rows for name in row))
        table = self.folder / "sweep.csv"
        part = table.with_suffix(".csv.part")
        with open(part, "w", newline="") as file:
            writer = csv.DictWriter(file, names, restval="")
            writer.writeheader()
            writer.writerows(rows)
        os.replace(part, table)
        print(f"table: {table}")


def status_of(folder):
    try:
        return results.Run(folder).summary["status"]
    except results.ResultsError:
        return None


def main():
    parser = argparse.ArgumentParser(prog="sweep", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", metavar="SCENE", help="a scene file, or the name of a program")
    parser.add_argument("axes", metavar="key=a,b,c", nargs="+", help="an option and its values")
    parser.add_argument("--output", metavar="DIR", type=Path, help="where the runs go (default: out/sweep/SCENE)")
    parser.add_argument("--jobs", metavar="N", type=int, default=len(os.sched_getaffinity(0)),
                        help="runs at a time, each on one thread (default: %(default)s)")
    parser.add_argument("--programs", metavar="DIR", type=Path, default=ROOT / "build/release",
                        help="where the programs are (default: build/release of this repository)")
    options = parser.parse_args()
    try:
        if options.jobs < 1:
            raise InputError(f"--jobs {options.jobs}: at least 1 run at a time")
        words, name = command_of(options.scene, options.programs)
        sweep = Sweep(words, [parse_axis(text) for text in options.axes], options.output or Path("out/sweep") / name, options.jobs)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, sweep.stop)
        endings = sweep.all()
    except InputError as error:
        print(f"sweep: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"sweep: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    if sweep.stopped:
        print("sweep: stopped; the same command goes on", file=sys.stderr)
        return 130
    return 0 if all(ending in ("completed", "kept") for ending in endings) else 1


if __name__ == "__main__":
    sys.exit(main())
