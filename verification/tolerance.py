#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a tolerance means: the error at the end of a run over the tolerance that was asked for, for every scheme with error control
and scenes of many kinds, on the staggered grid by both differences of its advection and on elements of degree 8. Errors are those of
sigma/s_Y and chi/chi_inf in the norm (59) (on elements, of the values at their points), the larger one, against Dormand-Prince's pair at
1e-10 on the same space.

Promised is that the error stays below ten times the tolerance.

    verification/tolerance.py             # some 20 minutes on two cores
"""

import common
from results import Run
import matplotlib.pyplot as plt
import numpy as np

SCHEMES = ("auto", "ralston", "bogacki-shampine", "dormand-prince", "chebyshev", "arkode-2", "arkode-3", "arkode-4", "arkode-5",
           "cvode-adams", "cvode-bdf", "ida")
SPACES = {"weno3": {}, "eno2": {"advection": "eno2"}, "elements": {"space": "elements"}}
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
U = common.WALL
SCENES = {  # on 32 x 32 cells
    "the paper's": {},
    "reduced model": {"model": "reduced"},
    "inclusion": {"initial": "gaussian"},
    "random": {"initial": "random", "initial-amplitude": 30},
    "reversal": {"wall-history": f"0:{U},0.7:{U},0.8:{-U}"},
    "rate jump, hold": {"wall-history": f"0:{U},0.6:{U},0.6:{5 * U},0.8:{5 * U},0.8:0"},
    "opening": {"wall-history": f"0:{U}:{0.2 * U}"},
    "creep": {"shear-traction": "9e8", "duration": 0.3},
    "Perzyna": {"plasticity": "perzyna", "initial": "gaussian", "initial-amplitude": 0.02, "perzyna-hardening": 1e9},
}


def options(scene, scheme, space, tolerance):
    duration = SCENES[scene].get("duration", common.DURATION)
    return {"cells": 32, "duration": duration, "snapshots": duration, **SCENES[scene], **SPACES[space], "scheme": scheme,
            "tolerance": tolerance}


def fields(folder):
    """sigma/s_Y and the internal variable over its scale."""
    last = Run(folder).snapshots[-1]
    sigma = np.stack([last[name] for name in ("pressure", "s", "tau", "q")]) / common.YIELD
    internal = last["effective_temperature"] / common.STEADY if "effective_temperature" in last.names else last["plastic_strain"] / 0.01
    return sigma, internal


def error(folder, reference):
    (sigma, internal), (exact, exact_internal) = fields(folder), fields(reference)
    p, s, tau, q = sigma - exact
    return max(np.sqrt(np.mean(3 * p**2 + 2 * s**2 + 2 * tau**2 + 6 * q**2)),
               np.sqrt(np.mean((internal - exact_internal)**2)))


def main():
    arguments = common.jobs_option(common.parser(__doc__, work="out/verification/tolerance")).parse_args()
    runs, slug = {}, lambda *words: "-".join(str(word).replace(" ", "_").replace("'", "").replace(",", "") for word in words)
    for scene in SCENES:
        for space in SPACES:
            runs[slug(scene, space, "reference")] = options(scene, "dormand-prince", space, 1e-10)
            for scheme in SCHEMES if space == "weno3" else ("auto", "dormand-prince", "cvode-bdf"):
                for tolerance in TOLERANCES:
                    runs[slug(scene, space, scheme, tolerance)] = options(scene, scheme, space, tolerance)
    arguments.work.mkdir(parents=True, exist_ok=True)
    folders = common.run_all(arguments.program, arguments.work, runs, arguments.jobs)

    rows, lines = [], {}
    for scene in SCENES:
        for space in SPACES:
            reference = folders[slug(scene, space, "reference")]
            for scheme in SCHEMES if space == "weno3" else ("auto", "dormand-prince", "cvode-bdf"):
                for tolerance in TOLERANCES:
                    folder = folders[slug(scene, space, scheme, tolerance)]
                    summary = common.summary(folder)
                    ratio = error(folder, reference) / tolerance
                    warned = any("toleran" in warning or "error" in warning for warning in summary["warnings"])
                    lines.setdefault((space, scheme), {}).setdefault(tolerance, []).append((ratio, warned))
                    rows.append([scene, space, scheme, tolerance, ratio, summary["elliptic_solves"], warned])

    table = []
    for (space, scheme), found in lines.items():
        cells = []
        for tolerance in TOLERANCES:
            ratios = [ratio for ratio, _ in found[tolerance]]
            missed = sum(ratio > 10 and not warned for ratio, warned in found[tolerance])
            cells.append(f"{min(ratios):.2g} to {max(ratios):.2g}" + (f", **{missed} missed**" if missed else ""))
        table.append([space, scheme, *cells])
    text = (f"# What a tolerance means\n\n{common.provenance()}\n\nThe error at the end over the tolerance, from the best to the worst "
            f"of {len(SCENES)} scenes ({', '.join(SCENES)}) on 32 x 32 cells; missed: beyond ten, and no warning.\n\n" +
            common.markdown_table(["space", "scheme", *(f"{tolerance:g}" for tolerance in TOLERANCES)], table))
    common.publish(arguments.results, "tolerance", text,
                   ["scene", "space", "scheme", "tolerance", "error over tolerance", "elliptic solves", "warned"], rows)

    figure, panels = plt.subplots(4, 5, figsize=(16, 11), sharex=True, sharey=True, layout="constrained")
    for axes, (space, scheme) in zip(panels.flat, lines):
        for k, scene in enumerate(SCENES):
            ratios = [row[4] for row in rows if row[:3] == [scene, space, scheme]]
            axes.loglog(TOLERANCES, ratios, "o-", ms=3, lw=1, color=f"C{k}", label=scene)
        axes.axhspan(0.1, 10, color="0.92", zorder=0)
        axes.set_title(scheme if space == "weno3" else f"{scheme}, {space}", fontsize=10)
        axes.grid(alpha=0.3)
    panels[0, 0].invert_xaxis()
    for axes in panels[-1]:
        axes.set_xlabel("--tolerance")
    for axes in panels[:, 0]:
        axes.set_ylabel("error / tolerance")
    panels[-1, -1].axis("off")
    panels[-1, -1].legend(*panels[0, 0].get_legend_handles_labels(), loc="center", fontsize=9)
    figure.savefig(arguments.results / "tolerance.png", dpi=110)


if __name__ == "__main__":
    main()
