#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What threads cost on a machine whose processors are busy: each program on one and two threads beside loops that keep every
processor busy, and beside none. The table gives the best and the median of paired repetitions, which take a minute or two.

    ./ductile build && verification/benchmarks/busy.py
"""
import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common

CASES = {
    "shear_band, 128 x 128 cells": ("shear_band", ["--cells", "128", "--duration", "0.2"]),
    "upsetting, explicit, 4800 particles": ("upsetting", ["--cell-size", "2.5e-4", "--method", "explicit", "--dt", "auto",
                                                          "--duration", "4e-6"]),
}
LOOPS_PER_PROCESSOR = (0, 1, 2)


def seconds(program, options, threads):
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        subprocess.run([program, *options, "--threads", str(threads), "--quiet", "--output", f"{folder}/out"], check=True,
                       stdout=subprocess.DEVNULL)
        return time.perf_counter() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=pathlib.Path, default=common.ROOT / "build/release")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--results", type=pathlib.Path, default=common.ROOT / "verification/results")
    options = parser.parse_args()
    processors, rows = len(os.sched_getaffinity(0)), []
    for loops in LOOPS_PER_PROCESSOR:
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops * processors)]
        try:
            for name, (program, arguments) in CASES.items():
                pairs = [[seconds(options.programs / program, arguments, threads) for threads in (1, 2)]
                         for _ in range(options.repetitions)]
                best, median = ([choose(pair[k] for pair in pairs) for k in (0, 1)] for choose in (min, statistics.median))
                rows.append([name, loops, f"{best[0]:.2f} ({median[0]:.2f})", f"{best[1]:.2f} ({median[1]:.2f})",
                             f"{best[1] / best[0]:.2f} ({statistics.median(two / one for one, two in pairs):.2f})"])
                print(*rows[-1], sep="  ", flush=True)
        finally:
            for process in busy:
                process.kill()
                process.wait()
    text = (f"# Threads on a busy machine\n\n`verification/benchmarks/busy.py`, {processors} processors; seconds, best (median) of "
            f"{options.repetitions} pairs.\n\n" +
            common.markdown_table(["program", "busy loops a processor", "1 thread", "2 threads", "ratio"], rows) + "\n")
    (options.results / "busy.md").write_text(text)


if __name__ == "__main__":
    main()
