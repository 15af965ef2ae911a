#!/usr/bin/env python3
"""Draws the pictures of the tutorial from its own decks, with nothing but Python.

    python3 docs/pictures/draw.py target/release/beamsim

report.png and report-phone.png are screenshots of the report of arm.toml, by a headless browser where one is installed (chromium).
"""

import csv
import math
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
BEAMSIM = Path(sys.argv[1]).resolve()
PALETTE = ["#9ecae1", "#6baed6", "#3182bd", "#08519c"]
GREY, RED, INK = "#888888", "#d55e00", "#444444"


def history(folder, deck, *options):
    out = folder / "out"
    subprocess.run([BEAMSIM, "run", deck, "--out", out, *options], cwd=folder, check=True, capture_output=True)
    with open(out / "history.csv") as file:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]


def curve(points):
    return "M" + " L".join(f"{x:.1f},{y:.1f}" for x, y in points)


def path(points, colour, width, extra=""):
    return f'<path d="{curve(points)}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linecap="round" stroke-linejoin="round" {extra}/>'


def text(x, y, words, colour=INK, anchor="start"):
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}">{words}</text>'


def save(name, width, height, parts):
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="sans-serif" font-size="14">'
    (HERE / name).write_text("\n".join([head, f'<rect width="{width}" height="{height}" fill="#ffffff"/>', *parts, "</svg>"]) + "\n")


def cantilever(folder):
    subprocess.run([BEAMSIM, "new", "cantilever"], cwd=folder, check=True, capture_output=True)
    nodes = [f"arm:{k}" for k in range(17)]
    rows = history(folder, "cantilever.toml", "--set", f"output.nodes={nodes}", "--set", 'output.columns=["x"]')
    at = lambda x, z: (60 + 320 * x, 50 - 320 * z)
    parts = ['<path d="M60,20 V90" stroke="#444444" stroke-width="2"/>']
    parts += [f'<path d="M60,{y} l-12,10" stroke="#444444"/>' for y in range(22, 90, 12)]
    for row in rows:
        load = row["load"]
        points = [at(row[f"{n}.x"], row[f"{n}.z"]) for n in nodes]
        colour = GREY if load == 0 else PALETTE[round(4 * load) - 1]
        parts.append(path(points, colour, 2 if load == 0 else 4, 'stroke-dasharray="6 6"' if load == 0 else ""))
        x, y = points[-1]
        parts.append(text(x + 10, y + 5, "no load" if load == 0 else f"{300 * load:.0f} N"))
    save("cantilever.svg", 780, 230, parts)


def arm(folder, deck):
    (folder / "arm.toml").write_text(deck)
    links = [[f"{beam}:{k}" for k in range(9)] for beam in ("inner", "outer")]
    rows = history(folder, "arm.toml", "--set", f"output.nodes={links[0] + links[1]}", "--set", 'output.columns=["x"]')

    turn, lean = math.radians(-28), math.radians(28)

    def at(row, node):
        x, y, z = (row[f"{node}.{axis}"] for axis in "xyz")
        x, y = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        return x, -(z * math.cos(lean) + y * math.sin(lean))

    shown = [row for k, row in enumerate(rows) if k % 50 == 0]
    every = [at(row, node) for row in rows for link in links for node in link]
    low = [min(p[k] for p in every) for k in (0, 1)]
    high = [max(p[k] for p in every) for k in (0, 1)]
    scale = min(640 / (high[0] - low[0]), 440 / (high[1] - low[1]))
    place = lambda row, node: tuple(40 + scale * (p - l) for p, l in zip(at(row, node), low))
    parts = [path([place(row, "outer:8") for row in rows], RED, 1.5)]
    for k, row in enumerate(shown):
        share = k / (len(shown) - 1)
        colour = "#%02x%02x%02x" % tuple(round(a + share * (b - a)) for a, b in zip((0xC6, 0xDB, 0xEF), (0x08, 0x30, 0x6B)))
        for link in links:
            parts.append(path([place(row, node) for node in link], colour, 4))
        x, y = place(row, "inner:8")
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="#ffffff" stroke="{colour}" stroke-width="2"/>')
        x, y = place(row, "outer:8")
        parts.append(text(x + 8, y + (20 if k == 1 else 4), f"t = {row['time']:g}"))
    x, y = place(rows[0], "inner:0")
    parts.append(text(x - 6, y + 20, "root"))
    save("arm.svg", round(120 + scale * (high[0] - low[0])), round(80 + scale * (high[1] - low[1])), parts)
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser:
        subprocess.run([BEAMSIM, "run", "arm.toml", "--report"], cwd=folder, check=True, capture_output=True)
        page = f"file://{folder}/results/arm/report.html"
        command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=4000"]
        dark = "--blink-settings=preferredColorScheme=0"
        for name, options in [("report", ["--window-size=1280,740"]), ("report-phone", ["--window-size=390,844", dark])]:
            subprocess.run([*command, *options, f"--screenshot={HERE / name}.png", page], check=True, capture_output=True)


def main():
    tutorial = (HERE.parent / "tutorial.md").read_text()
    deck = re.search(r"```toml\n# file: arm.toml\n(.*?)```", tutorial, flags=re.S).group(1)
    with tempfile.TemporaryDirectory() as folder:
        cantilever(Path(folder))
        arm(Path(folder), deck)


main()
