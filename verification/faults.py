#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is lost or damaged is never silent: runs that are killed, interrupted, robbed of their disk, and files that are changed.

Both carriers (shear_band on 8 x 8 cells, upsetting a billet) run once undisturbed. Then, with a continued run each:

  mutations   1,000 changed files: bits flipped, blocks zeroed, swapped, repeated, cut out, put in, ends cut off or added, and,
              with h5py, values, shapes, types, attributes and names edited, of checkpoint.h5, fields.h5 and history.csv
  kills       200 times SIGKILL at any moment of a run that writes a checkpoint every step; every third continued run is killed, too;
              half of the runs with a snapshot nearly every step
  signals     50 times each signal that asks a program to end
  disk        file systems of many sizes that get full, and are enlarged; read-only ones; folders removed; two runs into one

A continued run must give the bits of the undisturbed one (history.csv byte by byte, every dataset of fields.h5), or end with
status 1 or 2 and a message that names the file. Anything else is a failure, and this script's status 1.

    verification/faults.py              # everything, some 15 minutes; the file systems need root
    verification/faults.py --quick      # a part, under 30 s, with nothing but Python's standard library
"""

import argparse
import collections
import csv
import datetime
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCENES = {  # program: options, end of the first part, end
    "shear_band": (["--cells", "8", "--tolerance", "1e-5"], 0.5, 1.0),
    "upsetting": (["--dt", "1e-4"], 6e-4, 1.5e-3),
}
ENDING = ["SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGXCPU", "SIGALRM", "SIGUSR1", "SIGUSR2"]
LIMIT = 120.0  # seconds: longer is a hang

Outcome = collections.namedtuple("Outcome", "status errors")


def snapshots(fields):
    """Every dataset of the snapshots of a fields.h5 as bytes, found by the index beside HDF5's own (lib/io/snapshot_index.hpp)."""
    data = fields.read_bytes()
    offset, length = (int(word, 16) for word in data[:512].split(b"\n")[1].split()[:2])
    found = {}
    while True:
        record = json.loads(data[offset:offset + length])
        if "head" in record:
            return found
        for dataset in record["datasets"]:
            size = 8
            for extent in dataset["shape"]:
                size *= extent
            found[record["group"], record["time_s"], dataset["name"]] = data[dataset["offset"]:dataset["offset"] + size]
        offset, length, _ = record["previous"]


def snapshots_by_hdf5(fields):
    """The same as everybody reads it."""
    import h5py
    with h5py.File(fields) as file:
        return {("snapshots/" + group, float(file["snapshots"][group].attrs["time_s"]), name): dataset[...].tobytes()
                for group in file["snapshots"] for name, dataset in file["snapshots"][group].items()}


class Scene:
    """A program with its undisturbed results."""

    def __init__(self, build, scratch, program, hdf5, dense=False):
        self.program, self.binary, self.scratch, self.hdf5 = program, build / program, scratch, hdf5
        options, self.middle, self.end = SCENES[program]
        count = 60 if dense else 4
        times = [self.end * k / count for k in range(count + 1)] + [self.middle]
        self.options = options + ["--threads", "1", "--snapshots", ",".join(f"{t:.9g}" for t in sorted(set(times)))]
        self.name = program + (", dense snapshots" if dense else "")
        self.whole = scratch / (self.name + " whole")
        begun = time.monotonic()
        self.must(self.run(self.whole, "--checkpoint-every", "1e-9"))
        self.seconds = time.monotonic() - begun
        self.part = scratch / (self.name + " part")
        self.must(self.run(self.part, "--duration", repr(self.middle)))
        self.reference = self.results(self.whole)

    @staticmethod
    def must(outcome):
        if outcome.status != 0:
            sys.exit(f"an undisturbed run failed: {outcome}")

    def command(self, output, *more):
        ends = [] if "--duration" in more or "--restart" in more else ["--duration", repr(self.end)]
        options = [] if "--restart" in more else self.options
        return [str(self.binary), "--quiet", *options, *ends, *(["--output", str(output)] if output else []), *more]

    def run(self, output, *more):
        try:
            done = subprocess.run(self.command(output, *more), capture_output=True, timeout=LIMIT)
            return Outcome(done.returncode, done.stderr.decode(errors="replace"))
        except subprocess.TimeoutExpired:
            return Outcome("hang", "")

    def go_on(self, folder):
        return self.run(None, "--restart", str(folder / "checkpoint.h5"), "--duration", repr(self.end), "--checkpoint-every", "600")

    def results(self, folder):
        fields = snapshots(folder / "fields.h5")
        if self.hdf5 and snapshots_by_hdf5(folder / "fields.h5") != fields:
            return None
        return (folder / "history.csv").read_bytes(), fields

    def judge(self, outcome, folder, names):
        """What came of a continued run: a word, "ok:" first where nothing is wrong."""
        if outcome.status == "hang":
            return "hang"
        if outcome.status not in (0, 1, 2):
            return f"crash: status {outcome.status}"
        if outcome.status:
            return "ok: refused by name" if any(name in outcome.errors for name in names) else "refused without a name"
        try:
            same = self.results(folder) == self.reference
        except Exception as error:  # whatever is wrong with the files
            return f"results unreadable: {error!r}"
        return "ok: same bits" if same else "silent difference"


class Table:
    def __init__(self, scratch):
        self.counts, self.bad, self.scratch = collections.Counter(), [], scratch

    def add(self, what, scene, verdict, how, folder=None):
        self.counts[what, scene, verdict] += 1
        if not verdict.startswith("ok: "):
            self.bad.append(f"{what}, {scene}: {verdict}; {how}")
            print(self.bad[-1], file=sys.stderr)
        elif folder:
            shutil.rmtree(folder, ignore_errors=True)


# --- mutations of bytes ---------------------------------------------------------------------------------------------------------


def mutate_bytes(data, chance):
    """Another file and what was done."""
    data = bytearray(data)
    size = len(data)
    at = chance.randrange(size)
    block = chance.choice((1, 8, 64, 512, 4096))
    other = chance.randrange(size)
    kind = chance.choice(("bit", "bits", "byte", "zeros", "ones", "swap", "cut off", "cut out", "repeat", "add", "noise"))
    if kind == "bit":
        data[at] ^= 1 << chance.randrange(8)
    elif kind == "bits":
        for _ in range(20):
            data[chance.randrange(size)] ^= 1 << chance.randrange(8)
    elif kind == "byte":
        data[at] = (data[at] + chance.randrange(1, 256)) % 256
    elif kind in ("zeros", "ones"):
        data[at:at + block] = (b"\0" if kind == "zeros" else b"\xff") * len(data[at:at + block])
    elif kind == "swap":
        a, b = sorted((at, other))
        block = min(block, b - a, size - b)
        data[a:a + block], data[b:b + block] = data[b:b + block], data[a:a + block]
    elif kind == "cut off":
        del data[at:]
    elif kind == "cut out":
        del data[at:at + block]
    elif kind == "repeat":
        data[at:at] = data[at:at + block]
    elif kind == "add":
        data += bytes(chance.randrange(256) for _ in range(block))
    else:
        data[at:at + block] = bytes(chance.randrange(256) for _ in range(len(data[at:at + block])))
    return bytes(data), f"{kind} at {at}, {block} bytes"


# --- mutations by h5py ----------------------------------------------------------------------------------------------------------


def mutate_hdf5(path, chance):
    import h5py
    import numpy as np
    with h5py.File(path, "r+") as file:
        datasets, attributes = [], []

        def visit(name, thing):
            if isinstance(thing, h5py.Dataset):
                datasets.append(name)
            attributes.extend((name, key) for key in thing.attrs)

        file.visititems(visit)
        attributes.extend(("/", key) for key in file.attrs)
        kind = chance.choice(("value", "nan", "shape", "type", "rename", "delete", "attribute", "attribute type", "no attribute",
                              "extra", "group instead"))
        name = chance.choice([d for d in datasets if file[d].shape != ()])
        values = file[name][...]
        where, key = chance.choice(attributes)
        if kind == "value":
            flat = values.reshape(-1)
            n = chance.randrange(flat.size)
            flat[n] = flat[n] * 1.0000001 + 1 if flat.dtype.kind == "f" else flat[n] ^ 1
            file[name][...] = values
        elif kind == "nan" and values.dtype.kind == "f":
            file[name][...] = np.full_like(values, np.nan)
        elif kind in ("shape", "type", "nan"):
            del file[name]
            file[name] = values[:-1] if kind == "shape" else values.astype("f4" if values.dtype != np.float32 else "i2")
        elif kind == "rename":
            file.move(name, name + "_x")
        elif kind == "delete":
            del file[name]
        elif kind == "attribute":
            old = file[where].attrs[key]
            file[where].attrs[key] = old + "x" if isinstance(old, str) else old + 1
        elif kind == "attribute type":
            file[where].attrs[key] = np.arange(3, dtype="i1")
        elif kind == "no attribute":
            del file[where].attrs[key]
        elif kind == "extra":
            file["arrays/extra" if "arrays" in file else "snapshots/000099/extra"] = np.arange(5.0)
        else:
            del file[name]
            file.create_group(name)
    return f"h5py: {kind}, {name}, {where} {key}"


def mutations(scenes, table, count, chance):
    files = ["checkpoint.h5"] * 5 + ["fields.h5"] * 4 + ["history.csv"]
    for n in range(count):
        scene = scenes[n % len(scenes)]
        name = chance.choice(files)
        folder = Path(tempfile.mkdtemp(dir=table.scratch))
        shutil.copytree(scene.part, folder, dirs_exist_ok=True)
        original = (folder / name).read_bytes()
        if scene.hdf5 and name.endswith("h5") and chance.random() < 0.3:
            how = mutate_hdf5(folder / name, chance)
        else:
            data, how = mutate_bytes(original, chance)
            (folder / name).write_bytes(data)
        verdict = scene.judge(scene.go_on(folder), folder, [name])
        table.add(f"mutated {name}", scene.name, verdict, f"{how} ({folder})", folder)


# --- runs that are stopped ------------------------------------------------------------------------------------------------------


def stop(scene, folder, number, after, *more):
    """Starts a run (or goes on), sends it the signal, and returns its status: minus the number of the signal that killed it."""
    process = subprocess.Popen(scene.command(folder, "--checkpoint-every", "1e-9", *more), stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE)
    time.sleep(after)
    process.send_signal(number)
    try:
        process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        process.kill()
        return "hang"
    return process.returncode


def finish(scene, folder):
    """Brings a stopped run to its end, from the beginning where it had not come to a checkpoint."""
    if (folder / "checkpoint.h5").exists():
        outcome = scene.go_on(folder)
    else:
        outcome = scene.run(folder)
    return scene.judge(outcome, folder, [])


def kills(scenes, table, count, chance):
    for n in range(count):
        scene = scenes[n % len(scenes)]
        folder = Path(tempfile.mkdtemp(dir=table.scratch))
        after = chance.uniform(0.0, 1.1 * scene.seconds)
        stop(scene, folder / "run", signal.SIGKILL, after)
        if n % 3 == 0 and (folder / "run/checkpoint.h5").exists():
            stop(scene, None, signal.SIGKILL, chance.uniform(0.0, 0.5 * scene.seconds), "--restart",
                 str(folder / "run/checkpoint.h5"), "--duration", repr(scene.end))
        table.add("SIGKILL", scene.name, finish(scene, folder / "run"), f"after {after:.3f} s ({folder})", folder)


def signals(scenes, table, count, chance, names):
    for name in names:
        number = getattr(signal, name)
        for n in range(count):
            scene = scenes[n % len(scenes)]
            folder = Path(tempfile.mkdtemp(dir=table.scratch))
            after = chance.uniform(0.0, 1.1 * scene.seconds)
            status = stop(scene, folder / "run", number, after)
            begun = (folder / "run").exists() and any((folder / "run").iterdir())
            if status in (0, 130) or (status == -number and not begun):  # before the run began there is nothing to save
                verdict = finish(scene, folder / "run")
            else:
                verdict = f"status {status}"
            table.add(name, scene.name, verdict, f"after {after:.3f} s ({folder})", folder)


# --- disks and folders ----------------------------------------------------------------------------------------------------------


class Mount:
    """A file system in memory of some kilobytes."""

    def __init__(self, scratch, kilobytes):
        self.path = Path(tempfile.mkdtemp(dir=scratch))
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", self.path], check=True)

    def change(self, options):
        return subprocess.run(["mount", "-o", f"remount,{options}", self.path]).returncode == 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        subprocess.run(["umount", "-l", self.path], check=True)


def clean_end(outcome, folder):
    if outcome.status in (1, 2):
        return "ok: refused by name" if str(folder) in outcome.errors else "refused without a name"
    return f"status {outcome.status}"


def disks(scenes, table, sizes):
    for scene in scenes:
        for size in sizes:
            with Mount(table.scratch, size) as mount:
                folder = mount.path / "run"
                outcome = scene.run(folder, "--checkpoint-every", "1e-9")
                verdict = clean_end(outcome, mount.path) if outcome.status else scene.judge(outcome, folder, [])
                advised = "checkpoint.h5, to go on" in outcome.errors
                if advised != (folder / "checkpoint.h5").exists() and outcome.status == 1:
                    verdict = "advice does not fit the files"
                table.add("full disk", scene.name, verdict, f"{size} kB: {outcome.errors}")
                mount.change("size=64m")
                if verdict.startswith("ok: refused"):
                    table.add("enlarged disk", scene.name, finish(scene, folder), f"{size} kB: {outcome.errors}")
        with Mount(table.scratch, 65536) as mount:
            mount.change("ro")
            table.add("read-only", scene.name, clean_end(scene.run(mount.path / "run"), mount.path), "from the start")


def folders(scenes, table, count):
    for n in range(count):
        scene = scenes[n % len(scenes)]
        folder = Path(tempfile.mkdtemp(dir=table.scratch)) / "run"
        slow = ["--checkpoint-every", "1e-9"]
        process = subprocess.Popen(scene.command(folder, *slow), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
        while not (folder / "checkpoint.h5").exists() and process.poll() is None:
            time.sleep(0.001)
        second = scene.run(folder)
        process_done = process.poll() is not None
        verdict = "ok: refused by name" if second.status == 2 and "another run" in second.errors else f"status {second.status}"
        if process_done and second.status == 0:
            verdict = "ok: same bits"  # the first had ended: the second began anew
        process.communicate()
        if verdict == "ok: refused by name" and scene.results(folder) != scene.reference:
            verdict = "the first run was disturbed"
        table.add("two runs into one folder", scene.name, verdict, second.errors)

        gone = folder.parent / "gone"
        process = subprocess.Popen(scene.command(gone, *slow), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
        while not (gone / "checkpoint.h5").exists() and process.poll() is None:
            time.sleep(0.001)
        shutil.rmtree(gone, ignore_errors=True)
        errors = process.communicate(timeout=LIMIT)[1].decode()
        outcome = Outcome(process.returncode, errors)
        table.add("folder removed", scene.name, "ok: the run had ended" if outcome.status == 0 and not gone.exists()
                  and "error" not in errors else clean_end(outcome, gone), errors)


def write(table, seconds, results):
    rows = sorted((*key, number) for key, number in table.counts.items())
    with open(results / "faults.csv", "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(("fault", "scene", "outcome", "runs"))
        out.writerows(rows)
    lines = [f"# Faults\n\nBy `verification/faults.py`, {datetime.date.today()}, {os.cpu_count()} cores, {seconds / 60:.0f} minutes; "
             f"{sum(table.counts.values())} runs, {len(table.bad)} failures.\n", "| fault | scene | outcome | runs |", "|---|---|---|---|"]
    lines += ["| " + " | ".join(map(str, row)).replace("ok: ", "") + " |" for row in rows]
    (results / "faults.md").write_text("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--quick", action="store_true", help="a part, under 30 s")
    parser.add_argument("--build", type=Path, default=ROOT / "build/release", help="where the programs are")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scale", type=float, default=1.0, help="more or fewer of everything; not written to the results")
    options = parser.parse_args()
    chance, begun = random.Random(options.seed), time.monotonic()
    scratch = Path(tempfile.mkdtemp(prefix="ductile-faults-"))
    table = Table(scratch)
    hdf5 = not options.quick

    def times(number):
        return max(2, round(number * options.scale))

    scenes = [Scene(options.build, scratch, program, hdf5) for program in SCENES]
    if options.quick:
        mutations(scenes, table, times(60), chance)
        kills(scenes, table, times(12), chance)
        signals(scenes, table, times(2), chance, ["SIGINT", "SIGTERM"])
        folders(scenes, table, 2)
    else:
        dense = [Scene(options.build, scratch, program, hdf5, dense=True) for program in SCENES]
        mutations(scenes, table, times(1000), chance)
        kills([scenes[0], dense[0], scenes[1], dense[1]], table, times(200), chance)
        signals(scenes, table, times(50), chance, ENDING)
        folders(scenes, table, times(20))
        if os.geteuid() == 0:
            disks(scenes, table, [16, 48, 64, 96, 128, 160, 192, 224, 256, 288, 320, 384, 448, 512, 640, 768, 1024, 2048])
        else:
            print("not root: no file systems of its own, the disks are left out", file=sys.stderr)
    seconds = time.monotonic() - begun
    if not options.quick and options.scale == 1.0:
        write(table, seconds, ROOT / "verification" / "results")
    print(f"{sum(table.counts.values())} runs in {seconds:.0f} s: {len(table.bad)} failures")
    if table.bad:
        sys.exit(1)
    shutil.rmtree(scratch)


if __name__ == "__main__":
    main()
