#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the fast tests notice a wrong sign: each mutation of one line of a kernel, a controller or an output is applied alone to a
scratch copy of the sources, which is compiled and tested. A mutation that no test fails on has survived, and is a hole in the tests.

    verification/mutants.py                     # all of them
    verification/mutants.py --only gimp         # the mutations whose name contains a word

A mutation names the suites that should notice it; they run first, and all others only if they do not. Rows are kept in the work
folder as they come, so that a study that was stopped goes on.
"""

import argparse
import concurrent.futures
import json
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import common
from mutations import MUTATIONS

LONGEST = 600  # seconds that tests may take: a mutant that hangs is noticed, too


def git_files():
    listed = subprocess.run(["git", "-C", common.ROOT, "ls-files", "-z"], check=True, capture_output=True, text=True).stdout
    return [name for name in listed.split("\0") if name]


def check_texts():
    """Every mutation must change one place of the sources as they are."""
    for m in MUTATIONS:
        count = (common.ROOT / m.file).read_text().count(m.old)
        if count != 1:
            sys.exit(f"mutation '{m.name}': {m.file} has its text {count} times, not once")
    names = [m.name for m in MUTATIONS]
    if len(set(names)) != len(names):
        sys.exit("two mutations have one name")


class Copy:
    """A scratch copy of the sources with a build folder of its own; compiled with little optimisation, which is quicker."""

    def __init__(self, folder):
        self.root, self.build = folder, folder / "build"
        for name in git_files():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            source = common.ROOT / name
            if not target.exists() or target.read_bytes() != source.read_bytes():
                shutil.copy(source, target)
        self.call(["cmake", "-S", folder, "-B", self.build, "-G", "Ninja", "-D", "CMAKE_BUILD_TYPE=Release", "-D",
                   "CMAKE_CXX_FLAGS_RELEASE=-O1"])
        if not self.compile(os.cpu_count()):
            sys.exit(f"the unchanged sources do not compile in {folder}")

    @staticmethod
    def call(words):
        return subprocess.run([str(w) for w in words], capture_output=True, text=True)

    def compile(self, processes=1):
        """Everything that tests run: the unit tests depend on the programs."""
        return self.call(["ninja", "-C", self.build, "-j", processes, "unit_tests"]).returncode == 0

    def first_failure(self, suites):
        """The first test case of these suites (of all, if there is none) that fails, or None."""
        words = [str(self.build / "tests/unit_tests"), "--no-skip", "--abort-after=1", "--no-colors"]
        if suites:
            words.append("--test-suite=" + ",".join(suites))
        try:
            done = subprocess.run(words, capture_output=True, text=True, errors="replace", timeout=LONGEST, env={**os.environ, "OMP_NUM_THREADS": "1"})
        except subprocess.TimeoutExpired:
            return "a test that does not end"
        if done.returncode == 0:
            return None
        cases = re.findall(r"TEST CASE:\s+(.*)", done.stdout)  # the last is the one that ended the tests
        return cases[-1].strip() if cases else f"the tests end with status {done.returncode}"

    def judge(self, mutation):
        file = self.root / mutation.file
        original = file.read_text()
        begin = time.monotonic()
        file.write_text(original.replace(mutation.old, mutation.new))
        try:
            if not self.compile():
                return {"killed_by": "", "ended": "does not compile"}
            killer = self.first_failure(mutation.suites) or self.first_failure(())
        finally:
            file.write_text(original)
        return {"killed_by": killer or "", "ended": "killed" if killer else "survived", "seconds": round(time.monotonic() - begin)}


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--work", metavar="DIR", type=Path, default=Path(tempfile.gettempdir()) / "ductile-mutants", help="scratch copies and rows (default: %(default)s)")
    p.add_argument("--results", metavar="DIR", type=Path, default=common.RESULTS, help="where the table goes")
    p.add_argument("--jobs", type=int, default=os.cpu_count(), help="copies at a time (default: %(default)s)")
    p.add_argument("--only", metavar="WORD", default="", help="only mutations whose name contains it; no table is written")
    arguments = p.parse_args()
    check_texts()
    chosen = [m for m in MUTATIONS if arguments.only in m.name]
    arguments.work.mkdir(parents=True, exist_ok=True)
    kept = arguments.work / "rows.json"
    rows = json.loads(kept.read_text()) if kept.exists() else {}
    waiting = [m for m in chosen if rows.get(m.name, {}).get("mutation") != [m.file, m.old, m.new] or rows[m.name]["ended"] != "killed"]

    copies = queue.SimpleQueue()
    for k in range(min(arguments.jobs, len(waiting))):
        copies.put(Copy(arguments.work / f"copy{k}"))

    def work(mutation):
        copy = copies.get()
        try:
            return mutation, copy.judge(mutation)
        finally:
            copies.put(copy)

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for done in concurrent.futures.as_completed([pool.submit(work, m) for m in waiting]):
            mutation, row = done.result()
            rows[mutation.name] = {**row, "mutation": [mutation.file, mutation.old, mutation.new]}
            kept.write_text(json.dumps(rows, indent=1))
            print(f"{row['ended']:9} {mutation.name}: {row['killed_by']}", flush=True)

    survivors = [m.name for m in chosen if rows[m.name]["ended"] != "killed"]
    print(f"{len(chosen) - len(survivors)} of {len(chosen)} killed")
    if not arguments.only:
        header = ["mutation", "file", "noticed by the test"]
        table = [[m.name, f"`{m.file}`", rows[m.name]["killed_by"] or rows[m.name]["ended"]] for m in MUTATIONS]
        text = (f"# Wrong lines that the fast tests must notice\n\n{common.provenance()}\n\n"
                f"{len(chosen) - len(survivors)} of {len(chosen)} mutations are noticed.\n\n" + common.markdown_table(header, table))
        common.publish(arguments.results, "mutants", text, header, table)
    sys.exit(1 if survivors else 0)


if __name__ == "__main__":
    main()
