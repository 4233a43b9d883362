#!/usr/bin/python3
"""How far implicit steps of material points go: steps from a tenth to ten thousand times the explicit one, nearly incompressible
elasticity, one particle a cell, large strains, bodies that come apart. A run that cannot go on must say why and end with status 1.

    verification/stability.py         # two minutes
"""

import subprocess

import common

FACTORS = (0.1, 1, 10, 100, 1000, 10000)  # of the explicit step
BAR_STEP, BILLET_STEP = 0.004778, 9.5585e-8  # [s]
POISSON = (0.3, 0.45, 0.49, 0.499, 0.4999)


def cases():
    """title: (program, options)"""
    for form in ("velocity", "momentum"):
        for factor in FACTORS:
            yield f"plastic bar, {form} form, {factor:g} explicit steps", (
                "plastic_bar", {"form": form, "dt": factor * BAR_STEP, "duration": max(2.0, 1.01 * factor * BAR_STEP)})
        for factor in FACTORS[2:]:
            yield f"upsetting, {form} form, {factor:g} explicit steps", (
                "upsetting", {"form": form, "dt": factor * BILLET_STEP, "duration": 3e-3})
    for shape in ("linear", "bspline"):
        for nu in POISSON:
            yield f"plastic bar, nu = {nu}, {shape}", ("plastic_bar", {"poisson-ratio": nu, "shape": shape, "dt": 0.1})
    for shape in ("linear", "gimp", "bspline"):
        yield f"upsetting, one particle a cell, {shape}", ("upsetting", {"particles-per-side": 1, "shape": shape, "dt": 1e-4})
    for duration, strain in ((100, "33 %"), (225, "75 %")):
        for geometry in ("plane-strain", "plane-stress"):
            for direction in ("tension", "compression"):
                if direction == "tension" or duration == 100:
                    yield f"plastic bar, {geometry}, {direction}, {strain}", (
                        "plastic_bar", {"geometry": geometry, "direction": direction, "duration": duration, "dt": 0.5, "dt-start": 0.0048})


def main():
    arguments = common.parser(__doc__, work="out/verification/stability").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    header = ["case", "ended", "steps", "failed", "Newton", "linear", "smallest det F", "empty cells"]
    rows = []
    for number, (title, (program, options)) in enumerate(cases()):
        folder = arguments.work / f"{number:03}"
        try:
            common.run(arguments.program.parent / program, folder, {"snapshots": 0, "history-every": 1, **options})
        except subprocess.CalledProcessError:
            pass  # the summary says why
        summary = common.summary(folder)
        history = common.history(folder) if summary["steps"] else {}
        ended = summary["status"] if summary["status"] == "completed" else f"{summary['status']}: {summary['reason']}"
        rows.append([title, ended, summary["steps"], summary["rejected_steps"], summary["newton_iterations"], summary["linear_iterations"],
                     f"{history['smallest_determinant'].min():.2f}" if history else "",
                     int(summary["extra"].get("most_enclosed_empty_cells", 0))])
    text = f"# How far implicit steps go\n\n{common.provenance()}\n\n" + common.markdown_table(header, rows)
    common.publish(arguments.results, "stability", text, header, rows)


if __name__ == "__main__":
    main()
