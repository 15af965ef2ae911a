#!/usr/bin/env python3
"""Reads fields that beamsim has written with VTK itself, and holds them against the columns of the history.

    python3 tests/vtk/read_back.py target/release/beamsim      (needs the package `vtk` from PyPI)

Where VTK is not installed it says so and ends well.
"""

import csv
import math
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

# An arc of cubic elements, a straight piece of quadratic ones at an angle, and a body at the end: bent, twisted and let go.
DECK = """
[point]
root = [0, 0, 0]
mid = [0.6, 0.25, 0]
knee = [1, 1, 0]
tip = [1, 1, 1]
[section.s]
EA = 1e3
GA = 800
GJ = 6
EI = [10, 15]
rhoA = 1
rhoJ = [0.02, 0.01, 0.01]
[[beam]]
name = "arc"
section = "s"
arc = ["root", "mid", "knee"]
elements = 3
order = 3
[[beam]]
name = "post"
section = "s"
through = ["knee", "tip"]
elements = 2
order = 2
[[body]]
at = "tip"
mass = 0.5
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [3, -2, 4]
stages = [1]
[[stage]]
kind = "static"
steps = 2
[[stage]]
kind = "dynamic"
end = 0.2
step = 0.02
[[surface]]
name = "pad"
kind = "sphere"
at = [2.2, 1, 1]
radius = 1
[[contact]]
name = "stop"
nodes = ["tip"]
beams = ["post"]
surfaces = ["pad"]
radius = 0.199
stiffness = 1e3
[output]
nodes = [NODES]
columns = ["x", "u", "r", "d", "v", "resultant", "strain", "contact"]
every = 3
vtk = true
"""

POINTS = [f"arc:{k}" for k in range(10)] + [f"post:{k}" for k in range(5)]
FIELDS = {
    "displacement": ["ux", "uy", "uz"],
    "rotation": ["rx", "ry", "rz"],
    "d1": ["d1x", "d1y", "d1z"],
    "d2": ["d2x", "d2y", "d2z"],
    "d3": ["d3x", "d3y", "d3z"],
    "velocity": ["vx", "vy", "vz"],
    "N": ["N1", "N2", "N3"],
    "M": ["M1", "M2", "M3"],
    "Gamma": ["G1", "G2", "G3"],
    "K": ["K1", "K2", "K3"],
}
# VTK's cubic line, quadratic edge and vertex.
CELLS = [35, 35, 35, 21, 21, 1]


def read(path):
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def close(came, wanted, what, tolerance=1e-12):
    if not math.isclose(came, wanted, rel_tol=tolerance, abs_tol=1e-13):
        raise SystemExit(f"{what}: {came!r} in the field, {wanted!r} in the history")


def hold(grid, row, counts):
    data = grid.GetPointData()
    for k, node in enumerate(POINTS):
        for component, axis in enumerate("xyz"):
            close(grid.GetPoint(k)[component], float(row[f"{node}.{axis}"]), f"{node} position")
            counts["numbers"] += 1
        for field, columns in FIELDS.items():
            for component, column in enumerate(columns):
                close(data.GetArray(field).GetTuple(k)[component], float(row[f"{node}.{column}"]), f"{node} {field}")
                counts["numbers"] += 1
        energy = 0.5 * sum(
            data.GetArray(stress).GetTuple(k)[i] * data.GetArray(strain).GetTuple(k)[i]
            for stress, strain in (("N", "Gamma"), ("M", "K"))
            for i in range(3)
        )
        # On the arc the axes of the Gauss points are not those of the node: strains and resultants are extrapolated each for itself.
        tolerance = 1e-2 if node.startswith("arc") else 1e-10
        close(data.GetArray("strain_energy_per_length").GetValue(k), energy, f"{node} energy", tolerance)
    hold_contacts(data, row)
    cells = [grid.GetCellType(k) for k in range(grid.GetNumberOfCells())]
    if cells != CELLS:
        raise SystemExit(f"cells {cells}, not {CELLS}")
    for name, column in (("TimeValue", "time"), ("load", "load"), ("stage", "stage")):
        close(grid.GetFieldData().GetArray(name).GetValue(0), float(row[column]), name)


def hold_contacts(data, row):
    """The forces at all nodes have the resultant of the history, and the least gap at nodes is not below that of all points."""
    force, gap = data.GetArray("contact_force"), data.GetArray("gap")
    nodes = range(force.GetNumberOfTuples())
    for axis, name in enumerate(("fx", "fy", "fz")):
        close(sum(force.GetTuple(k)[axis] for k in nodes), float(row[f"stop.{name}"]), name, 1e-9)
    gaps = [gap.GetValue(k) for k in nodes if not math.isnan(gap.GetValue(k))]
    if len(gaps) != 6 or min(gaps) < float(row["stop.gap"]) - 1e-12:
        raise SystemExit(f"gaps {gaps}, least {row['stop.gap']}")


def check_curve(grid):
    """The curve of a cubic cell goes through its nodes: each lies where VTK puts its parameter."""
    cell = grid.GetCell(0)
    for parameter, node in ((0.0, 0), (1.0, 3), (1 / 3, 1), (2 / 3, 2)):
        place, weights, part = [0.0] * 3, [0.0] * 4, vtk_int()
        # VTK's cubic line runs from -1 to 1.
        cell.EvaluateLocation(part, [2 * parameter - 1, 0, 0], place, weights)
        for came, wanted in zip(place, grid.GetPoint(node)):
            close(came, wanted, f"the curve at {parameter}")


def vtk_int():
    from vtkmodules.vtkCommonCore import reference

    return reference(0)


def main(beamsim):
    try:
        import vtkmodules.vtkIOXML  # noqa: F401
    except ImportError:
        print("skipped: VTK is not installed (pip install vtk)")
        return
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "deck.toml").write_text(DECK.replace("NODES", ", ".join(f'"{node}"' for node in POINTS)))
        subprocess.run([Path(beamsim).resolve(), "run", "deck.toml", "--out", "r"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        rows = list(csv.DictReader((folder / "r/history.csv").open()))
        sets = ElementTree.parse(folder / "r/fields.pvd").getroot().findall(".//DataSet")
        if len(sets) != len(rows):
            raise SystemExit(f"{len(sets)} files, {len(rows)} rows")
        times = [float(entry.get("timestep")) for entry in sets]
        if times != sorted(set(times)):
            raise SystemExit(f"times stand still: {times}")
        counts = {"numbers": 0}
        for row, entry in zip(rows, sets):
            grid = read(folder / "r" / entry.get("file"))
            hold(grid, row, counts)
            check_curve(grid)
    print(f"VTK reads {len(rows)} files; {counts['numbers']} numbers are those of the history")


if __name__ == "__main__":
    main(*sys.argv[1:] or ["target/release/beamsim"])
