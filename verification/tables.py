#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables I to VI of Sulsky & Kaul: steps, Newton and linear iterations, and cost of implicit beside explicit steps.

Every row is run in the paper's way (difference quotients, a fixed linear tolerance, no preconditioner, its scale of the residual, its
tolerances, no step shortened for its Newton iterations), to be compared with its numbers, and with this library's own defaults. Where
the paper scales its residual (Tables IV to VI) the row is run with the 2-norm, as printed, and with the root mean square.

The operations of a run are estimated from what it did: an explicit step counts as 1, a residual as 0.5, a Jacobian product as 0.45,
which is the ratio of their floating-point operations on a particle in the plane. Runs are kept in the work folder.

    verification/tables.py            # two minutes
"""

import common

BAR = {"poisson-ratio": 0}  # nu = 0 gives the stress that the paper prints; it states 0.3
DISK_STEP = 0.48765 * 0.05  # the explicit step of 6152 steps; the paper prints 0.02438
CG = {"solver": "newton-cg", "form": "velocity", "residual-scale": "none", "krylov-vectors": 1000}
GMRES = {"solver": "newton-gmres", "form": "momentum", "residual-scale": "stiffness", "krylov-vectors": 20}
PAPER = {"jacobian": "difference", "line-search": "residual", "preconditioner": "none", "always-newton": "true",
         "many-newton": 50}

TABLES = {  # program, scene, the paper's method with its tolerances, explicit steps, rows: dt, first dt, steps, Newton, linear, ratio
    "I: elastic bar, Newton-CG": ("elastic_bar", BAR, CG | {"newton-tolerance": 1e-5, "linear-tolerance": 1e-3}, 2108, [
        (0.005, 0.00484, 2041, 87, 433, 1.7294), (0.05, 0.00484, 214, 66, 423, 0.3444), (0.05, 0.0484, 205, 65, 424, 0.3376),
        (0.5, 0.00484, 42, 30, 193, 0.1149), (0.5, 0.0484, 30, 29, 192, 0.1052), (0.5, 0.484, 22, 23, 156, 0.0834)]),
    "II: disks, Newton-CG": ("colliding_disks", {}, CG | {"newton-tolerance": 1e-5, "linear-tolerance": 1e-3}, 6152, [
        (DISK_STEP, DISK_STEP, 6151, 428, 12524, 3.2347), (10 * DISK_STEP, DISK_STEP, 625, 359, 21158, 2.8845),
        (100 * DISK_STEP, DISK_STEP, 83, 58, 3934, 0.5265), (100 * DISK_STEP, 10 * DISK_STEP, 71, 58, 4005, 0.5324),
        (100 * DISK_STEP, 100 * DISK_STEP, 63, 62, 4486, 0.5917)]),
    "III: plastic bar, Newton-CG": ("plastic_bar", {}, CG | {"newton-tolerance": 1e-6, "linear-tolerance": 1e-4}, 5024, [
        (0.005, 0.004778, 4802, 221, 1381, 1.86), (0.05, 0.004778, 490, 127, 1450, 0.4241),
        (0.05, 0.04778, 481, 136, 1563, 0.4405), (0.5, 0.004778, 70, 80, 915, 0.1843), (0.5, 0.04778, 58, 71, 841, 0.1704),
        (0.5, 0.4778, 49, 72, 922, 0.1844)]),
    "IV: elastic bar, Newton-GMRES": ("elastic_bar", BAR, GMRES | {"newton-tolerance": 1e-5, "linear-tolerance": 1e-3}, 2108, [
        (0.005, 0.00484, 2041, 126, 243, 1.9796), (0.05, 0.00484, 214, 89, 177, 0.3625), (0.05, 0.0484, 205, 83, 166, 0.3434),
        (0.5, 0.00484, 42, 30, 60, 0.0966), (0.5, 0.0484, 30, 26, 52, 0.0782), (0.5, 0.484, 22, 21, 42, 0.0611)]),
    "V: plastic bar, Newton-GMRES": ("plastic_bar", {}, GMRES | {"newton-tolerance": 1e-6, "linear-tolerance": 1e-4}, 5024, [
        (0.005, 0.004778, 4802, 278, 688, 1.9495), (0.05, 0.004778, 490, 211, 1001, 0.5636),
        (0.05, 0.04778, 481, 207, 1014, 0.5668), (0.5, 0.004778, 70, 65, 214, 0.1059), (0.5, 0.04778, 58, 57, 197, 0.0971),
        (0.5, 0.4778, 49, 48, 186, 0.0909)]),
    "VI: upsetting, Newton-GMRES": ("upsetting", {}, GMRES | {"newton-tolerance": 1e-4, "linear-tolerance": 1e-2}, 99388, [
        (1e-7, 1e-7, 95003, 51629, 128738, 3.0120), (1e-6, 1e-6, 9503, 9952, 102068, 1.1707),
        (1e-5, 1e-5, 953, 1659, 26982, 0.2998), (1e-4, 1e-4, 98, 298, 5344, 0.0587), (1e-3, 1e-3, 16, 58, 1040, 0.0115)]),
}
EXTRA_STEPS = 2  # Table VI: its counts are three above 9.5 ms/dt for all its constant steps; it counts one more everywhere
HEADER = ["dt", "first dt", "norm", "steps", "paper", "Newton", "paper", "linear", "paper", "operations", "paper", "time"]
OWN_HEADER = ["dt", "first dt", "steps", "Newton", "linear", "operations", "time"]


def operations(summary):
    return summary["steps"] + 0.5 * summary["residual_evaluations"] + 0.45 * summary["jacobian_products"]


def run(arguments, program, name, options):
    folder = common.run(arguments.program.parent / program, arguments.work / name, {"snapshots": 0, **options})
    return common.summary(folder)


def main():
    arguments = common.parser(__doc__, work="out/verification/tables").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    text, numbers = f"# Tables I to VI of Sulsky & Kaul\n\n{common.provenance()}\n\n", []
    text += ("Steps, Newton and linear iterations and cost relative to the explicit run, each beside the paper's number; then the same steps "
             "with this library's defaults. Time is that of the steps without files. Rows of Table VI in the paper's way run for "
             f"{EXTRA_STEPS} steps beyond 9.5 ms, as the paper's do.\n")
    for title, (program, scene, method, explicit_steps, rows) in TABLES.items():
        explicit = run(arguments, program, f"{program}-explicit", scene | {"method": "explicit", "dt": "auto", "stable-step": "bar", "history-every": 100})
        text += f"\n## Table {title}\n\nexplicit: {explicit['steps']} steps (paper: {explicit_steps}), {common.step_seconds(explicit):.3g} s\n\n"
        norms = {"2-norm": {}} if method["residual-scale"] == "none" else {"2-norm": {}, "root mean square": {"residual-scale": "stiffness-rms"}}
        table, own_table = [], []
        for dt, first, steps, newton, linear, ratio in rows:
            step = scene | {"dt": dt, "dt-start": first, "history-every": 100}
            end = {"duration": 9.5e-3 + EXTRA_STEPS * dt} if program == "upsetting" else {}
            for number, (norm, scale) in enumerate(norms.items()):
                paper = run(arguments, program, f"{program}-{dt:g}-{first:g}-{method['solver']}-{number}",
                            step | PAPER | method | scale | end)
                table.append([f"{dt:g}", f"{first:g}", norm, paper["steps"], steps, paper["newton_iterations"], newton,
                              paper["linear_iterations"], linear, f"{operations(paper) / operations(explicit):.4f}", f"{ratio:.4f}",
                              f"{common.step_seconds(paper) / common.step_seconds(explicit):.4f}"])
            own = run(arguments, program, f"{program}-{dt:g}-{first:g}-own", step)
            own_table.append([f"{dt:g}", f"{first:g}", own["steps"], own["newton_iterations"], own["linear_iterations"],
                              f"{operations(own) / operations(explicit):.4f}", f"{common.step_seconds(own) / common.step_seconds(explicit):.4f}"])
        numbers += [[title, *row] for row in table] + [[f"{title}, defaults", *row] for row in own_table]
        text += common.markdown_table(HEADER, table) + "\nWith the defaults:\n\n" + common.markdown_table(OWN_HEADER, own_table)
    common.publish(arguments.results, "tables", text, ["table", *HEADER], numbers)


if __name__ == "__main__":
    main()
