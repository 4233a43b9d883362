# SPDX-License-Identifier: GPL-3.0-or-later
"""What the maps of stability share: cases with an oracle, runs that are kept and found again, the one class each run ends in, heat maps,
and result files.

A case is right only where its oracle says so; that a run ended proves nothing. The classes:

    right            completed without a warning, and the error is within what was promised
    right, warned    the same, with a warning: over-cautious, no finding
    warned           the promise is broken, and a warning speaks of it (Case.about)
    refused          status 2 or 1, and the message names a cause and a way out
    near             silent, but within the slack that the oracle gives for a cause that is known
    silent           the promise is broken, and no warning speaks of it
    unclear          status 2 or 1, and the message names no way out
    crash            a signal, another status, text of a C++ exception, numbers that are not finite
    slow             longer than the case's limit, but at its pace it would end within a working day (its progress says so), it obeyed an
                     interrupt and left a checkpoint
    hang             longer than the case's limit, and not that
"""

import concurrent.futures
import dataclasses
import hashlib
import json
import os
import re
import shlex
import signal
import subprocess
import textwrap
import time
from pathlib import Path
from typing import Callable

import common
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Patch
from results import Run

COLOURS = {"right": "#4caf50", "right, warned": "#b7e1a1", "warned": "#ffe066", "refused": "#c8c8c8", "near": "#ffb38a",
           "slow": "#a6cee3", "silent": "#e53935", "unclear": "#e53935", "crash": "#e53935", "hang": "#e53935"}
WORKING_DAY = 8 * 3600.0  # of processor time
FINDINGS = ("silent", "unclear", "crash", "hang")
INTERNAL = re.compile(r"std::|terminate called|what\(\)|bad_alloc|Assertion|basic_string|vector::|Segmentation|nan\b|-nan")
WAY_OUT = re.compile(r"\b(use|take|try|choose|give|check|lower|raise|leave out|add|remove|shorten|smaller|must|allowed|one of|instead|ramp|"
                     r"load more|at least|at most|needed)\b")
GO_ON = re.compile(r"; the last good state is in .*, to go on from")  # ends the message of every failed run: no way out, and a place


@dataclasses.dataclass
class Judgement:
    """What an oracle found: the run is right if error <= promised. Up to `slack` a broken promise has a known cause."""

    error: float
    promised: float
    note: str = ""
    slack: float = 0.0
    about: str | None = None  # instead of Case.about: what a warning must match to speak of what is wrong
    delivered: float | None = None  # what heat maps show, if it is not the error


@dataclasses.dataclass
class Case:
    map: str      # the map it belongs to
    axes: dict    # its place there: name of an axis: value
    program: str
    options: dict  # without the bookkeeping
    oracle: Callable[[Path], Judgement]  # asked for completed runs only; the folder of the run
    scene: str | None = None  # TOML of a scene file: the program is `scene` then
    limit: float = 60.0       # [processor s]
    about: str = "."          # a warning must match it to speak of what the oracle sees

    @property
    def name(self):
        return f"{self.map}: " + ", ".join(f"{key} {value}" for key, value in self.axes.items())


@dataclasses.dataclass
class Result:
    case: Case
    folder: Path
    command: str
    status: int | None  # None: stopped at the limit
    reached: float  # part of its way that a stopped run has done
    seconds: float
    message: str
    warnings: list
    judgement: Judgement | None = None
    kind: str = ""

    @property
    def delivered(self):
        shown = self.judgement.delivered
        return self.judgement.error if shown is None else shown


# --- runs ------------------------------------------------------------------------------------------------------------------


def run_case(case, programs, work):
    """Runs a case, unless this very program has run this very command before, and judges it."""
    key = hashlib.sha256(json.dumps([case.program, case.options, case.scene, case.name], default=str).encode()).hexdigest()[:10]
    slug = re.sub(r"[^A-Za-z0-9.+-]+", "_", case.name)[:90]
    folder = work / re.sub(r"[^A-Za-z0-9.+-]+", "_", case.map) / f"{slug}-{key}"
    program = programs / case.program
    words = [program]
    if case.scene is not None:
        folder.parent.mkdir(parents=True, exist_ok=True)
        file = folder.parent / f"{folder.name}.toml"
        file.write_text(case.scene)
        words.append(file)
    words = common.command(words, case.options)
    kept = folder.parent / f"{folder.name}.json"
    stamp = program.stat().st_mtime_ns
    record = json.loads(kept.read_text()) if kept.exists() else {}
    if record.get("stamp") != stamp:
        record = {"stamp": stamp, **run_words(words, folder, case.limit)}
        folder.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(record))
    here = lambda text: text.replace(f"{work.resolve()}/", "").replace(f"{work}/", "")  # results name no places
    # of a scene's file the end of its name, which no other has
    shown = here(shlex.join([case.program, *(word[-len(f"{key}.toml"):] if word.endswith(".toml") else word for word in words[1:])]))
    summary = common.summary(folder) if record["status"] == 0 else None
    result = Result(case, folder, shown, record["status"], record.get("reached", 0.0), record["seconds"],
                    here(GO_ON.sub("", record["message"])), [here(warning) for warning in summary["warnings"]] if summary else [])
    result.kind = classify(result)
    return result


def run_words(words, folder, limit):
    """Status (None at the limit), part of the way, wall seconds and last words of a run into a folder without results."""
    for name in ("summary.json", "history.csv", "fields.h5", "checkpoint.h5", "fields.xdmf"):
        (folder / name).unlink(missing_ok=True)
    begun = time.monotonic()
    words = [*words, "--threads=1", "--quiet=true", f"--output={folder}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace") as process:
        while True:
            try:
                message, status = process.communicate(timeout=2)[0], process.returncode
                break
            except subprocess.TimeoutExpired:
                if processor_seconds(process.pid) > limit or time.monotonic() - begun > 20 * limit:
                    process.send_signal(signal.SIGINT)
                    try:
                        message = process.communicate(timeout=60)[0]
                    except subprocess.TimeoutExpired:
                        process.kill()
                        message = process.communicate()[0]
                    status = None
                    break
    reached = way_done(folder) if status is None and process.returncode == 130 else 0.0
    return {"status": status, "reached": reached, "seconds": time.monotonic() - begun, "message": message.strip()[-2000:]}


def way_done(folder):
    """Of an interrupted run with a checkpoint to go on from."""
    summary = common.summary(folder)
    if not summary or not (folder / "checkpoint.h5").exists():
        return 0.0
    return summary["extra"]["simulated_time_s"] / float(summary["parameters"]["duration"])


def processor_seconds(pid):
    """Of a running process, so that a busy machine makes no run a hang."""
    user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def run_cases(cases, programs, work, jobs):
    """Results in the order of the cases."""
    names = [case.name for case in cases]
    assert len(set(names)) == len(names), f"one name twice: {[name for name in names if names.count(name) > 1][:4]}"
    results = []
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for result in pool.map(lambda case: run_case(case, programs, work), cases):
            results.append(result)
            if result.kind in FINDINGS:
                print(details([result]), flush=True)
            if len(results) % 100 == 0:
                print(f"{len(results)} of {len(cases)} runs", flush=True)
    return results


# --- classes ---------------------------------------------------------------------------------------------------------------


def finite(folder):
    """Whether history.csv and the last snapshot of fields.h5 hold numbers only."""
    run = Run(folder)
    return all(np.isfinite(column).all() for column in run.history.values()) and all(
        np.isfinite(run.snapshots[-1][name]).all() for name in run.snapshots[-1].names)


def classify(result):
    """The class of a run; fills in its judgement."""
    if result.status is None:
        return "slow" if result.reached * WORKING_DAY >= result.case.limit else "hang"
    if result.status in (1, 2):
        return "crash" if INTERNAL.search(result.message) else "refused" if WAY_OUT.search(result.message) else "unclear"
    if result.status != 0 or not finite(result.folder):
        return "crash"
    result.judgement = judgement = result.case.oracle(result.folder)
    if judgement.error <= judgement.promised:
        return "right, warned" if result.warnings else "right"
    if any(re.search(judgement.about or result.case.about, warning) for warning in result.warnings):
        return "warned"
    return "near" if judgement.error <= judgement.slack else "silent"


# --- figures and files -----------------------------------------------------------------------------------------------------


def heat_map(results, rows, columns, path, title, number=lambda result: f"{result.delivered:.0e}", labels=None):
    """One cell a run, coloured by its class, with a number; `rows` and `columns` name axes, `labels` says them with units."""
    labels = labels or {}
    of_rows = list(dict.fromkeys(result.case.axes[rows] for result in results))
    of_columns = list(dict.fromkeys(result.case.axes[columns] for result in results))
    figure, axes = plt.subplots(figsize=(3.4 + 0.62 * len(of_columns), 1.6 + 0.3 * len(of_rows)), layout="constrained")
    for result in results:
        x, y = of_columns.index(result.case.axes[columns]), of_rows.index(result.case.axes[rows])
        axes.add_patch(plt.Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=COLOURS[result.kind], edgecolor="white"))
        text = number(result) if result.judgement else {"refused": "ref."}.get(result.kind, result.kind)
        axes.text(x, y, text, ha="center", va="center", fontsize=7)
    axes.set(xlim=(-0.5, len(of_columns) - 0.5), ylim=(len(of_rows) - 0.5, -0.5))
    axes.set(xlabel=labels.get(columns, columns), ylabel=labels.get(rows, rows))
    axes.set_title(title, fontsize=9, loc="left")
    axes.set_xticks(range(len(of_columns)), of_columns, fontsize=7, rotation=60 if max(len(str(c)) for c in of_columns) > 6 else 0)
    axes.set_yticks(range(len(of_rows)), of_rows, fontsize=7)
    kinds = [kind for kind in COLOURS if any(result.kind == kind for result in results)]
    patches = [Patch(facecolor=COLOURS[kind], label=kind) for kind in kinds]
    axes.legend(handles=patches, loc="upper left", bbox_to_anchor=(1.01, 1), fontsize=7)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def counts(results):
    """A table of classes by map."""
    by_map = {}
    for result in results:
        by_map.setdefault(result.case.map, []).append(result.kind)
    rows = [[name, len(kinds), *(kinds.count(kind) or "" for kind in COLOURS)] for name, kinds in by_map.items()]
    everything = [result.kind for result in results]
    rows.append(["all", len(everything), *(everything.count(kind) or "" for kind in COLOURS)])
    return common.markdown_table(["map", "runs", *COLOURS], rows)


def shortened(text, width=300):
    return textwrap.shorten(text, width, placeholder=" ...")


def details(results):
    """Lines of Markdown about single runs."""
    lines = []
    for result in results:
        judgement = result.judgement
        said = f"{result.reached:.0%} done" if result.status is None else shortened(result.message)
        if judgement:
            said = f"error {judgement.error:.2g}, promised {judgement.promised:.2g}; {judgement.note}"
        lines.append(f"- **{result.kind}**, {result.case.name}: {said}\n  `{result.command}`")
    return "\n".join(lines) or "None."


def messages(results, kinds):
    """How often which message or warning ended a run of these kinds, numbers aside."""
    seen = {}
    for result in results:
        if result.kind in kinds:
            for text in result.warnings or [result.message]:
                entry = seen.setdefault(re.sub(r"[-+]?\d[\d.e+-]*", "#", text), [0, text])
                entry[0] += 1
    return "\n".join(f"- {count} times: {shortened(text)}" for count, text in sorted(seen.values(), reverse=True)) or "None."


def publish(results, name, folder, head, promises):
    """NAME.md and NAME.csv: counts, findings in full, the worst right run, and what was said."""
    right = [result for result in results if result.kind == "right"]
    worst = max(right, key=lambda result: result.judgement.error / result.judgement.promised, default=None)
    text = "\n\n".join([
        f"# {head}", common.provenance(), promises, "## Counts", counts(results),
        "## Findings", details([result for result in results if result.kind in FINDINGS]),
        "## Near: beyond the promise for a known cause", details([result for result in results if result.kind == "near"]),
        "## Slow: stopped at the limit, to go on from a checkpoint", details([result for result in results if result.kind == "slow"]),
        "## The worst right one", details([worst] if worst else []),
        "## What refused runs said", messages(results, ("refused",)),
        "## What warned runs said", messages(results, ("warned",)),
        "## What right runs warned of", messages(results, ("right, warned",))]) + "\n"
    rows = []
    for result in results:
        judgement = result.judgement
        rows.append([result.case.map, "; ".join(f"{key}={value}" for key, value in result.case.axes.items()), result.kind,
                     f"{judgement.error:.3g}" if judgement else "", f"{judgement.promised:.3g}" if judgement else "",
                     judgement.note if judgement else "", f"{result.seconds:.2f}",
                     shortened(" | ".join(result.warnings) or result.message, 160),
                     result.command])
    common.publish(folder, name, text, ["map", "axes", "ended", "error", "promised", "note", "seconds", "said", "command"], rows)
