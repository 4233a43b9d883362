#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether ParaView shows what fields.h5 holds: a short run of every program that writes snapshots, and one that is killed, opened with
both of ParaView's readers of XDMF (Xdmf3ReaderS and XDMFReader).

Compared with h5py, of every snapshot: the time, the meshes, their bounds and numbers of points and cells, and of every array where it
lives, its components, and of each component the extremes, the sum, and the sums weighted with x and y, which know a value at the wrong
place. Then each reader draws a picture, with arrows, on a display that nobody sees.

    verification/paraview.py            # two minutes; needs Debian's python3-paraview and xvfb
"""

import collections
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

READERS = ("Xdmf3ReaderS", "XDMFReader")
SCENES = "drivers/scenes"
Case = collections.namedtuple("Case", "command colour arrows killed", defaults=(False,))
CASES = {
    "shear_band": Case(["shear_band", "--cells=60x40", "--snapshots-every=0.4"], "effective_temperature", "velocity"),
    "shear_band, killed": Case(["shear_band", "--cells=160", "--snapshots-every=0.05"], "von_mises_stress", "velocity", True),
    "scene, tall cell": Case(["scene", f"{SCENES}/tall-cell.toml", "--cells=24x72"], "plastic_strain_rate", "velocity"),
    "scene, glass on points": Case(["scene", f"{SCENES}/glass-block.toml", "--cells=16", "--snapshots-every=0.4"],
                                   "effective_temperature", "displacement"),
    "elastic_bar": Case(["elastic_bar"], "stress_xx", "velocity"),
    "plastic_bar": Case(["plastic_bar"], "plastic_strain", "displacement"),
    "colliding_disks": Case(["colliding_disks"], "von_mises_stress", "velocity"),
    "upsetting": Case(["upsetting", "--dt=1e-4"], "plastic_strain", "displacement"),
    "vibrating_bar": Case(["vibrating_bar", "--duration=3", "--snapshots-every=1"], "stress_xx", "velocity"),
    "taylor_bar": Case(["taylor_bar", "--snapshots-every=2e-5"], "plastic_strain", "velocity"),
    "scene, strip with a hole": Case(["scene", f"{SCENES}/strip-with-hole.toml"], "stress_yy", "displacement"),
}


def moments(values, x, y):
    """[component][extremes, sum, sums weighted with x and y]; None where a component is NaN everywhere."""
    import numpy as np

    values = values.reshape(len(x), -1)
    found = []
    for component in values.T:
        there = ~np.isnan(component)
        v = component[there]
        found.append([v.min(), v.max(), v.sum(), v @ x[there], v @ y[there]] if v.size else None)
    return found


# --- in a process of its own: a reader may crash -----------------------------------------------------------------------------


def leaves(data):
    """The data sets in a composite one, in order."""
    if not data.IsA("vtkCompositeDataSet"):
        return [data]
    found, iterator = [], data.NewIterator()
    iterator.InitTraversal()
    while not iterator.IsDoneWithTraversal():
        found.append(iterator.GetCurrentDataObject())
        iterator.GoToNextItem()
    return found


def mesh_in(data):
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkCellCenters

    places = {"points": vtk_to_numpy(data.GetPoints().GetData()).reshape(-1, 3).astype(float)}
    centres = vtkCellCenters()
    centres.SetInputData(data)
    centres.Update()
    places["cells"] = vtk_to_numpy(centres.GetOutput().GetPoints().GetData()).reshape(-1, 3).astype(float)
    arrays = {}
    for where, attributes in (("points", data.GetPointData()), ("cells", data.GetCellData())):
        for k in range(attributes.GetNumberOfArrays()):
            values = vtk_to_numpy(attributes.GetArray(k)).astype(float)
            x, y, _ = places[where].T
            arrays[attributes.GetArrayName(k)] = [where, moments(values, x, y) if len(values) == len(x) else "of another length"]
    points = places["points"]
    return {"points": len(points), "cells": data.GetNumberOfCells(), "bounds": [*np.ravel([points.min(0), points.max(0)])],
            "arrays": arrays}


def draw(simple, reader, time_s, colour, arrows, picture):
    """Returns how many arrows there are."""
    view = simple.CreateView("RenderView")
    view.ViewSize = [360, 300]
    view.OrientationAxesVisibility = 0
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    view.ViewTime = time_s
    shown = simple.Show(reader, view)
    on_cells = reader.CellData.GetArray(colour) is not None
    shown.SetRepresentationType("Surface" if on_cells else "Points")
    shown.PointSize = 4
    simple.ColorBy(shown, ("CELLS" if on_cells else "POINTS", colour))
    table = simple.GetColorTransferFunction(colour)
    table.NanColor = [0.7, 0.7, 0.7]
    table.RescaleTransferFunction(*(reader.CellData if on_cells else reader.PointData)[colour].GetRange())
    bounds = reader.GetDataInformation().GetBounds()
    vector = reader.PointData[arrows]
    longest = max(max(abs(bound) for bound in vector.GetRange(k)) for k in range(vector.GetNumberOfComponents()))
    glyphs = simple.Glyph(reader, GlyphType="Arrow", OrientationArray=["POINTS", arrows], ScaleArray=["POINTS", arrows])
    glyphs.ScaleFactor = 0.12 * max(bounds[1] - bounds[0], bounds[3] - bounds[2]) / longest
    glyphs.GlyphMode = "Every Nth Point"
    glyphs.Stride = max(1, reader.GetDataInformation().GetNumberOfPoints() // 150)
    simple.UpdatePipeline(time_s, glyphs)
    drawn = simple.Show(glyphs, view)
    simple.ColorBy(drawn, None)
    drawn.AmbientColor = drawn.DiffuseColor = [0, 0, 0]
    simple.ResetCamera(view)
    simple.SaveScreenshot(str(picture), view, ImageResolution=view.ViewSize)
    return glyphs.GetDataInformation().GetNumberOfPoints()


def read(reader_name, description, colour, arrows, picture):
    from paraview import servermanager, simple

    reader = simple.Xdmf3ReaderS(FileName=[description]) if reader_name == "Xdmf3ReaderS" else simple.XDMFReader(FileNames=[description])
    reader.UpdatePipelineInformation()
    times = reader.TimestepValues
    times = list(times) if hasattr(times, "__len__") else [times]
    snapshots = []
    for time_s in times:
        reader.UpdatePipeline(time_s)
        snapshots.append([mesh_in(data) for data in leaves(servermanager.Fetch(reader))])
    drawn = draw(simple, reader, times[-1], colour, arrows, picture)
    print(json.dumps({"version": str(servermanager.vtkSMProxyManager.GetParaViewSourceVersion()).split()[-1], "times": times,
                      "snapshots": snapshots, "arrows": drawn}))


# --- what is expected --------------------------------------------------------------------------------------------------------


def composites(fields):
    """The vectors and tensors of a snapshot: {name: (a component, values)}."""
    import numpy as np

    found = {}
    for name, values in fields.items():
        if name.endswith("_x") and name[:-1] + "y" in fields:
            found[name[:-2]] = name, np.stack([values, fields[name[:-1] + "y"], 0 * values], -1)
        if name.endswith("_xx"):
            xx, yy, zz, xy = (fields[name[:-2] + part] for part in ("xx", "yy", "zz", "xy"))
            none = 0 * xx
            found[name[:-3]] = name, np.stack([xx, xy, none, xy, yy, none, none, none, zz], -1)
    return found


def expected(path):
    """The times of a fields.h5, and of each snapshot its meshes as mesh_in() describes them."""
    import h5py
    import numpy as np

    times, snapshots = [], []
    with h5py.File(path, "r") as file:
        for _, group in sorted(file["snapshots"].items()):
            times.append(float(group.attrs["time_s"]))
            where = {name: "cells" if data.attrs.get("centring") == "cell" else "points" for name, data in group.items()}
            places = {name: data[()] for name, data in group.items() if data.ndim == 2 and "centring" not in data.attrs}
            fields = {name: data[()] for name, data in group.items() if name not in places}
            for name, (like, values) in composites(fields).items():
                fields[name], where[name] = values, where[like]
            if "grid" in file:
                axes = {at: np.meshgrid(file[f"grid/x_{part}"][()], file[f"grid/y_{part}"][()])
                        for at, part in (("points", "corner"), ("cells", "centre"))}
                cells = axes["cells"][0].size
            else:
                axes = {"points": places.pop("position").T}
                cells = axes["points"][0].size
            axes = {at: [axis.ravel() for axis in both] for at, both in axes.items()}
            arrays = {name: [where[name], moments(values, *axes[where[name]])] for name, values in fields.items()}
            meshes = [(axes["points"], cells, arrays)]
            none = {name: [at, [None] * len(components)] for name, (at, components) in arrays.items()}
            meshes += [(points.T, len(points), none) for _, points in sorted(places.items())]
            snapshots.append([{"points": x.size, "cells": count, "bounds": [x.min(), y.min(), 0.0, x.max(), y.max(), 0.0], "arrays": found}
                              for (x, y), count, found in meshes])
    return times, snapshots


def differences(found, times, snapshots):
    """Sentences, none if the reader has it right."""
    import numpy as np

    if not np.array_equal(found["times"], times):
        return [f"times {found['times']}, not {times}"]
    wrong = [] if found["arrows"] else ["no arrows"]
    for time_s, meshes, wanted in zip(times, found["snapshots"], snapshots):
        # h5py knows rigid bodies by name, the reader in the order of the scene
        meshes, wanted = ([*every[:1], *sorted(every[1:], key=lambda mesh: mesh["bounds"])] for every in (meshes, wanted))
        if len(meshes) != len(wanted):
            wrong.append(f"t = {time_s:g} s: {len(meshes)} meshes, not {len(wanted)}")
        for mesh, right in zip(meshes, wanted):
            for key in ("points", "cells"):
                if mesh[key] != right[key]:
                    wrong.append(f"t = {time_s:g} s: {mesh[key]} {key}, not {right[key]}")
            if not np.array_equal(mesh["bounds"], right["bounds"]):
                wrong.append(f"t = {time_s:g} s: bounds {mesh['bounds']}, not {right['bounds']}")
            if mesh["arrays"].keys() != right["arrays"].keys():
                wrong.append(f"t = {time_s:g} s: the arrays differ by {sorted(mesh['arrays'].keys() ^ right['arrays'].keys())}")
            size = max(abs(bound) for bound in right["bounds"])
            for name in mesh["arrays"].keys() & right["arrays"].keys():
                (where, components), (place, others) = mesh["arrays"][name], right["arrays"][name]
                if where != place or len(components) != len(others):
                    wrong.append(f"t = {time_s:g} s: {name} has {len(components)} components at {where}, not {len(others)} at {place}")
                elif not all(same(a, b, right[where], size) for a, b in zip(components, others)):
                    wrong.append(f"t = {time_s:g} s: {name} has other values")
    return wrong


def same(a, b, count, size):
    """Whether moments are: extremes exactly, sums to round-off."""
    if a is None or b is None:
        return a is b
    bound = 1e-12 * count * max(abs(b[0]), abs(b[1]))
    return a[:2] == list(b[:2]) and abs(a[2] - b[2]) <= bound and all(abs(p - q) <= bound * size for p, q in zip(a[3:], b[3:]))


# --- the study ---------------------------------------------------------------------------------------------------------------


def run(case, programs, root, folder):
    """Returns the file with the numbers."""
    command = [str(programs / case.command[0]), *(str(root / word) if word.startswith(SCENES) else word for word in case.command[1:]),
               "--quiet", "--threads=1", f"--output={folder}"]
    if not case.killed:
        subprocess.run(command, check=True, timeout=300)
        return folder / "fields.h5"
    description = folder / "fields.xdmf"
    description.unlink(missing_ok=True)
    with subprocess.Popen(command) as process:
        end = time.monotonic() + 60
        while time.monotonic() < end and process.poll() is None:
            if description.exists() and description.read_text().count("<Time") >= 4:
                break
            time.sleep(0.002)
        process.send_signal(signal.SIGKILL)
    if process.returncode != -signal.SIGKILL:
        raise SystemExit(f"paraview.py: {command[0]} ended with status {process.returncode} before it could be killed: use more cells")
    return folder / "fields.h5.partial"


def shown_by(reader, case, folder, picture):
    """What the reader finds; or why it did not come to an end."""
    # -P: this script must not be found as the module paraview
    process = subprocess.run([sys.executable, "-P", __file__, "--read", reader, str(folder / "fields.xdmf"), case.colour, case.arrows,
                              str(picture)], capture_output=True, text=True, timeout=300)
    if process.returncode != 0:
        return None, f"status {process.returncode}: {(process.stderr.strip().splitlines() or ['no message'])[-1]}"
    return json.loads(process.stdout.strip().splitlines()[-1]), ""


def contact_sheet(pictures, path):
    import matplotlib.pyplot as plt

    columns = 2 * len(READERS)
    rows = -(-len(pictures) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(2.4 * columns, 2.2 * rows), squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for axis, ((case, reader), picture) in zip(axes.flat, pictures.items()):
        axis.set_title(f"{case}\n{reader}", fontsize=7)
        if picture.exists():
            axis.imshow(plt.imread(picture))
    figure.tight_layout()
    partial = path.with_suffix(".partial.png")
    figure.savefig(partial, dpi=130)
    os.replace(partial, path)


def start_display():
    """An X server without a screen, kept alive between two programs that draw."""
    ready, write = os.pipe()
    try:
        server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-noreset", "-ac", "-nolisten", "tcp", "-screen", "0", "800x800x24"],
                                  pass_fds=[write], stderr=subprocess.DEVNULL)
    except FileNotFoundError:
        raise SystemExit("paraview.py: there is no Xvfb to draw on: apt-get install xvfb")
    os.close(write)
    with os.fdopen(ready) as pipe:
        os.environ["DISPLAY"] = ":" + pipe.readline().strip()
    return server


def main():
    import common

    arguments = common.parser(__doc__, work="out/verification/paraview").parse_args()
    if subprocess.run([sys.executable, "-P", "-c", "import paraview"], capture_output=True).returncode != 0:
        raise SystemExit("paraview.py: ParaView's Python module is missing: apt-get install --no-install-recommends python3-paraview")
    arguments.work.mkdir(parents=True, exist_ok=True)
    rows, failures, pictures, version = [], [], {}, "?"
    server = start_display()
    try:
        with tempfile.TemporaryDirectory() as scratch:
            for number, (name, case) in enumerate(CASES.items()):
                folder = arguments.work / name.replace(",", "").replace(" ", "-")
                times, snapshots = expected(run(case, arguments.program.parent, common.ROOT, folder))
                meshes = snapshots[-1]
                row = [name, len(times), " + ".join(str(mesh["points"]) for mesh in meshes), meshes[0]["cells"], len(meshes[0]["arrays"])]
                for reader in READERS:
                    picture = Path(scratch) / f"{number}-{reader}.png"
                    found, why = shown_by(reader, case, folder, picture)
                    wrong = differences(found, times, snapshots) if found else [why]
                    version = found["version"] if found else version
                    failures += [f"{name}, {reader}: {sentence}" for sentence in wrong]
                    pictures[name, reader] = picture
                    row.append("the same" if not wrong else f"{len(wrong)} differences")
                print(*row, sep=", ", flush=True)
                rows.append(row)
            arguments.results.mkdir(parents=True, exist_ok=True)
            contact_sheet(pictures, arguments.results / "paraview.png")
    finally:
        server.terminate()
        server.wait()
    header = ["run", "snapshots", "points", "cells", "arrays", *READERS]
    text = (f"# What ParaView {version} shows\n\n{common.provenance()}\n\nEvery snapshot, against h5py: times, meshes, bounds, and of each "
            "component of each array the extremes, the sum, and the sums weighted with x and y. Points: particles, and those of each rigid "
            "body. `material_point` leaves no snapshots.\n\n" + common.markdown_table(header, rows) +
            "\n![The last snapshot in both readers](paraview.png)\n" + "".join(f"\n- {failure}" for failure in failures[:50]))
    common.publish(arguments.results, "paraview", text, header, rows)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--read"]:
        read(*sys.argv[2:])
    else:
        main()
