#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The README's pictures: runs of half a minute in all, drawn by plot.py.

    verification/gallery.py
"""

import subprocess
import sys
from pathlib import Path

import common

SCENES = common.ROOT / "drivers/scenes"
PICTURES = {  # name: program, its arguments, those of plot.py
    "shear_band": ("shear_band", ["--snapshots=0,0.6,0.9,1.4175"], ["--field=effective_temperature"]),
    "upsetting": ("upsetting", ["--cell-size=5e-4", "--dt=5e-5", "--shape=gimp"], ["--field=plastic_strain"]),
    "strip": ("scene", [SCENES / "strip-with-hole.toml"], ["--field=von_mises_stress", "--times=0.2"]),
    "creep": ("scene", [SCENES / "creep.toml"], ["--field=effective_temperature", "--last"]),
    "disks": ("colliding_disks", [], ["--field=von_mises_stress", "--times=100"]),
    "bending": ("scene", [SCENES / "three-point-bending.toml"], ["--field=plastic_strain", "--last"]),
    "random": ("scene", [SCENES / "random-glass.toml"], ["--field=effective_temperature", "--last"]),
    "taylor": ("taylor_bar", [], ["--field=plastic_strain", "--last"]),
}


def main():
    arguments = common.parser(__doc__, work="out/verification/gallery").parse_args()
    for name, (program, options, how) in PICTURES.items():
        folder = arguments.work / name
        subprocess.run([arguments.program.parent / program, *options, f"--output={folder}", "--quiet=true"], check=True)
        picture = arguments.results / f"gallery_{name}.png"
        subprocess.run([Path(__file__).with_name("plot.py"), folder, *how, f"--output={picture}"], check=True)


if __name__ == "__main__":
    sys.exit(main())
