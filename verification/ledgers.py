#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the ledgers of energy leave open, against steps, tolerances and cells: whether it falls with the order that the identities in
lib/space/cells.hpp and lib/mpm/step_energies.hpp say.

    verification/ledgers.py            # three minutes
"""

import math

import common
from results import Run

TIME_STEPS = ("ralston", "bogacki-shampine", "dormand-prince", "chebyshev", "incremental", "extrapolated", "substepped", "euler")
SUNDIALS = ("arkode-3", "cvode-adams", "cvode-bdf", "ida")


def share(folder):
    return common.summary(folder)["extra"]["energy_error_of_work"]


def grid_runs(program, work):
    """{(scheme, model, cells, setting): open part of the work}"""
    cases = {}
    for scheme in TIME_STEPS:
        for dt in (4e-3, 2e-3, 1e-3):
            # steps of explicit pairs beyond 2 ms are unstable in the plastic flow
            scale = 0.25 if scheme in ("euler", "substepped") else 1.0
            cases[scheme, "reduced", 32, f"dt {1e3 * scale * dt:g} ms"] = {"step": "fixed", "dt": scale * dt}
    for scheme in ("auto", *SUNDIALS):
        for tolerance in (1e-4, 1e-5, 1e-6):
            cases[scheme, "reduced", 32, f"tolerance {tolerance:g}"] = {"tolerance": tolerance}
    for cells in (32, 64, 128):
        cases["auto", "full", cells, "tolerance 1e-06"] = {"tolerance": 1e-6}
    for (scheme, model, cells, setting), options in cases.items():
        folder = work / "-".join((scheme, model, str(cells), setting.replace(" ", "-")))
        common.run(program, folder, {"scheme": scheme, "model": model, "cells": cells, "snapshots": 0, **options})
        yield scheme, model, cells, setting, share(folder)


def point_runs(programs, work):
    """program, what, method, dt, open part of the work, that the method took, that the law leaves"""
    cases = []
    for method in ("implicit", "midpoint"):
        cases += [("upsetting", method, dt, {"snapshots": 0}) for dt in (2e-4, 1e-4, 5e-5, 2.5e-5)]
        cases += [("vibrating_bar", method, dt, {"snapshots": 0}) for dt in (0.1, 0.05, 0.025)]
        cases += [("colliding_disks", method, dt, {"snapshots": 0}) for dt in (0.24, 0.12, 0.06)]
    cases += [("taylor_bar", "explicit", dt, {"snapshots": 0}) for dt in (4e-8, 2e-8, 1e-8)]
    cases += [("vibrating_bar", "explicit", dt, {"snapshots": 0}) for dt in (0.05, 0.025, 0.0125)]
    for program, method, dt, options in cases:
        folder = work / f"{program}-{method}-{dt:g}"
        common.run(programs / program, folder, {"method": method, "dt": dt, **options})
        extra = common.summary(folder)["extra"]
        history = Run(folder).history
        scale = history["energy_error_J"][-1] / extra["energy_error_of_work"] if extra["energy_error_of_work"] else math.inf
        by_method = -extra["numerical_dissipation_J"] / scale
        yield program, method, dt, extra["energy_error_of_work"], by_method, extra["energy_error_of_work"] - by_method


def main():
    arguments = common.parser(__doc__, work="out/verification/ledgers").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    grid = list(grid_runs(arguments.program, arguments.work))
    points = list(point_runs(arguments.program.parent, arguments.work))
    text = f"# What the ledgers of energy leave open\n\n{common.provenance()}\n\nOf the work of the walls:\n\n"
    rows = {}
    for scheme, model, cells, setting, value in grid:
        rows.setdefault((scheme, model), []).append(f"{cells} cells, {setting}: {value:.2g}")
    text += common.markdown_table(["scheme", "model", "open"], [[*key, "; ".join(found)] for key, found in rows.items()])
    text += "\nOf the energy at the start and the work since:\n\n"
    text += common.markdown_table(["program", "method", "dt [s]", "open", "taken by the method", "left by the law"],
                                  [[program, method, f"{dt:g}", *(f"{value:.2g}" for value in values)]
                                   for program, method, dt, *values in points])
    header = ["what", "method", "setting", "open"]
    common.publish(arguments.results, "ledgers", text, header,
                   [[f"{model} {cells}", scheme, setting, value] for scheme, model, cells, setting, value in grid] +
                   [[program, method, dt, value] for program, method, dt, value, *_ in points])


if __name__ == "__main__":
    main()
