#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Material points against closed forms and manufactured solutions: six problems, three shape functions, several meshes.

    verification/solutions.py         # six minutes
"""

import csv
import os
import subprocess

import matplotlib.pyplot as plt
import numpy as np

import common

SHAPES = ("linear", "gimp", "bspline")
COLOURS = dict(zip(SHAPES, ("tab:red", "tab:blue", "tab:green")))
TABLES = {"manufactured": ("manufactured", "manufactured_steps"), "vortex": ("vortex", "vortex_check"),
          "cylinder": ("cylinder", "cylinder_profile"), "column": ("column",),
          "elastica": ("elastica", "elastica_line", "elastica_stiffness"), "cook": ("cook",)}
STEPS_A_CELL = {"explicit": 8, "midpoint": 4}  # of the studies in space


def mesh_axis(axis, sizes, **labels):
    axis.set_xticks(sizes, [f"{size:.3g}" for size in sizes])
    axis.minorticks_off()
    axis.set(**labels)


def computed(program, work, case):
    """The tables of a case as lists of {column: value}; computed unless they are there and newer than the program."""
    files = [work / f"{name}.csv" for name in TABLES[case]]
    stamp = work / f"{case}.done"
    if not stamp.exists() or stamp.stat().st_mtime < program.stat().st_mtime:
        print(program, case, work, flush=True)
        subprocess.run([program, case, work], check=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
        stamp.touch()

    def value(text):
        try:
            return float(text)
        except ValueError:
            return text

    return [[{name: value(text) for name, text in row.items()} for row in csv.DictReader(file.open())] for file in files]


def chosen(rows, **conditions):
    return [row for row in rows if all(row[name] == wanted for name, wanted in conditions.items())]


def column(rows, name):
    return np.array([row[name] for row in rows])


def orders(errors):
    """Observed orders from mesh to mesh, each of half the cell size of the one before."""
    return np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))


def listed(values, form="{:.2f}"):
    return ", ".join(form.format(value) for value in values)


# --- independent solutions -------------------------------------------------------------------------------------------------


def widened_cylinder(young, nu, yield_stress, hardening, inner, outer, expansion, steps, cells):
    """A thick-walled cylinder of von Mises metal in plane strain, small strains, widened at the inner radius: displacement u at
    equidistant radii, stress at the middles between, whose equilibrium d(r sigma_r)/dr = sigma_theta is that of virtual work;
    Newton's method in every step. Returns the pressure after each step, the middles, and the stress there at the end (r, theta,
    z)."""
    bulk, mu = young / (3 * (1 - 2 * nu)), young / (2 * (1 + nu))
    r = np.linspace(inner, outer, cells + 1)
    middle, dr = (r[1:] + r[:-1]) / 2, (outer - inner) / cells
    weight = middle * dr
    # the (radial, hoop) strain at the middles: left u[:-1] + right u[1:]
    left, right = np.array([np.full(cells, -1 / dr), 0.5 / middle]), np.array([np.full(cells, 1 / dr), 0.5 / middle])
    u, p = np.zeros(cells + 1), np.zeros(cells)
    plastic = np.zeros((3, cells))  # deviatoric
    volumetric, unit = np.ones((3, 3)), np.eye(3)
    pressures = []
    for step in range(1, steps + 1):
        u[0] = expansion * step / steps
        for _ in range(50):
            strain = np.vstack([left * u[:-1] + right * u[1:], np.zeros(cells)])
            mean = strain.sum(axis=0) / 3
            trial = 2 * mu * (strain - mean - plastic)
            q = np.sqrt(1.5 * np.sum(trial**2, axis=0))
            increment = np.maximum(q - yield_stress - hardening * p, 0.0) / (3 * mu + hardening)
            lost = 3 * mu * increment / np.maximum(q, 1e-30)
            stress = 3 * bulk * mean + (1 - lost) * trial
            residual = np.zeros(cells + 1)
            residual[:-1] += np.sum(left * stress[:2], axis=0) * weight
            residual[1:] += np.sum(right * stress[:2], axis=0) * weight
            if np.linalg.norm(residual[1:]) <= 1e-9 * yield_stress * inner:
                break
            direction = trial / np.maximum(np.sqrt(np.sum(trial**2, axis=0)), 1e-30)
            drop = np.where(increment > 0, 3 * mu / (3 * mu + hardening) - lost, 0.0)
            tangent = (bulk * volumetric[:, :, None] + 2 * mu * (1 - lost) * (unit - volumetric / 3)[:, :, None]
                       - 2 * mu * drop * direction[:, None] * direction[None])[:2, :2]
            between = lambda a, b: np.einsum("kc,klc,lc->c", a, tangent, b) * weight
            diagonal, beside = np.zeros(cells + 1), between(left, right)  # a node meets its neighbours only
            diagonal[:-1] += between(left, left)
            diagonal[1:] += between(right, right)
            matrix = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
            u[1:] -= np.linalg.solve(matrix[1:, 1:], residual[1:])
        else:
            raise RuntimeError("the reference of the cylinder does not converge")
        plastic += 1.5 * increment * trial / np.maximum(q, 1e-30)
        p += increment
        pressures.append(residual[0] / inner)
    return np.array(pressures), middle, stress


def hanging_beam(length, load, bending, stretching=np.inf, shearing=np.inf, steps=2000):
    """A clamped beam under a dead load a unit of length, by Runge and Kutta's method from the free end, whose angle is such that
    the other end is level. The weight beyond s is P = load (length - s) and strains the axis by e = P sin(theta)/stretching along
    and g = P cos(theta)/shearing across. Returns s, x, y at equal distances (y upwards)."""
    ds = length / steps

    def rate(s, state):
        theta, moment = state[:2]
        weight = load * (length - s)
        e, g = weight * np.sin(theta) / stretching, weight * np.cos(theta) / shearing
        x_slope = (1 + e) * np.cos(theta) - g * np.sin(theta)
        down = (1 + e) * np.sin(theta) + g * np.cos(theta)
        return np.array([moment / bending, -weight * x_slope, x_slope, -down])

    def integrate(angle):
        states = [np.array([angle, 0.0, 0.0, 0.0])]
        for n in range(steps):
            s, state = length - n * ds, states[-1]
            k1 = rate(s, state)
            k2 = rate(s - ds / 2, state - ds / 2 * k1)
            k3 = rate(s - ds / 2, state - ds / 2 * k2)
            k4 = rate(s - ds, state - ds * k3)
            states.append(state - ds / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        return np.array(states[::-1])

    before, now = 0.0, 0.5
    value_before, value_now = integrate(before)[0, 0], integrate(now)[0, 0]
    while abs(value_now) > 1e-13:
        before, now = now, now - value_now * (now - before) / (value_now - value_before)
        value_before, value_now = value_now, integrate(now)[0, 0]
    states = integrate(now)
    return np.linspace(0.0, length, steps + 1), states[:, 2] - states[0, 2], states[:, 3] - states[0, 3]


def cook_by_polynomials(nu, plane_stress, degree):
    """The displacement at (48, 52) of Cook's membrane as one element: products of polynomials of this degree on the square that is
    mapped to the quadrilateral. E = 1, shear force 1."""
    legendre = np.polynomial.legendre.Legendre
    nodes = np.concatenate([[-1], legendre.basis(degree).deriv().roots().real, [1]])
    gauss, weight = np.polynomial.legendre.leggauss(degree + 2)
    vandermonde = np.polynomial.legendre.legvander(nodes, degree)
    values = np.linalg.solve(vandermonde.T, np.polynomial.legendre.legvander(gauss, degree).T).T
    slopes_at_gauss = np.stack([legendre.basis(k).deriv()(gauss) for k in range(degree + 1)], axis=1)
    slopes = np.linalg.solve(vandermonde.T, slopes_at_gauss.T).T
    xi, eta = (grid.ravel() for grid in np.meshgrid(gauss, gauss, indexing="ij"))
    # x = 24 (1 + xi), y = bottom + (1 + eta)/2 (top - bottom) with bottom = 44 x/48, top = 44 + 16 x/48
    y_xi = 22 + (1 + eta) / 2 * (8 - 22)
    y_eta = (44 + 8 * (1 + xi) - 22 * (1 + xi)) / 2
    jacobian = 24 * y_eta
    by_xi, by_eta = np.kron(slopes, values), np.kron(values, slopes)
    by_y = by_eta / y_eta[:, None]
    by_x = by_xi / 24 - y_xi[:, None] / 24 * by_y
    area = np.kron(weight, weight) * jacobian
    mu = 1 / (2 * (1 + nu))
    lame = 2 * mu * nu / (1 - nu) if plane_stress else 2 * mu * nu / (1 - 2 * nu)
    product = lambda a, b: (a * area[:, None]).T @ b
    xx, yy, xy = product(by_x, by_x), product(by_y, by_y), product(by_x, by_y)
    stiffness = np.block([[(lame + 2 * mu) * xx + mu * yy, lame * xy + mu * xy.T],
                          [lame * xy.T + mu * xy, (lame + 2 * mu) * yy + mu * xx]])
    count = (degree + 1)**2
    force = np.zeros(2 * count)
    force[count + degree * (degree + 1):] = values.T @ weight / 2  # on xi = 1
    free = np.concatenate([np.arange(degree + 1, count), count + np.arange(degree + 1, count)])
    u = np.zeros(2 * count)
    u[free] = np.linalg.solve(stiffness[np.ix_(free, free)], force[free])
    return u[count + degree * (degree + 1) + degree // 2]


def scaled_eigenvalues(entries):
    """Of the symmetric part of the matrix with these entries, scaled to a diagonal of ones."""
    numbers, places = np.unique(np.concatenate([column(entries, "row"), column(entries, "column")]), return_inverse=True)
    matrix = np.zeros((numbers.size, numbers.size))
    np.add.at(matrix, tuple(places.reshape(2, -1)), column(entries, "value"))
    scale = 1 / np.sqrt(np.diag(matrix))
    return np.linalg.eigvalsh(scale[:, None] * (matrix + matrix.T) / 2 * scale)


# --- the problems ----------------------------------------------------------------------------------------------------------


class Report:
    """Text for the .md and rows for the .csv, gathered problem by problem."""

    def __init__(self):
        self.text, self.rows = "", []

    def problem(self, title, oracle, closed_form):
        self.name = title
        self.text += f"\n## {title}\n\nOracle: {oracle}\n\nClosed form: {closed_form}\n"

    def paragraph(self, text):
        self.text += f"\n{text}\n"

    def table(self, header, rows):
        self.text += "\n" + common.markdown_table(header, rows)

    def numbers(self, what, meshes, values):
        self.rows += [[self.name, what, mesh, f"{value:.6g}"] for mesh, value in zip(meshes, values)]

    def convergence(self, rows, group, mesh, errors):
        """A table of errors and their orders for every combination of the columns `group`, meshes of a row in turn."""
        combinations = list(dict.fromkeys(tuple(row[name] for name in group) for row in rows))
        lines = []
        for combination in combinations:
            series = chosen(rows, **dict(zip(group, combination)))
            line = [*combination, listed(column(series, mesh), "{:g}")]
            for name in errors:
                values = column(series, name)
                line += [listed(values, "{:.2g}"), listed(orders(values))]
                what = " ".join(f"{key}={value}" for key, value in zip(group, combination))
                self.numbers(f"{what} {name}", column(series, mesh), values)
            lines.append(line)
        self.table([*group, mesh, *(cell for name in errors for cell in (name, "orders"))], lines)


def manufactured(tables, report, axis):
    rows, steps = tables
    report.problem("Axis-aligned manufactured solution",
                   "the motion itself, Wallstedt & Guilkey (2008), under the body force that this law needs for it. Unit square, "
                   "E = 10 kPa, nu = 0.3, 1000 kg/m^3, nine particles a cell; root mean squares over particles when the displacement is "
                   "largest.",
                   "u = A sin(pi X) sin(c pi t), sigma_xx = (K + 4 mu/3) ln F + (K - 2 mu/3) ln G.")
    main = [row for row in rows if row["particles_per_side"] == 3
            and row["steps"] == STEPS_A_CELL[row["method"]] * row["cells"]]
    report.convergence(main, ("method", "amplitude_m", "shape"), "cells", ("displacement_m", "stress_Pa"))
    report.paragraph("Order in time, GIMP on 16 x 16 cells: root mean square of what the displacement changes from half as many steps.")
    lines = []
    for method in ("explicit", "midpoint"):
        for amplitude in sorted({row["amplitude_m"] for row in steps}):
            series = chosen(steps, method=method, amplitude_m=amplitude)
            differences = column(series, "difference_m")
            report.numbers(f"method={method} amplitude_m={amplitude:g} change by half the step", column(series, "steps"), differences)
            lines.append([method, f"{amplitude:g}", listed(column(series, "steps"), "{:g}"), listed(differences, "{:.1e}"),
                          listed(orders(differences)), f"{series[-1]['displacement_m']:.1e}"])
    report.table(["method", "A [m]", "steps", "change [m]", "orders", "error at the end [m]"], lines)
    report.paragraph("Particles along a cell's side, A = 0.05 m, explicit steps, 32 x 32 cells:")
    report.table(["shape", "particles along a side", "displacement [m]", "stress [Pa]"],
                 [[shape, listed(column(series, "particles_per_side"), "{:g}"), listed(column(series, "displacement_m"), "{:.2g}"),
                   listed(column(series, "stress_Pa"), "{:.2g}")]
                  for shape in SHAPES
                  for series in [sorted(chosen(rows, method="explicit", amplitude_m=0.05, shape=shape, cells=32, steps=256),
                                        key=lambda row: row["particles_per_side"])]])
    for shape in SHAPES:
        for amplitude, style in ((0.01, "o-"), (0.05, "s--")):
            series = chosen(main, method="explicit", amplitude_m=amplitude, shape=shape)
            axis.loglog(1 / column(series, "cells"), column(series, "displacement_m"), style, color=COLOURS[shape],
                        label=f"{shape}, A = {amplitude} m")
    mesh_axis(axis, 1 / column(series, "cells"), title="manufactured solution, explicit", xlabel="cell size [m]",
              ylabel="displacement error [m]")


def vortex(tables, report, axis):
    rows, check = tables
    report.problem("Generalised vortex",
                   "the motion itself, Brannon, Kamojjala & Sadeghirad (2011), under the body force that Jaumann's rate needs for it. "
                   "Ring of radii 0.75 and 1.25 m with free edges, E = 1 kPa, nu = 0.3, 1000 kg/m^3, four particles a cell; root mean "
                   "squares over particles at t = 0.5 s (turned farthest) and 1 s (back).",
                   "alpha = A (1 - cos 2 pi t)/2 h(R), sigma_rtheta = mu sin gamma, sigma_thetatheta = -sigma_rr = mu (1 - cos gamma), "
                   "gamma = R d(alpha)/dR.")
    force, deviation, flipped = (column(check, name) for name in ("force_m_s2", "deviation_m_s2", "twice_centripetal_m_s2"))
    report.paragraph(f"The body force, {force.max():.2f} m/s^2 at most, is that of a numerical differentiation of motion and stress "
                     f"to {deviation.max():.1e} m/s^2 at {len(check)} places and times; the wrong sign of the centripetal part would "
                     f"make it {flipped.max():.2f}. The program refuses to go on from 1e-3 of the largest force.")
    errors = ("half_displacement_m", "half_stress_Pa", "whole_displacement_m")
    main = [row for row in rows if row["amplitude"] == 0.1 and row["particles_per_side"] == 2
            and row["steps"] == STEPS_A_CELL[row["method"]] * row["cells"]]
    report.convergence(main, ("method", "amplitude", "shape"), "cells", errors)
    report.paragraph("Sixteen particles a cell, explicit, 96 x 96 cells:")
    report.table(["shape", *errors], [[row["shape"], *(f"{row[name]:.2g}" for name in errors)]
                                      for row in chosen(rows, amplitude=0.1, particles_per_side=4)])
    report.paragraph("Steps, B-splines on 96 x 96 cells:")
    report.table(["method", "steps", *errors],
                 [[row["method"], f"{row['steps']:g}", *(f"{row[name]:.3g}" for name in errors)]
                  for method in ("explicit", "midpoint")
                  for row in sorted(chosen(rows, amplitude=0.1, shape="bspline", cells=96, particles_per_side=2, method=method),
                                    key=lambda row: row["steps"])])
    report.paragraph("A = 0.2, where |gamma| exceeds pi/3 and short shear waves of this law grow (GIMP, explicit):")
    report.convergence(chosen(rows, amplitude=0.2), ("amplitude", "shape"), "cells", errors)
    for shape in SHAPES:
        for name, style in (("half_displacement_m", "o-"), ("whole_displacement_m", "s--")):
            series = chosen(main, method="explicit", shape=shape)
            axis.loglog(3 / column(series, "cells"), column(series, name), style, color=COLOURS[shape],
                        label=f"{shape}, {name.split('_')[0]} period")
    mesh_axis(axis, 3 / column(series, "cells"), title="generalised vortex, explicit, A = 0.1", xlabel="cell size [m]",
              ylabel="displacement error [m]")


def cylinder(tables, report, axis):
    curves, profiles = tables
    young, yield_stress, expansion, steps = 1e12, 1e6, 6e-6, 120
    modulus = 1e11  # of hardening
    limit = 2 / np.sqrt(3) * yield_stress * np.log(2)
    report.problem("Thick-walled cylinder",
                   "the same law with small strains, solved in the radius alone (`widened_cylinder`), and Hill's limit pressure. Radii "
                   "1 and 2 m, plane strain, E = 10^6 Y, nu = 0.3, Y = 1 MPa, hardening modulus 0 or 10^5 Y, a wall that widens the hole "
                   "by 0.006 mm in 120 quasi-static steps; axisymmetric strip of three cells, four particles a cell.",
                   "p = (2/sqrt 3) Y ln(b/a) = "
                   f"{limit / 1e6:.5f} MPa without hardening.")
    lines, references = [], {}
    for hardening in (0.0, modulus):
        pressure, radius, stress = widened_cylinder(young, 0.3, yield_stress, hardening, 1.0, 2.0, expansion, 4 * steps, 200)
        coarse = widened_cylinder(young, 0.3, yield_stress, hardening, 1.0, 2.0, expansion, 2 * steps, 100)[0]
        references[hardening] = pressure[3::4], radius, stress
        report.paragraph(f"Hardening modulus {hardening / yield_stress:g} Y: the reference ends at {pressure[-1] / 1e6:.5f} MPa, "
                         f"{(pressure[-1] / limit - 1) * 100:+.2f} % from the limit pressure; with half the cells and steps, "
                         f"{coarse[-1] / 1e6:.5f} MPa.")
    displacement = expansion * np.arange(1, steps + 1) / steps
    for wall in ("line", "body"):
        for shape in SHAPES:
            for hardening in (0.0, modulus):
                cells = sorted({row["cells"] for row in chosen(curves, shape=shape, wall=wall, hardening_Pa=hardening)})
                if not cells:
                    continue
                pressure, radius, stress = references[hardening]
                final, largest, profile = [], [], []
                for n in cells:
                    curve = column(chosen(curves, shape=shape, wall=wall, hardening_Pa=hardening, cells=n), "pressure_Pa")
                    points = chosen(profiles, shape=shape, wall=wall, hardening_Pa=hardening, cells=n)
                    final.append(curve[-1] / pressure[-1] - 1)
                    largest.append(np.max(np.abs(curve - pressure)) / limit)
                    misses = [column(points, name) - np.interp(column(points, "radius_m"), radius, stress[component])
                              for component, name in enumerate(("radial_Pa", "hoop_Pa", "axial_Pa"))]
                    profile.append(np.sqrt(np.mean(np.square(misses))) / yield_stress)
                what = f"wall={wall} shape={shape} hardening_Pa={hardening:g}"
                report.numbers(what + " final pressure, relative error", cells, final)
                report.numbers(what + " largest error of the pressure over the limit pressure", cells, largest)
                report.numbers(what + " stress error over Y", cells, profile)
                lines.append([wall, shape, f"{hardening / yield_stress:g}", listed(cells, "{:g}"), listed(final, "{:+.1e}"),
                              listed(largest, "{:.1e}"), listed(orders(np.array(largest))), listed(profile, "{:.1e}"),
                              listed(orders(np.array(profile)))])
    report.paragraph("Where the wall acts: `line`, its points on the line x = a, the side of the grid; `body`, in the middle of the cell "
                     "behind it.")
    report.table(["wall", "shape", "hardening modulus / Y", "cells", "final pressure, relative error",
                  "largest error on the curve / limit", "orders", "stress at the end, RMS error / Y", "orders"], lines)
    axis.plot(displacement * 1e6, references[0.0][0] / 1e6, "k-", label="reference")
    axis.axhline(limit / 1e6, color="grey", linewidth=0.8, label="limit pressure")
    for shape in SHAPES:
        for wall, style in (("line", "-"), ("body", "--")):
            curve = column(chosen(curves, shape=shape, wall=wall, hardening_Pa=0.0, cells=8), "pressure_Pa")
            axis.plot(displacement * 1e6, curve / 1e6, style, linewidth=1, color=COLOURS[shape], label=f"{shape}, wall: {wall}")
    axis.set(title="cylinder without hardening, 8 cells", xlabel="displacement of the wall [micrometres]", ylabel="pressure [MPa]")


def column_under_weight(tables, report, axis):
    (rows,) = tables
    report.problem("Column under its own weight",
                   "the closed form. Height 1 m, rho_0 g H = 0.2 alpha, alpha = K + 4 mu/3: 18 % compaction at the bottom; quasi-static, "
                   "four particles a cell, 1600 steps. Root mean squares over particles, the stress relative to that at the bottom.",
                   "sigma_yy = -rho_0 g (H - Y), F = exp(-rho_0 g (H - Y)/alpha).")
    main = chosen(rows, steps=1600, particles_per_side=2)
    report.convergence(main, ("shape",), "cells", ("displacement_m", "relative_stress"))
    report.paragraph("36 particles a cell, 32 cells:")
    report.table(["shape", "displacement [m]", "stress"],
                 [[row["shape"], f"{row['displacement_m']:.2g}", f"{row['relative_stress']:.2g}"]
                  for row in chosen(rows, particles_per_side=6, steps=1600)])
    series = sorted(chosen(rows, shape="bspline", particles_per_side=6), key=lambda row: row["steps"])
    errors = column(series, "displacement_m")
    report.paragraph(f"Steps, B-splines on 32 cells with 36 particles each: {listed(column(series, 'steps'), '{:g}')} give the "
                     f"displacement error {listed(errors, '{:.2g}')} m, orders {listed(orders(errors))}.")
    for shape in SHAPES:
        series = chosen(main, shape=shape)
        for name, style, label in (("displacement_m", "o-", "displacement [m]"), ("relative_stress", "s--", "stress [1]")):
            axis.loglog(1 / column(series, "cells"), column(series, name), style, color=COLOURS[shape], label=f"{shape}, {label}")
    mesh_axis(axis, 1 / column(series, "cells"), title="column under its own weight", xlabel="cell size [m]",
              ylabel="error: displacement [m], stress [of that at the bottom]")


def elastica(tables, report, axis):
    tips, lines, stiffness = tables
    length, thickness, young = 10.0, 0.5, 1e6
    bending = young * thickness**3 / 12
    load = 6 * bending / length**3
    s, x_thin, y_thin = hanging_beam(length, load, bending)
    s, x, y = hanging_beam(length, load, bending, young * thickness, 5 / 6 * young / 2 * thickness)
    report.problem("Elastica",
                   "the thin beam (`hanging_beam`), and the beam that is stretched and sheared besides (Reissner 1972), which the errors "
                   "refer to. Length 10 m, thickness 0.5 m, clamped at a fixed side of the grid, weight 6 E I/L^3 a metre grown in the "
                   "run, E = 1 MPa, nu = 0, 1000 kg/m^3.",
                   "E I theta'' = -q (L - s) cos theta, theta(0) = 0, theta'(L) = 0, which is integrated numerically.")
    report.paragraph(f"The tip of the elastica is at ({x_thin[-1]:.4f}, {y_thin[-1]:.4f}) m, that of the stretched and sheared beam at "
                     f"({x[-1]:.4f}, {y[-1]:.4f}) m. Errors are the distance of the last column of particles from that beam's point of "
                     "the same s, over the deflection there.")
    for row in tips:
        x_beam, y_beam = np.interp(row["s_m"], s, x), np.interp(row["s_m"], s, y)
        row["error"] = np.hypot(row["x_m"] - x_beam, row["y_m"] - y_beam) / abs(y_beam)
    table = []
    for shape in SHAPES:
        for per_side in (2, 4, 8):
            series = chosen(tips, method="implicit", shape=shape, particles_per_side=per_side, steps=400)
            reached = chosen(series, load=1.0)
            errors = column(reached, "error")
            report.numbers(f"implicit shape={shape} particles_per_side={per_side:g} tip error", column(reached, "cells_through"), errors)
            stopped = [f"{row['cells_through']:g} cells stop at {100 * row['load']:.0f} % of the load"
                       for row in series if row["load"] < 1.0]
            table.append([shape, f"{per_side:g}", listed(column(reached, "cells_through"), "{:g}"), listed(100 * errors, "{:.1f}"),
                          listed(orders(errors)), "; ".join(stopped)])
    report.paragraph("Implicit method, 400 steps:")
    report.table(["shape", "particles along a side", "cells through the thickness", "tip error [%]", "orders", ""], table)
    series = sorted(chosen(tips, method="implicit", shape="bspline", cells_through=4, particles_per_side=4), key=lambda row: row["steps"])
    report.paragraph(f"Steps, B-splines, 4 cells, 4 particles along a side: {listed(column(series, 'steps'), '{:g}')} give "
                     f"{listed(100 * column(series, 'error'), '{:.2f}')} %.")
    report.paragraph("Quasi-static method, 4 cells, 2 particles along a side, 400 steps: where Newton's method fails, and the smallest "
                     "eigenvalues of the stiffness there, scaled to a diagonal of ones.")
    report.table(["shape", "load reached [%]", "smallest eigenvalues", "largest"],
                 [[row["shape"], f"{100 * row['load']:.1f}", listed(eigenvalues[:3], "{:.0e}"), f"{eigenvalues[-1]:.1f}"]
                  for row in chosen(tips, method="quasi-static")
                  for eigenvalues in [scaled_eigenvalues(chosen(stiffness, shape=row["shape"]))]])
    axis.plot(x, y, "k-", label="beam")
    for shape in SHAPES:
        for per_side, style in ((2, ":"), (4, "--"), (8, "-")):
            line = chosen(lines, method="implicit", shape=shape, cells_through=4, particles_per_side=per_side, steps=400)
            axis.plot(column(line, "x_m"), column(line, "y_m"), style, linewidth=1, color=COLOURS[shape],
                      label=f"{shape}, {per_side} particles a side")
    axis.set(title="elastica, 4 cells through the thickness", xlabel="x [m]", ylabel="y [m]", aspect="equal")


def cook(tables, report, axis):
    (rows,) = tables
    published = 23.96  # plane stress, nu = 1/3
    settings = (("plane stress", 1 / 3), ("plane strain", 0.4999))
    report.problem("Cook's membrane",
                   "one element of high polynomial degree (`cook_by_polynomials`); for plane stress besides the 23.96 that the "
                   "literature has. E = 1, shear force 1, linear: one step under a thousandth of the force. Staircase of particles at "
                   "the slanted edges, the force on the last column of particles; the displacement is that of the particle nearest to "
                   "(48, 52).",
                   "none.")
    table = []
    for geometry, nu in settings:
        values = [cook_by_polynomials(nu, geometry == "plane stress", degree) for degree in (16, 24, 32)]
        report.paragraph(f"{geometry.capitalize()}, nu = {nu:.4f}: {listed(values, '{:.3f}')} with the degrees 16, 24, 32"
                         + (f"; literature {published}." if geometry == "plane stress" else "."))
        reference = values[-1]
        line, points = ("-", "o-") if geometry == "plane stress" else ("--", "s--")
        axis.axhline(reference, color="k", linewidth=0.8, linestyle=line, label=f"polynomials, {geometry}")
        for shape in SHAPES:
            series = chosen(rows, shape=shape, geometry=geometry)
            u = column(series, "displacement")
            report.numbers(f"{geometry} shape={shape} displacement", column(series, "cell"), u)
            table.append([geometry, shape, listed(column(series, "cell"), "{:g}"), listed(u),
                          listed(100 * (u / reference - 1), "{:+.1f}"), listed(orders(u - reference))])
            axis.semilogx(column(series, "cell"), u, points, color=COLOURS[shape], linewidth=1, label=f"{shape}, {geometry}")
    report.table(["geometry", "shape", "cell", "displacement", "deviation [%]", "orders"], table)
    mesh_axis(axis, column(series, "cell"), title="Cook's membrane", xlabel="cell size [1/48 of the width]",
              ylabel="displacement of (48, 52) [same unit]")


def main():
    arguments = common.parser(__doc__, work="out/verification/solutions").parse_args()
    program = arguments.program.parent / "solutions"
    arguments.work.mkdir(parents=True, exist_ok=True)
    report = Report()
    figure, axes = plt.subplots(2, 3, figsize=(17, 10), layout="constrained")
    problems = {"manufactured": manufactured, "vortex": vortex, "cylinder": cylinder, "column": column_under_weight, "elastica": elastica,
                "cook": cook}
    for (case, evaluate), axis in zip(problems.items(), axes.flat):
        evaluate(computed(program, arguments.work, case), report, axis)
        axis.legend(fontsize=7)
    text = (f"# Closed forms and manufactured solutions\n\n{common.provenance()}\n\n"
            "Orders are those from each mesh to the next of half its cell size, or from steps to half as long ones.\n")
    common.publish(arguments.results, "solutions", text + report.text, ["problem", "series", "mesh", "value"], report.rows)
    figure.savefig(arguments.results / "solutions.png", dpi=110)


if __name__ == "__main__":
    main()
