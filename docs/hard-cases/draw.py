#!/usr/bin/env python3
"""Draws the pictures of docs/hard-cases.md: runs decks of decks/hard and plots their histories as SVG beside this file.

    python3 docs/hard-cases/draw.py target/release/beamsim [NAME...]

Only the standard library is needed. Without names all pictures are drawn; it takes about a minute.
"""

import csv
import json
import math
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
DECKS = os.path.join(HERE, "..", "..", "decks", "hard")
BLUE, RED, GREEN, ORANGE, GREY, DARK = "#2166ac", "#b2182b", "#1b7837", "#d9730d", "#999999", "#333333"


# ---------------------------------------------------------------- runs

class Answer:
    """The history of a run, and how it ended."""

    def __init__(self, folder):
        with open(os.path.join(folder, "run.json")) as file:
            self.json = json.load(file)
        self.status = self.json["status"]
        name = "history.csv" if self.status == "finished" else "history.partial.csv"
        with open(os.path.join(folder, name)) as file:
            rows = list(csv.reader(file))
        self.columns = {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}
        # Where a run that failed was lost: the failure tells it, or else the last row does.
        self.end = (self.json.get("failure") or {}).get("time") or self["time"][-1]

    def __getitem__(self, name):
        return self.columns[name]

    def rows_of(self, stage):
        return [i for i, number in enumerate(self["stage"]) if number == stage]


def run(deck, *settings):
    """Runs a deck with `KEY=VALUE` settings; None where it is refused before it has reached anything."""
    with tempfile.TemporaryDirectory() as folder:
        command = [BEAMSIM, "run", os.path.join(DECKS, deck + ".toml"), "--out", folder]
        for setting in settings:
            command += ["--set", setting]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if not os.path.exists(os.path.join(folder, "run.json")):
            sys.exit(f"{deck}: {done.stderr}")
        answer = Answer(folder)
        answer.told = done.stderr
        print(f"  {deck} {' '.join(s for s in settings if len(s) < 60)}: {answer.status}")
        return answer


# ---------------------------------------------------------------- drawing

class Picture:
    def __init__(self, width, height):
        self.size = (width, height)
        self.parts = []

    def add(self, part):
        self.parts.append(part)

    def text(self, x, y, text, anchor="start", size=11, color=DARK, turn=None, bold=False):
        turned = f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else ""
        weight = ' font-weight="bold"' if bold else ""
        text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        self.add(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{color}" text-anchor="{anchor}"{weight}{turned}>{text}</text>')

    def line(self, points, color, width=1.4, dash=None, closed=False):
        steps = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        kind = "polygon" if closed else "polyline"
        self.add(f'<{kind} points="{steps}" fill="none" stroke="{color}" stroke-width="{width}" stroke-linejoin="round"{dashed}/>')

    def dot(self, x, y, color, radius=2.6, hollow=False):
        fill = "white" if hollow else color
        self.add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{fill}" stroke="{color}" stroke-width="1.2"/>')

    def cross(self, x, y, color, r=4.5):
        self.add(f'<path d="M{x - r:.1f},{y - r:.1f} L{x + r:.1f},{y + r:.1f} M{x - r:.1f},{y + r:.1f} L{x + r:.1f},{y - r:.1f}" '
                 f'stroke="{color}" stroke-width="2.2"/>')

    def save(self, name):
        width, height = self.size
        head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
                f'font-family="Helvetica, Arial, sans-serif">\n<rect width="{width}" height="{height}" fill="white"/>\n')
        path = os.path.join(HERE, name + ".svg")
        with open(path, "w") as file:
            file.write(head + "\n".join(self.parts) + "\n</svg>\n")
        print(f"{name}.svg: {os.path.getsize(path)} bytes")


def ticks_of(low, high, count):
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    ticks = [0.0 if i == 0 else i * step for i in range(first, int(high / step + 1e-9) + 1)]
    return [(tick, f"{tick:.10g}".replace("-", "−")) for tick in ticks]


def decades_of(low, high, every):
    return [(10.0 ** i, f"1e{i}") for i in range(round(low), round(high) + 1) if i % every == 0]


class Plot:
    """Axes within a picture. Logarithmic axes take the exponents of ten as limits."""

    def __init__(self, picture, box, x, y, xlabel, ylabel, title=None, xlog=0, ylog=0, xticks=None, count=(6, 5)):
        self.picture, self.box, self.x, self.y, self.xlog, self.ylog = picture, box, x, y, xlog, ylog
        left, top, width, height = box
        xticks = xticks or (decades_of(*x, xlog) if xlog else ticks_of(*x, count[0]))
        yticks = decades_of(*y, ylog) if ylog else ticks_of(*y, count[1])
        for value, label in xticks:
            at = self.at(value, self.back(y[0], ylog))[0]
            picture.line([(at, top), (at, top + height)], "#e6e6e6", 0.8)
            picture.text(at, top + height + 14, label, "middle", 10)
        for value, label in yticks:
            at = self.at(self.back(x[0], xlog), value)[1]
            picture.line([(left, at), (left + width, at)], "#e6e6e6", 0.8)
            picture.text(left - 5, at + 3.5, label, "end", 10)
        picture.line([(left, top), (left + width, top), (left + width, top + height), (left, top + height)], "#888888", 0.8, closed=True)
        picture.text(left + width / 2, top + height + 30, xlabel, "middle")
        picture.text(left - 42, top + height / 2, ylabel, "middle", turn=-90)
        if title:
            picture.text(left, top - 7, title, size=12, bold=True)

    @staticmethod
    def back(value, log):
        return 10.0 ** value if log else value

    def at(self, x, y):
        left, top, width, height = self.box
        x = math.log10(x) if self.xlog else x
        y = math.log10(max(y, 1e-300)) if self.ylog else y
        return (left + width * (x - self.x[0]) / (self.x[1] - self.x[0]), top + height * (self.y[1] - y) / (self.y[1] - self.y[0]))

    def clipped(self, x, y):
        left, top, width, height = self.box
        u, v = self.at(x, y)
        return u, min(max(v, top), top + height)

    def line(self, xs, ys, color, width=1.4, dash=None):
        points, last = [], None
        for x, y in zip(xs, ys):
            point = self.clipped(x, y)
            if last is None or math.hypot(point[0] - last[0], point[1] - last[1]) > 0.7:
                points.append(point)
                last = point
        self.picture.line(points, color, width, dash)

    def envelope(self, xs, ys, color, width=1.2):
        """Lowest and highest value in each column of pixels, for long histories."""
        columns = {}
        for x, y in zip(xs, ys):
            u, v = self.clipped(x, y)
            columns.setdefault(round(u), []).append(v)
        points = []
        for u, values in sorted(columns.items()):
            points += [(u, values[0])] + ([(u, min(values)), (u, max(values))] if max(values) - min(values) > 0.4 else [])
        self.picture.line(points, color, width)

    def dots(self, xs, ys, color, radius=2.6, hollow=False):
        for x, y in zip(xs, ys):
            self.picture.dot(*self.at(x, y), color, radius, hollow)

    def cross(self, x, y, color):
        self.picture.cross(*self.clipped(x, y), color)

    def legend(self, x, y, entries):
        """Entries of (text, color, 'line', 'dash', 'dot' or 'cross')."""
        for i, (text, color, kind) in enumerate(entries):
            at = y + 15 * i
            if kind in ("line", "dash"):
                self.picture.line([(x, at - 4), (x + 20, at - 4)], color, 1.8, "4 3" if kind == "dash" else None)
            elif kind == "cross":
                self.picture.cross(x + 10, at - 4, color)
            else:
                self.picture.dot(x + 10, at - 4, color, hollow=kind == "hollow")
            self.picture.text(x + 26, at, text, size=10)


# ---------------------------------------------------------------- R: rotations

def helix():
    exact = [  # load, uz of the end: the continuous beam (shooting, Runge-Kutta, 1600 load levels)
        (0.005, 0.81973), (0.01, 1.56314), (0.02, 2.65583), (0.03, 3.19428), (0.04, 3.23408), (0.05, 2.75074), (0.06, 1.60250),
        (0.07, 0.00390), (0.08, -1.03314), (0.09, -1.30100), (0.1, -1.09173), (0.1125, -0.49135), (0.125, 0.19747),
        (0.1375, 0.71721), (0.15, 0.85905), (0.1625, 0.52168), (0.175, -0.10460), (0.1875, -0.55444), (0.2, -0.59850),
        (0.2125, -0.32664), (0.225, 0.07299), (0.2375, 0.40827), (0.25, 0.52065), (0.2625, 0.33956), (0.275, -0.03139),
        (0.2875, -0.33670), (0.3, -0.39959), (0.3125, -0.23238), (0.3375, 0.29169), (0.3625, 0.25737), (0.3875, -0.23420),
        (0.4125, -0.17450), (0.4375, 0.23218), (0.4625, 0.21194), (0.4875, -0.17375), (0.5125, -0.13496), (0.5375, 0.19719),
        (0.5625, 0.18407), (0.5875, -0.13309), (0.6125, -0.10572), (0.6375, 0.17498), (0.6625, 0.16594), (0.6875, -0.10326),
        (0.7125, -0.08280), (0.7375, 0.16026), (0.7625, 0.15379), (0.7875, -0.07999), (0.8125, -0.06402), (0.8375, 0.15032),
        (0.8625, 0.14556), (0.8875, -0.06100), (0.9125, -0.04810), (0.9375, 0.14361), (0.9625, 0.14005), (0.9875, -0.04493),
        (1, -0.07644)]
    a = run("r01_helix_ten_turns", "stage.0.steps=400", "stage.1.steps=200")
    picture = Picture(720, 300)
    plot = Plot(picture, (62, 26, 640, 226), (0, 1), (-1.5, 3.5), "load factor (1: ten turns)", "uz of the free end, length",
                "R01  A rod of length 10 wound by ten turns, and unwound")
    up, down = a.rows_of(1), a.rows_of(2)
    plot.line([a["load"][i] for i in up], [a["tip.uz"][i] for i in up], BLUE, 1.6)
    plot.line([1 - a["load"][i] for i in down], [a["tip.uz"][i] for i in down], ORANGE, 1.0, "3 3")
    plot.dots([p[0] for p in exact], [p[1] for p in exact], RED, 2.3, True)
    plot.legend(430, 46, [("67 three-node elements, loaded", BLUE, "line"), ("the same, unloaded to nothing", ORANGE, "dash"),
                          ("exact curve of the continuous beam", RED, "hollow")])
    picture.save("helix")


def turns():
    picture = Picture(720, 300)
    plot = Plot(picture, (62, 26, 640, 226), (0, 100), (-16, 0), "turns of the clamp", "change of strain energy, relative",
                "R08  A bent frame whose clamp is turned 100 times: largest change within each turn", ylog=2, count=(10, 5))
    told = []
    for deck, color in (("r08_hundred_turns", BLUE), ("r08_hundred_turns_total", RED)):
        a = run(deck, "output.every=1")
        rows = a.rows_of(2)
        first = a["energy.strain"][rows[0] - 1]
        within, whole = {}, {}
        for i in rows:
            turn = 100 * a["load"][i]
            change = abs(a["energy.strain"][i] / first - 1)
            number = math.ceil(turn - 1e-6)
            within[number] = max(within.get(number, 1e-16), change)
            if abs(turn - round(turn)) < 1e-6:
                whole[number] = max(change, 1e-16)
        numbers = sorted(n for n in within if n > 0)
        if color == BLUE:
            plot.line(numbers, [within[n] for n in numbers], BLUE)
        else:
            plot.line(numbers, [within[n] for n in numbers], RED)
            plot.dots(numbers, [whole[n] for n in numbers], RED, 1.3, True)
        told.append((max(within.values()), max(whole.values())))
    plot.legend(250, 95, [("total rotation vectors, within the turn", RED, "line"), ("total rotation vectors, at whole turns", RED, "hollow"),
                          ("relative interpolation, within the turn", BLUE, "line")])
    print("  within, at whole turns:", told)
    picture.save("turns")


def circles():
    picture = Picture(720, 270)
    e1, e2 = (1 / 3, 2 / 3, 2 / 3), (2 / 3, -2 / 3, 1 / 3)

    def shape(deck, nodes):
        names = ", ".join(f'"{n}"' for n in nodes)
        a = run(deck, f"output.nodes=[{names}]", 'output.columns=["x"]')
        places = [tuple(a[f"{n}.{c}"][-1] for c in "xyz") for n in nodes]
        flat = [(sum(p * e for p, e in zip(place, e1)), sum(p * e for p, e in zip(place, e2))) for place in places]
        return a, flat

    def panel(left, flat, title, below, chord=None, closed=False):
        xs, ys = [p[0] for p in flat], [p[1] for p in flat]
        mx, my = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2
        scale = 165 / max(max(xs) - min(xs), max(ys) - min(ys))
        points = [(left + 110 + scale * (x - mx), 132 - scale * (y - my)) for x, y in flat]
        picture.line(points, BLUE, 1.8)
        for u, v in points:
            picture.dot(u, v, BLUE, 2.2)
        picture.cross(*points[0], RED)
        picture.text(left + 110, 22, title, "middle", 12, bold=True)
        for i, text in enumerate(below):
            picture.text(left + 110, 240 + 14 * i, text, "middle", 10)

    a, flat = shape("r03_half_circle_skew", ["root"] + [f"rod:{i}" for i in range(1, 10)] + ["tip"])
    panel(10, flat, "half a circle", ["ten elements, skew plane:", "the end turns by π exactly"])
    a, flat = shape("r03_two_circles_pentagram", ["root"] + [f"rod:{i}" for i in range(1, 5)] + ["tip"])
    panel(250, flat, "two circles", ["five elements, 144° each:", "the pentagram closes"])
    a, flat = shape("r03_twenty_circles_one_step", ["root"] + [f"rod:{i}" for i in range(1, 400)] + ["tip"])
    panel(490, flat, "twenty circles", ["400 elements in one load step:", "a 20-gon run through twenty times"])
    # The last picture has 401 nodes at twenty places: keep one of each.
    seen, kept = set(), []
    for part in picture.parts:
        if part not in seen or not part.startswith("<circle"):
            kept.append(part)
        seen.add(part)
    picture.parts = kept
    picture.save("circles")


# ---------------------------------------------------------------- L: slenderness

def slender():
    # What a banded Cholesky without refinement, which reports success, leaves as round-off of the same meshes (an independent program)
    cholesky = {10: [(1e1, 2.0e-13), (1e3, 3.3e-9), (1e5, 3.7e-5)], 100: [(1e1, 1.0e-11), (1e3, 3.9e-9), (1e5, 8.2e-4)],
                1000: [(1e1, 1.2e-10), (1e3, 1.9e-5), (1e5, 2.3e-2)]}
    meshes = ((10, "b10", BLUE), (100, "b100", GREEN), (1000, "b1000", ORANGE))
    picture = Picture(720, 300)
    plot = Plot(picture, (62, 26, 430, 226), (1, 7), (-16, 0), "slenderness L/h", "error of the deflection, relative",
                "L01  Cantilevers of two-node elements against the closed form of their mesh", xlog=1, ylog=2)
    found = {n: [] for n, _, _ in meshes}
    refused = []
    for half in range(2, 15):
        slenderness = 10 ** (half / 2)
        a = run("l01_slender_1e3", f"param.slender={slenderness!r}")
        if a.status != "finished":
            refused.append((slenderness, a.status))
            continue
        for n, node, _ in meshes:
            exact = 1e-6 * ((1 - 1 / (4 * n * n)) / 3 + 1 / (5 * slenderness ** 2))
            found[n].append((slenderness, max(abs(a[f"{node}.uz"][-1] / exact - 1), 1e-16), "lost to round-off" in a.told))
    for n, _, color in meshes:
        plot.line([p[0] for p in cholesky[n]], [p[1] for p in cholesky[n]], color, 1.0, "4 3")
        plot.dots([p[0] for p in cholesky[n]], [p[1] for p in cholesky[n]], color, 2.4, True)
        plot.line([p[0] for p in found[n]], [p[1] for p in found[n]], color)
        plot.dots([p[0] for p in found[n]], [p[1] for p in found[n]], color, 1.8)
        for s, e, warned in found[n]:
            if warned:
                plot.cross(s, e, RED)
        print("  ", n, [f"{s:.0e}: {e:.1e}" for s, e, _ in found[n]])
    for s, status in refused:
        x, y = plot.at(s, 1e-8)
        picture.text(x - 5, y, f"{s:.0e}: ".replace("+0", "") + f"ends as {status}", "middle", 10, RED, -90)
    print("  ended early:", refused)
    plot.legend(508, 70, [(f"{n} elements", color, "line") for n, _, color in meshes])
    plot.legend(508, 132, [("a banded Cholesky without", GREY, "hollow"), ("refinement, which reports", "white", "line"),
                           ("success, on these meshes", "white", "line")])
    plot.legend(508, 194, [("warned: round-off has", RED, "cross"), ("taken the digits of this deck", "white", "line")])
    picture.save("slender")


# ---------------------------------------------------------------- S: paths

def lee():
    a = run("s01_lee_plain_static", "stage.0.steps=80")
    exact = [  # -uy, P of the continuous frame (Runge-Kutta shooting)
        (0.000, 0.0000), (2.512, 0.3559), (5.452, 0.6570), (9.195, 0.9191), (13.884, 1.1407), (18.051, 1.2869),
        (23.195, 1.4336), (27.764, 1.5453), (33.044, 1.6587), (39.230, 1.7692), (43.896, 1.8294), (50.148, 1.8528),
        (54.989, 1.7825), (59.142, 1.5730), (61.001, 1.2070), (59.653, 0.8010), (57.008, 0.4642), (53.882, 0.1288),
        (51.412, -0.1986), (51.054, -0.5911), (54.476, -0.8873), (59.927, -0.9341), (64.488, -0.8653), (70.062, -0.7253),
        (74.902, -0.5671), (79.015, -0.3976), (83.068, -0.1717), (86.436, 0.1145), (88.870, 0.4584), (90.531, 0.8557),
        (91.569, 1.2542), (92.275, 1.6530), (92.786, 2.0520)]
    picture = Picture(720, 330)
    plot = Plot(picture, (62, 26, 640, 256), (0, 100), (-1.2, 2.2), "−uy of the loaded point, length", "force P (load factor × 2)",
                "S01  Lee's frame by a plain static stage: `steps = 80`, no method named")
    down = [-v for v in a["loaded.uy"]]
    force = [2 * p for p in a["load"]]
    plot.dots([p[0] for p in exact], [p[1] for p in exact], GREY, 2.2, True)
    # Levels of load control are multiples of 1/80; rows between them are increments along the path.
    plot.line(down, force, BLUE, 1.6)
    along = [i for i, p in enumerate(a["load"]) if abs(80 * p - round(80 * p)) > 1e-6]
    plot.line(down[along[0]:along[-1] + 2], force[along[0]:along[-1] + 2], ORANGE, 2.0)
    for event in a.json["events"]:
        i = min(range(len(force)), key=lambda i: abs(a["load"][i] - event["load"]))
        plot.picture.dot(*plot.at(down[i], force[i]), RED, 3.6)
        u, v = plot.at(down[i], force[i])
        kind = "limit" if "limit" in event["kind"] else "turn"
        dx, dy, anchor = (9, 4, "start") if kind == "turn" else (0, -8 if event["load"] > 0 else 16, "middle")
        picture.text(u + dx, v + dy, f"{kind}: P = {2 * event['load']:.4f}".replace("-", "−"), anchor, 10, RED)
    plot.legend(80, 200, [("levels of load", BLUE, "line"), ("followed by arc length, without being told", ORANGE, "line"),
                          ("limit and turning points, located", RED, "dot"), ("exact path", GREY, "hollow")])
    picture.save("lee")


def hinged_frame():
    limits = [596.94, 208.57, 246.56, -556.91]  # exact, of the continuous leg: the four of one revolution
    a = run("s04_hinged_frame_two_turns")
    rows = a.rows_of(1)
    turn = [a["apex.rx"][i] / (2 * math.pi) for i in rows]
    moment = [1000 * a["load"][i] for i in rows]
    picture = Picture(720, 300)
    plot = Plot(picture, (62, 26, 640, 226), (0, 2), (-700, 1000), "revolutions of the apex about x", "moment at the hinges, force × length",
                "S04  The hinged right-angle frame, two revolutions", count=(8, 6))
    for value in limits:
        plot.line([0, 2], [value, value], RED, 0.8, "2 3")
        x, y = plot.at(0.45 if value < 0 else 0.6, value)
        picture.text(x, y + (11 if value == 208.57 else -4), f"{value}".replace("-", "−"), "start", 10, RED)
    plot.line(turn, moment, BLUE, 1.6)
    for event in a.json["events"]:
        if event["stage"] == 1 and "limit" in event["kind"]:
            found = [i for i in range(len(turn)) if abs(moment[i] - 1000 * event["load"]) < 1e-6]
            for i in found[:2]:
                picture.dot(*plot.at(turn[i], moment[i]), RED, 3.0)
    print("  events:", [(e["kind"], round(1000 * e["load"], 3)) for e in a.json["events"]])
    plot.legend(90, 46, [("path, six four-node elements", BLUE, "line"), ("limit points; dashed: those of the continuous leg", RED, "dot")])
    picture.save("hinged_frame")


def ring():
    nodes = [("lower", i) for i in range(0, 49)] + [("upper", i) for i in range(1, 49)]
    names = ", ".join(f'"{beam}:{i}"' for beam, i in nodes)
    a = run("s08_ring_three_loops", f"output.nodes=[{names}]", 'output.columns=["x"]')
    picture = Picture(720, 200)
    picture.text(20, 19, "S08  A ring whose point b is turned by 2π against the clamped point a", size=12, bold=True)
    loads = [0, 0.25, 0.5, 0.6, 0.7, 1]
    left = 66
    rows = a.rows_of(1)
    for number, load in enumerate(loads):
        i = min(rows, key=lambda i: abs(a["load"][i] - load)) if load else 0
        space = [tuple(a[f"{beam}:{n}.{c}"][i] for c in "xyz") for beam, n in nodes]
        # The middle of a and b in the middle of the panel; the plane x, y is seen from above, tilted
        middle = (space[0][0] + space[48][0]) / 2
        tilt = math.radians(38)
        flat = [((x - middle) + 0.18 * y, -(y * math.cos(tilt) + z * math.sin(tilt))) for x, y, z in space]
        points = [(left + 118 * number + 2.35 * u, 98 + 2.35 * v) for u, v in flat]
        picture.line(points[:49], BLUE, 1.7)
        picture.line(points[48:] + points[:1], ORANGE, 1.7)
        picture.cross(*points[0], RED, 3.4)
        picture.dot(*points[48], DARK, 2.8)
        picture.text(left + 118 * number, 164, {0: "0", 0.5: "π"}.get(load, f"{2 * load:g}π"), "middle", 11)
    picture.text(20, 188, "turn of b about the diameter;   × a, clamped;   ● b, turned;   at the end three circles of a third of the radius, "
                 "strain energy 4π EI/R", size=10)
    picture.save("ring")


# ---------------------------------------------------------------- D: dynamics

def energy():
    picture = Picture(720, 560)
    push = 2.0  # the load is gone
    cases = [("d11_right_angle_newmark_h02", [], RED, "trapezoidal rule, step 0.2 (the paper's)"),
             ("d11_right_angle_t300_newmark", [], GREEN, "trapezoidal rule, step 0.1"),
             ("d11_right_angle_t300", [], BLUE, "generalised-α 0.9, step 0.1"),
             ("d11_right_angle_t300_rho_half", [], ORANGE, "generalised-α 0.5, step 0.1")]
    plot = Plot(picture, (62, 26, 640, 216), (0, 300), (0.8, 1.05), "time", "energy / energy after the push",
                "D11  Right-angle cantilever, pushed until t = 2, then left alone")
    entries = []
    for deck, settings, color, name in cases:
        a = run(deck, *settings, "output.every=1")
        total = [k + s for k, s in zip(a["energy.kinetic"], a["energy.strain"])]
        start = min(range(len(total)), key=lambda i: abs(a["time"][i] - push))
        plot.envelope(a["time"][start:], [e / total[start] for e in total[start:]], color)
        if a.status != "finished":
            plot.cross(a["time"][-1], total[-1] / total[start], color)
            name += f": {a.status} at {a.end:.4g}"
        entries.append((name, color, "line"))
    plot.legend(85, 180, entries)

    cases = [("newmark", "", RED, "trapezoidal rule"), ("hht", "", GREEN, "HHT 0.05"),
             ("generalized_alpha", "rho_inf = 0.9", BLUE, "generalised-α 0.9"), ("generalized_alpha", "rho_inf = 0.5", ORANGE, "generalised-α 0.5")]
    plot = Plot(picture, (62, 306, 640, 206), (0, 25), (0.6, 1.6), "time (a turn takes 2.48)", "energy / energy at the start",
                "D08  Stiff pendulum (EA = 1e10), 25 steps of 0.1 a turn")
    entries = []
    for scheme, setting, color, name in cases:
        a = run_scheme("d08_stiff_pendulum_h01", scheme, setting, ["output.every=1"])
        rows = a.rows_of(2)
        total = [a["energy.kinetic"][i] + a["energy.strain"][i] for i in rows]
        time = [a["time"][i] for i in rows]
        ratio = [e / total[0] for e in total]
        beyond = next((i for i, r in enumerate(ratio) if r > 1.6), len(ratio))
        beyond = min(beyond, sum(1 for t in time if t <= 25) - 1)
        plot.line(time[:beyond + 1], ratio[:beyond + 1], color, 1.2)
        if a.status != "finished":
            plot.cross(time[beyond], ratio[beyond], color)
            name += f": ends at t = {a.end:.3g}"
        else:
            name += f": goes on to t = {time[-1]:.3g}"
        entries.append((name, color, "line"))
    plot.legend(430, 326, entries)
    picture.save("energy")


def run_scheme(deck, scheme, setting, settings):
    """The deck names generalised-alpha and rho_inf; other schemes have no such key, so that the deck is written anew without it."""
    with open(os.path.join(DECKS, deck + ".toml")) as file:
        text = file.read()
    lines = []
    for line in text.split("\n"):
        if line.startswith("scheme ="):
            line = f'scheme = "{scheme}"'
        elif line.startswith("rho_inf ="):
            line = setting
        lines.append(line)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, f"{deck}_{scheme}")
        with open(path + ".toml", "w") as file:
            file.write("\n".join(lines))
        return run(path, *settings)


def top():
    picture = Picture(720, 300)
    plot = Plot(picture, (62, 26, 640, 226), (0, 20), (0, 0.8), "time", "lean of the axis, rad",
                "D03  A top that stands upright sleeps if its spin is above 20")
    for deck, spin, color in (("d03_sleeping_top_unstable", 19, RED), ("d03_sleeping_top_stable", 21, BLUE)):
        a = run(deck, "output.every=40")
        lean = [math.atan2(math.hypot(x, y), z) for x, y, z in zip(a["momentum.cx"], a["momentum.cy"], a["momentum.cz"])]
        plot.line(a["time"], lean, color)
        rate = (spin / 20) ** 2 * 2  # J3^2 W^2/(2 J1 m g l)
        start = math.cos(0.01)
        largest = math.acos((rate - math.sqrt(rate * rate - 4 * (rate * start - 1))) / 2)
        plot.line([0, 20], [largest, largest], color, 0.9, "3 3")
        print(f"  spin {spin}: largest lean {max(lean):.6f}, closed form {largest:.6f}")
    plot.legend(400, 105, [("spin 19", RED, "line"), ("spin 21", BLUE, "line"), ("largest lean, closed form", GREY, "dash")])
    picture.save("top")


# ----------------------------------------------------------------

PICTURES = {f.__name__: f for f in (helix, turns, circles, slender, lee, hinged_frame, ring, energy, top)}

if __name__ == "__main__":
    if len(sys.argv) < 2 or any(name not in PICTURES for name in sys.argv[2:]):
        sys.exit(f"usage: draw.py BEAMSIM [{'|'.join(PICTURES)}]...")
    BEAMSIM = os.path.abspath(sys.argv[1])
    for name in sys.argv[2:] or PICTURES:
        PICTURES[name]()
