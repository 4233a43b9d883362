#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of verification/sweep.py on small runs of the programs: sweep.py FOLDER_OF_THE_PROGRAMS. Status 77 where the modules of
results.py are missing."""

import contextlib
import csv
import io
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

try:
    import h5py  # noqa: F401
    import numpy  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}; results.py needs numpy and h5py of {sys.executable}")
    sys.exit(77)

ROOT = Path(__file__).resolve().parent.parent
SCRIPT = ROOT / "verification/sweep.py"
sys.path.insert(0, str(SCRIPT.parent))
sys.dont_write_bytecode = True

import sweep  # noqa: E402

SHORT = ("cells=8", "duration=0.1", "snapshots=0")


def call(*words):
    """Status and what was printed on both channels."""
    out, err = io.StringIO(), io.StringIO()
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    with mock.patch.object(sys, "argv", ["sweep", f"--programs={programs}", *map(str, words)]), \
            contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = sweep.main()
    for number, handler in handlers.items():
        signal.signal(number, handler)
    return status, out.getvalue(), err.getvalue()


def table(folder):
    with open(folder / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


class Sweeps(unittest.TestCase):
    def setUp(self):
        self.place = Path(tempfile.mkdtemp(prefix="sweep-"))
        self.addCleanup(shutil.rmtree, self.place)

    def test_every_combination_is_a_row_with_what_its_summary_says(self):
        status, said, _ = call("shear_band", *SHORT, "scheme=auto,incremental", "bulk-modulus=1e11,2e11", "--output", self.place)
        self.assertEqual(status, 0)
        rows = table(self.place)
        self.assertEqual([(row["scheme"], row["bulk-modulus"]) for row in rows],
                         [(scheme, modulus) for scheme in ("auto", "incremental") for modulus in ("1e11", "2e11")])
        for row in rows:
            with open(self.place / row["folder"] / "summary.json") as file:
                summary = json.load(file)
            self.assertEqual(row["status"], "completed")
            self.assertEqual(float(row["steps"]), summary["steps"])
            self.assertEqual(float(row["wall_work_J"]), summary["extra"]["wall_work_J"])
            self.assertEqual(summary["parameters"]["bulk-modulus"], float(row["bulk-modulus"]))
        self.assertIn("4 of 4", said)

    def test_values_with_commas_stand_in_quotes(self):
        loads = ("0:0,0.05:2e8", "0:0,0.05:3e8")
        status, _, _ = call("shear_band", *SHORT, "shear-traction=" + ",".join(f'"{load}"' for load in loads), "--output", self.place)
        self.assertEqual(status, 0)
        self.assertEqual([row["shear-traction"] for row in table(self.place)], list(loads))
        self.assertEqual(len({row["folder"] for row in table(self.place)}), 2)

    def test_a_second_call_keeps_what_is_there_and_adds_what_is_new(self):
        scene = self.place / "a scene.toml"
        scene.write_text('carrier = "grid"\ncells = 8\nduration = 0.05\nsnapshots = [0]\n')
        call(scene, "tolerance=1e-3", "--output", self.place / "runs")
        kept = self.place / "runs/tolerance=1e-3/summary.json"
        before = kept.stat().st_mtime_ns
        status, said, _ = call(scene, "tolerance=1e-3,1e-4", "--output", self.place / "runs")
        self.assertEqual((status, said.count("kept"), said.count("completed")), (0, 1, 1))
        self.assertEqual(kept.stat().st_mtime_ns, before)
        scene.write_text(scene.read_text().replace("0.05", "0.06"))  # another scene: nothing is kept
        status, said, _ = call(scene, "tolerance=1e-3,1e-4", "--output", self.place / "runs")
        self.assertEqual((status, said.count("kept"), said.count("completed")), (0, 0, 2))

    def test_one_that_fails_does_not_stop_the_others(self):
        status, said, _ = call("shear_band", *SHORT[:1], "duration=100", "snapshots=0", "scheme=euler", "step=fixed", "dt=0.3,50",
                               "--output", self.place)
        self.assertEqual(status, 1)
        self.assertEqual([row["status"] for row in table(self.place)], ["failed", "failed"])
        self.assertIn("failed", said)

    def test_a_broken_off_sweep_goes_on(self):
        words = [sys.executable, SCRIPT, f"--programs={programs}", "shear_band", "cells=64", "duration=20,21", "snapshots=0", "--jobs=1",
                 f"--output={self.place}"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            while not list(self.place.glob("*/history.csv.partial")):
                time.sleep(0.02)
                self.assertIsNone(process.poll())
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 130)
        self.assertIn("the same command goes on", said)
        self.assertEqual([row["status"] for row in table(self.place)], ["interrupted", "not started"])
        step = json.loads(next(self.place.glob("*/summary.json")).read_text())["steps"]
        started = []
        with mock.patch.object(sweep.subprocess, "Popen", side_effect=lambda *a, **k: (started.append(a[0]), popen(*a, **k))[1]):
            status, _, _ = call(*map(str, words[3:]))
        self.assertEqual(status, 0)
        self.assertEqual(sum(any("--restart=" in str(word) for word in command) for command in started), 1)
        self.assertGreater(float(table(self.place)[0]["steps"]), step)

    def test_what_is_wrong_is_said_before_anything_runs(self):
        for words, message in ((("nothing", "a=1"), "there is no program 'nothing'"), (("none.toml", "a=1"), "no such file"),
                               (("shear_band", "cells"), "give a key and its values"), (("shear_band", "cells="), "a value is missing"),
                               (("shear_band", "cells=8,8"), "twice"), (("shear_band", "cells=8", "cells=9"), "twice"),
                               (("shear_band", "output=x,y"), "the sweep's own"), (("shear_band", "cels=8"), "did you mean --cells?"),
                               (("shear_band", "cells=8,x"), "--cells x: it must be"), (("shear_band", "cells=8", "--jobs=0"), "at least 1")):
            status, _, said = call(*words, "--output", self.place / "never")
            self.assertEqual(status, 2, words)
            self.assertIn(message, said)
            self.assertEqual(said.count("\n"), 1, said)
            self.assertFalse((self.place / "never").exists(), words)


popen = subprocess.Popen

if __name__ == "__main__":
    programs = Path(sys.argv.pop(1)).resolve()
    unittest.main()
