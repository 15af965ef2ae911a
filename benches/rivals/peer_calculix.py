"""CalculiX: beams B31 or B32R, which it expands to solids with a square section; for S1 and S2.

Shear and torsion follow from the solid, so the section is not quite that of the scene. Setting: element. Times are
those of the whole process.
"""

import math
import re
import resource
import subprocess
import tempfile
from pathlib import Path

import scenes

job = scenes.job()
scene, n, levels = job["scene"], job["elements"], job["levels"]
per_element = 2 if job["element"].startswith("B32") else 1
last = n * per_element + 1
middle = (last + 1) // 2
places = scenes.nodes(scene, last - 1)

INPUT = """\
*NODE,NSET=ALL
{nodes}
*ELEMENT,TYPE={element},ELSET=BEAM
{elements}
*MATERIAL,NAME=M
*ELASTIC
{modulus!r},0.
*BEAM SECTION,ELSET=BEAM,MATERIAL=M,SECTION=RECT
{side!r},{side!r}
0,0,1
*BOUNDARY
1,1,6
*NSET,NSET=SEEN
{middle},{last}
*STEP,NLGEOM,INC=100000
*STATIC
{level!r},1.,1e-6,{level!r}
*CLOAD
{last},{direction},{size!r}
*NODE PRINT,NSET=SEEN
U
*END STEP
"""


def text():
    data = scenes.SECTIONS[scene]
    side = math.sqrt(12 * data["EI"] / data["EA"])
    rows = [[i * per_element + k + 1 for k in range(per_element + 1)] for i in range(n)]
    bend = scene == "S2"
    return INPUT.format(
        nodes="\n".join(f"{i + 1},{x!r},{y!r},{z!r}" for i, (x, y, z) in enumerate(places)),
        elements="\n".join(",".join(map(str, [i + 1, *row])) for i, row in enumerate(rows)),
        element=job["element"], modulus=data["EA"] / side**2, side=side, middle=middle, last=last, level=1 / levels,
        direction=3 if bend else 6, size=scenes.BEND_FORCE if bend else scenes.roll_up_moment(scene))


def displacements(printed):
    """The last displacement of each node in a .dat file."""
    rows = (line.split() for line in printed.splitlines())
    return {int(row[0]): [float(x) for x in row[1:4]] for row in rows if len(row) == 4 and row[0].isdigit()}


with tempfile.TemporaryDirectory() as folder:
    path = Path(folder)
    (path / "scene.inp").write_text(text())
    log = subprocess.run(["ccx", "-i", "scene"], cwd=path, capture_output=True, text=True).stdout
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = path / "scene.dat"
    moved = displacements(output.read_text() if output.exists() else "")
ok = "Job finished" in log and {middle, last} <= moved.keys()
ends = {name: [p + u for p, u in zip(places[k - 1], moved.get(k, [0.0] * 3))]
        for name, k in (("middle", middle), ("tip", last))}
iterations = len(re.findall(r"^\s*iteration\s+\d+", log, re.MULTILINE))
version = re.search(r"Version ([\d.]+)", log)
scenes.report(version.group(1) if version else "?", ok, iterations, usage.ru_utime + usage.ru_stime, ends)
