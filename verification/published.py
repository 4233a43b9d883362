#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that others publish of problems with laws of theirs.

    verification/published.py            # three minutes

The bar of 42CrMo4 (drivers/scenes/taylor-bar-42CrMo4.toml): Pantale, DynELA 4, manual (2020), axisymmetric Taylor impact, 5 x 50
elements; Abaqus on the same mesh.
"""

import common
from results import Run


def bar(arguments):
    file = arguments.program.resolve().parents[2] / "drivers" / "scenes" / "taylor-bar-42CrMo4.toml"
    rows = []
    for shape in ("linear", "gimp", "bspline"):
        for cell in (6.4e-4, 4e-4, 2e-4) if shape != "linear" else (6.4e-4, 4e-4):
            work = arguments.work / f"bar-{shape}-{cell:g}"
            wide = {"cell-size": cell, "shape": shape}
            scene = arguments.work / f"bar-{cell:g}.toml"
            high = 56 * 6.4e-4 if cell == 6.4e-4 else 0.036  # a multiple of the cells
            width = 19 * 6.4e-4 if cell == 6.4e-4 else 0.012
            scene.parent.mkdir(parents=True, exist_ok=True)
            scene.write_text(file.read_text().replace("width = 0.012", f"width = {width!r}").replace("height = 0.036", f"height = {high!r}")
                             .replace("offset = 1e-4", f"offset = {cell / 4!r}").replace("offset = 2e-4", f"offset = {cell / 2!r}"))
            common.run([arguments.program.parent / "scene", scene], work, wide)
            run = Run(work)
            last, start = run.snapshots[-1], run.snapshots[0]
            x, y = start["position"].T[:2]
            middle = (x < 3.2e-3 / 5) & (y < 32.4e-3 / 50)  # the element in the middle of the foot
            rows.append([shape, f"{1e3 * cell:g}", f"{1e3 * run.history['length_m'][-1]:.2f}", f"{1e3 * run.history['foot_diameter_m'][-1]:.2f}",
                         f"{last['temperature'][middle].mean() - 273.15:.0f}", f"{last['plastic_strain'][middle].mean():.2f}"])
    rows.append(["DynELA", "0.64", "26.52", "11.15", "582", "1.78"])
    rows.append(["Abaqus", "0.64", "26.56", "11.16", "591", "1.81"])
    return rows


def main():
    arguments = common.parser(__doc__, work="out/verification/published").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    rows = bar(arguments)
    header = ["shape functions", "cells or elements [mm]", "length [mm]", "diameter of the foot [mm]", "middle of the foot [deg C]",
              "its plastic strain"]
    text = (f"# Numbers of others\n\n{common.provenance()}\n\nA bar of 42CrMo4 that hits a wall with 287 m/s, at 80 us:\n\n"
            f"{common.markdown_table(header, rows)}")
    common.publish(arguments.results, "published", text, header, rows)


if __name__ == "__main__":
    main()
