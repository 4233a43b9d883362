#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the other reading of an ambiguous line of the paper would change: the shear band on 128 x 128 cells at t = 35e4 t_s.

    verification/readings.py

Takes a minute. The numbers are distances in the norm (59) to the run with the reading that `ductile` follows, and two values of
both runs. The readings themselves are listed in verification/README.md.
"""

import numpy as np

import common
from common import LENGTH, SHEAR, TIME
from results import Run

DENSITY = 6125.0  # kg/m^3, Table 1
OTHER_TIME = LENGTH / np.sqrt(SHEAR / DENSITY)  # t_s = L/c_s
BASE = {"cells": 128, "advection": "eno2", "step": "adaptive", "snapshots": common.DURATION}
READINGS = {
    "followed": {},
    "K = E/(3 - 6 nu) = 112.2 GPa": {"bulk-modulus": 101e9 / (3 - 6 * 0.35)},
    "(21) with D^pl instead of D^pl : sigma_0 = 2 sbar D^pl": {"stz-heat-capacity": 0.8},  # c_0 doubled is the rate halved
    f"t_s = L/sqrt(mu/rho) = {OTHER_TIME * 1e6:.4f} microseconds": {
        "wall-velocity": 2e-7 * LENGTH / OTHER_TIME, "duration": 35e4 * OTHER_TIME, "snapshots": 35e4 * OTHER_TIME},
}


def pattern_range(squares, cells=504):
    """Smallest and largest initial chi [K] by (C.3), with R_i = X_i^2 + (y + s_i)^2 or as printed without the squares."""
    x, y = np.meshgrid(common.points(cells, False), common.points(cells, False))
    total = np.exp(-20 * (0.5 * np.sin(np.pi * x) - y) ** 2)
    for centre, shift in ((0.6, 0.65), (0.3, 0.3), (-0.2, -0.4), (-0.4, 0.0), (-0.7, -0.6)):
        along, across = (x - centre + 1) % 2 - 1, y + shift
        total += np.exp(-20 * (along**2 + across**2 if squares else along + across))
    chi = 640 + 180 * total
    return chi.min(), chi.max()


def rows(folders):
    followed = common.load(folders["followed"])
    for name, folder in folders.items():
        distance = common.norms(common.load(folder) - followed)
        last = {column: values[-1] for column, values in Run(folder).history.items()}
        yield [name, *(f"{distance[field]:.1e}" for field in common.FIELDS), f"{last['largest_effective_temperature_K']:.2f}",
               f"{last['mean_deviatoric_magnitude_Pa'] * 1e-6:.2f}"]


def main():
    options = common.parser(__doc__, work="out/verification/readings").parse_args()
    folders = {name: common.run(options.program, options.work / str(i), BASE | change)
               for i, (name, change) in enumerate(READINGS.items())}
    table = list(rows(folders))
    text = "\n".join([
        f"# Other readings of the paper\n\n{common.provenance()}\n",
        "Distances to the reading followed, at t = 35e4 t_s, divided by U, s_Y, chi_inf:\n",
        common.markdown_table(["reading", "v", "sigma", "chi", "largest chi (K)", "mean sbar (MPa)"], table),
        "Initial chi by (C.3): {:.1f} to {:.1f} K with squares, {:.1f} to {:.1e} K as printed.\n".format(
            *pattern_range(True), *pattern_range(False))])
    common.publish(options.results, "readings", text, ["reading", "v", "sigma", "chi", "largest_chi_K", "mean_sbar_MPa"], table)


if __name__ == "__main__":
    main()
