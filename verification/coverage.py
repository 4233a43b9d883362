#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of the library the tests execute: compiles everything with gcov's counters (build/coverage), runs the unit tests, and tells the share
of lines by folder, and the files with the most lines left out.

    verification/coverage.py          # some minutes
"""

import collections
import gzip
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import common

BUILD = common.ROOT / "build" / "coverage"


def counts(gcov):
    """{file of lib: {line: executions}}, summed over all that was compiled."""
    lines = collections.defaultdict(collections.Counter)
    with tempfile.TemporaryDirectory() as folder:
        for data in BUILD.rglob("*.gcda"):
            subprocess.run([gcov, "--json-format", "--preserve-paths", data.resolve()], cwd=folder, check=True, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
            for report in Path(folder).glob("*.gcov.json.gz"):
                for file in json.loads(gzip.decompress(report.read_bytes()))["files"]:
                    # headers are found through the link build/coverage/include/ductile
                    path = (BUILD / file["file"]).resolve()
                    if path.is_relative_to(common.ROOT / "lib"):
                        for line in file["lines"]:
                            lines[path.relative_to(common.ROOT)][line["line_number"]] += line["count"]
                report.unlink()
    return lines


def share(files):
    executed = sum(count > 0 for lines in files for count in lines.values())
    return executed, sum(len(lines) for lines in files)


def report(lines):
    folders = sorted({path.parent for path in lines})
    rows = []
    for folder in [*folders, None]:
        executed, of = share([counted for path, counted in lines.items() if folder in (path.parent, None)])
        rows.append([f"`{folder}`" if folder else "all", of, of - executed, f"{100 * executed / of:.1f}"])
    left = sorted(((of - executed, path) for path, counted in lines.items() for executed, of in [share([counted])]), reverse=True)
    return rows, "\n".join([
        f"# Lines of the library that the unit tests execute\n\n{common.provenance()}\n",
        common.markdown_table(["folder", "lines with code", "not executed", "executed [%]"], rows),
        "Most is left out of " + ", ".join(f"`{path}` ({count})" for count, path in left[:10] if count) + ".\n"])


def main():
    parser = common.parser(__doc__)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="compilers at a time (default: %(default)s)")
    arguments = parser.parse_args()
    for old in BUILD.rglob("*.gcda"):
        old.unlink()
    subprocess.run(["cmake", "--preset", "coverage"], cwd=common.ROOT, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", BUILD, "-j", str(arguments.jobs)], check=True)
    tested = subprocess.run(["ctest", "--test-dir", BUILD, "-L", "unit", "-j", str(arguments.jobs), "--output-on-failure"]).returncode
    rows, text = report(counts("gcov"))
    common.publish(arguments.results, "coverage", text, ["folder", "lines", "not_executed", "percent"], rows)
    return tested


if __name__ == "__main__":
    sys.exit(main())
