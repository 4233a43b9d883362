#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Material points in large motions: a disk that spins, and two rings that collide, by both transfers.

    verification/large_motions.py            # ten minutes on two cores
"""

import concurrent.futures
import subprocess

import common
from results import Run

TURN = 3.76991                 # s, 1 m/s at 0.6 m
DISK_STEPS = {"midpoint": TURN / 100, "implicit": TURN / 100, "explicit": None}
SHAPES = ("linear", "gimp", "bspline")
TRANSFERS = ("increments", "affine")
RINGS = {  # a stable explicit step is 9e-5 s
    ("explicit", "increments"): {"method": "explicit"},
    ("explicit, half the step", "increments"): {"method": "explicit", "safety": 0.24},
    ("explicit", "affine"): {"method": "explicit"},
    ("explicit, velocity form", "increments"): {"method": "explicit", "form": "velocity"},
    ("explicit, velocity form", "affine"): {"method": "explicit", "form": "velocity"},
    ("midpoint, 5e-4 s", "affine"): {"method": "midpoint", "dt": 5e-4},
}


def main():
    arguments = common.jobs_option(common.parser(__doc__, work="out/verification/large_motions")).parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    program = arguments.program.parent / "scene"

    def run(scene, name, options):
        """The history and how the run ended."""
        folder = arguments.work / name
        try:
            common.run([program, common.ROOT / f"drivers/scenes/{scene}.toml"], folder, options)
        except subprocess.CalledProcessError:
            return None
        return Run(folder).history

    disks = {(method, shape, transfer): {"method": method, "shape": shape, "transfer": transfer, "snapshots-every": 0,
                                         **({"dt": step} if step else {"dt": "auto"})}
             for method, step in DISK_STEPS.items() for shape in SHAPES for transfer in TRANSFERS}
    rings = {(name, transfer): {**options, "transfer": transfer, "snapshots": 0} for (name, transfer), options in RINGS.items()}
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        spun = dict(zip(disks, pool.map(lambda key: run("spinning-disk", "disk-" + "-".join(key), disks[key]), disks)))
        collided = dict(zip(rings, pool.map(lambda key: run("colliding-rings", "rings-" + "-".join(key).replace(" ", "").replace(",", "-"),
                                                            rings[key]), rings)))

    def kept(history, column, time):
        if history is None:
            return None
        row = min(range(len(history["time_s"])), key=lambda k: abs(history["time_s"][k] - time))
        return history[column][row] / history[column][0] - 1

    text = (f"# Large motions\n\n{common.provenance()}\n\nA disk of radius 6 cells, free, 1 m/s at its rim, wave speed 37 m/s "
            "(`drivers/scenes/spinning-disk.toml`): relative change of the angular momentum, and of kinetic and elastic energy.\n\n")
    header = ["method, shape, transfer", "L, one turn", "L, 20 turns", "E, one turn", "E, 20 turns"]
    rows = [[", ".join(key), *("stopped" if kept(history, column, time) is None else f"{kept(history, column, time):+.1e}"
                               for column in ("angular_momentum_Nms", "total_energy_J") for time in (TURN, 20 * TURN))]
            for key, history in spun.items()]
    text += common.markdown_table(header, rows)
    text += ("\nTwo rings (`drivers/scenes/colliding-rings.toml`), 1.981e7 J at the start: energy at 0.6 s, what the method took from it "
             "(`numerical_dissipation_J`), and what is open in the ledger beside that. Published for this law, mesh and shape functions, "
             "explicit steps of 2e-4 s in the velocity form (Tesserae.jl, tests of its examples): 1.365e7 J (increments), 1.347e7 J (affine).\n\n")
    header_rings = ["steps, transfer", "energy at 0.6 s [J]", "taken by the method [J]", "open besides [J]"]
    ring_rows = []
    for key, history in collided.items():
        if history is None:
            ring_rows.append([", ".join(key), "stopped", "", ""])
            continue
        total, lost, error = (history[column][-1] for column in ("total_energy_J", "numerical_dissipation_J", "energy_error_J"))
        ring_rows.append([", ".join(key), f"{total:.4g}", f"{lost:.3g}", f"{error + lost:.1e}"])
    text += common.markdown_table(header_rings, ring_rows)
    common.publish(arguments.results, "large_motions", text, ["series", "1", "2", "3", "4"], rows + [[*row, ""] for row in ring_rows])


if __name__ == "__main__":
    main()
