#!/usr/bin/env python3
"""Draws the scenes of docs/contact.md from their decks, with nothing but Python.

    python3 docs/pictures/contact.py target/release/beamsim [NAME...]

Each beam is drawn as its centre line through places at equal parts of its length, in a few rows of the history.
"""

import csv
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
DECKS = HERE.parent.parent / "decks"
BEAMSIM = Path(sys.argv[1]).resolve()
WIDTH, MOST_HEIGHT, MARGIN = 780, 460, 30  # pixels
FIRST, LAST = (0xC6, 0xDB, 0xEF), (0x08, 0x30, 0x6B)  # colours of the first and of the last row


def side(point):
    """Seen along y."""
    return point[0], -point[2]


def top(point):
    """Seen along z."""
    return point[0], -point[1]


def oblique(point):
    """Seen from above at an angle."""
    x, y, z = point
    return x + 0.45 * y, -(z + 0.3 * y)


@dataclass
class Scene:
    deck: str  # in decks/, without the ending
    beams: list
    view: object = side
    rows: int = 6  # rows that are drawn, at equal parts of the history; 1: the last
    places: int = 60  # of each beam
    surfaces: list = field(default_factory=list)  # lines of points in space
    balls: dict = field(default_factory=dict)  # radii of bodies by their nodes


def circle(centre, radius, axes):
    """A circle in the plane of two coordinates (0 to 2)."""
    line = []
    for k in range(73):
        point = list(centre)
        point[axes[0]] += radius * math.cos(k * math.pi / 36)
        point[axes[1]] += radius * math.sin(k * math.pi / 36)
        line.append(point)
    return line


SCENES = {
    "mast": Scene("contact/scenes/mast_unfolds", ["first", "second", "third"], rows=9, surfaces=[[[-0.1, 0, 0], [3.2, 0, 0]]]),
    "coil": Scene("contact/scenes/coil_spring_closes", ["coil"], rows=2, places=400),
    "knot": Scene("contact/scenes/knot", ["cord"], view=top, rows=4, places=160),
    "guidewire": Scene("contact/scenes/guidewire", ["wire"], view=top, rows=4, places=300),
    "winch": Scene(
        "contact/scenes/winch", ["cable"], view=oblique, rows=1, places=240,
        surfaces=[circle([0, y, 0], 0.1, (0, 2)) for y in (-0.02, 0.08)],
    ),
    "gripper": Scene(
        "contact/scenes/two_finger_gripper", ["left", "right"], rows=3, surfaces=[[[-0.1, 0, 0], [0.1, 0, 0]]], balls={"ball": 0.03},
    ),
    "tubes": Scene("joints/concentric_tubes_after_snap", ["outer"], view=oblique, rows=12),
}


def history(scene, folder):
    nodes = [f"{beam}@{k / scene.places:.10g}" for beam in scene.beams for k in range(scene.places + 1)] + list(scene.balls)
    out = Path(folder) / "out"
    change = ["--set", f"output.nodes={nodes}", "--set", 'output.columns=["x"]']
    run = [BEAMSIM, "run", DECKS / f"{scene.deck}.toml", "--out", out, *change]
    subprocess.run(run, cwd=folder, check=True, capture_output=True)
    with open(out / "history.csv") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    place = lambda row, node: tuple(row[f"{node}.{axis}"] for axis in "xyz")
    lines = lambda row: [[place(row, f"{beam}@{k / scene.places:.10g}") for k in range(scene.places + 1)] for beam in scene.beams]
    balls = lambda row: [circle(place(row, node), radius, (0, 2)) for node, radius in scene.balls.items()]
    return [lines(row) + balls(row) for row in rows]


def draw(name, scene):
    with tempfile.TemporaryDirectory() as folder:
        rows = history(scene, folder)
    shown = [rows[round((k + 1) * (len(rows) - 1) / scene.rows)] for k in range(scene.rows)]
    flat = [[[scene.view(point) for point in line] for line in row] for row in [scene.surfaces, *shown]]
    every = [point for row in flat for line in row for point in line]
    low = [min(p[k] for p in every) for k in (0, 1)]
    high = [max(p[k] for p in every) for k in (0, 1)]
    scale = min((WIDTH - 2 * MARGIN) / (high[0] - low[0]), (MOST_HEIGHT - 2 * MARGIN) / max(high[1] - low[1], 1e-9))
    at = lambda point: tuple(MARGIN + scale * (point[k] - low[k]) for k in (0, 1))
    parts = []
    for number, row in enumerate(flat):
        share = number / (len(flat) - 1)
        colour = "#888888" if number == 0 else "#%02x%02x%02x" % tuple(round(a + share * (b - a)) for a, b in zip(FIRST, LAST))
        for line in row:
            path = "M" + " L".join(f"{x:.1f},{y:.1f}" for x, y in map(at, line))
            parts.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{1.5 if number == 0 else 2.5}" stroke-linejoin="round"/>')
    width, height = (round(2 * MARGIN + scale * (high[k] - low[k])) for k in (0, 1))
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    picture = [head, f'<rect width="{width}" height="{height}" fill="#ffffff"/>', *parts, "</svg>"]
    (HERE / f"contact_{name}.svg").write_text("\n".join(picture) + "\n")


for name in sys.argv[2:] or SCENES:
    draw(name, SCENES[name])
