"""Errors of histories, reckoned apart from beamsim's own: of each column the largest difference at a shared row, over the largest value of its kind."""

import csv
import json
import math
import re
from pathlib import Path

SAME = 1e-9


def history(folder):
    """The names of the columns of a run, and its rows."""
    with open(Path(folder) / "history.csv", newline="") as file:
        names, *rows = csv.reader(file)
    return names, [[float(cell) for cell in row] for row in rows]


def modes(folder):
    """Frequencies, growths and critical loads by name."""
    found = {}
    for path in (Path(folder) / "modes.csv", Path(folder) / "buckling.csv"):
        if path.exists():
            with open(path, newline="") as file:
                for stage, number, *values in csv.reader(list(file)[1:]):
                    for quantity, value in zip(("omega", "growth") if path.stem == "modes" else ("load",), values):
                        found[f"stage{stage}.{path.stem}{number}.{quantity}"] = float(value)
    return found


def kind(column):
    """What a column shows: its quantity without node and direction."""
    if column.startswith("energy."):
        return "energy"
    if column.startswith("stage"):
        return "mode." + column.rsplit(".", 1)[1]
    return re.sub(r"[xyz\d]+$", "", column.rsplit(".", 1)[-1])


def rotations(names):
    """First columns of rotation vectors."""
    return [k for k in range(len(names) - 2) if [n.rsplit(".", 1)[-1] for n in names[k:k + 3]] == ["rx", "ry", "rz"]]


def nearest(row, to, firsts):
    """A rotation vector of up to 2 pi has another that means the same: takes those that are nearer."""
    row = list(row)
    for k in firsts:
        vector = row[k:k + 3]
        angle = math.hypot(*vector)
        if angle:
            other = [x * (1 - math.tau / angle) for x in vector]
            if math.dist(other, to[k:k + 3]) < math.dist(vector, to[k:k + 3]):
                row[k:k + 3] = other
    return row


def paired(names, rows, other_names, other_rows):
    """Rows of both histories at the same stage and clock, and the last ones."""
    time, load = names.index("time"), names.index("load")
    there = {}
    for row in other_rows:
        there.setdefault(key(row[0], row[time], row[load]), row)
    for row in rows[:-1]:
        hit = there.get(key(row[0], row[time], row[load]))
        if hit is not None:
            yield row, hit
    yield rows[-1], other_rows[-1]


def key(stage, time, load):
    return stage, f"{time:.9e}", f"{load:.9e}"


def errors(run, reference):
    """The error of each column of a run's folder, over the largest value of its kind in the reference; columns that are always zero have none."""
    names, rows = history(run)
    other_names, other_rows = history(reference)
    columns = [name for name in names[3:] if not name.endswith(".err")]
    order = [other_names.index(name) for name in columns]
    firsts = rotations(columns)
    largest, differences = {}, dict.fromkeys(columns, 0.0)
    for row, other in paired(names, rows, other_names, other_rows):
        to = [other[k] for k in order]
        own = nearest(row[3:3 + len(columns)], to, firsts)
        for column, a, b in zip(columns, own, to):
            largest[kind(column)] = max(largest.get(kind(column), 0.0), abs(b))
            differences[column] = max(differences[column], abs(a - b))
    there = modes(reference)
    for name, value in modes(run).items():
        if name in there:
            largest[kind(name)] = max(largest.get(kind(name), 0.0), abs(there[name]))
            differences[name] = abs(value - there[name])
    floors = floor(largest)
    scale = lambda column: max(largest[kind(column)], floors.get(kind(column), 0.0))
    return {column: difference / scale(column) for column, difference in differences.items() if scale(column)}


def floor(largest):
    """Round-off of a scene that stays at rest in some kind is no error: see `docs/accuracy.md`."""
    pairs = [("f", "m"), ("N", "M"), ("u", "r"), ("v", "w")]
    both = {}
    for one, other in pairs + [(b, a) for a, b in pairs]:
        both[one] = 1e-6 * largest.get(other, 0.0)
    return both


def record(folder):
    return json.loads((Path(folder) / "run.json").read_text())


def bars(run, reference):
    """Of each column that has an error worth the name: its width over the largest true error, and whether it holds that error at all rows."""
    names, rows = history(run)
    other_names, other_rows = history(reference)
    columns = [name for name in names[3:] if not name.endswith(".err")]
    there = [other_names.index(name) for name in columns]
    own_bars = [names.index(f"{name}.err") for name in columns]
    firsts = rotations(columns)
    largest, true, inside = {}, dict.fromkeys(columns, 0.0), dict.fromkeys(columns, True)
    for row, other in paired(names, rows, other_names, other_rows):
        to = [other[k] for k in there]
        own = nearest(row[3:3 + len(columns)], to, firsts)
        for column, a, b, k in zip(columns, own, to, own_bars):
            largest[kind(column)] = max(largest.get(kind(column), 0.0), abs(b))
            true[column] = max(true[column], abs(a - b))
            inside[column] &= abs(a - b) <= row[k]
    floors = floor(largest)
    for column, k in zip(columns, own_bars):
        scale = max(largest[kind(column)], floors.get(kind(column), 0.0))
        # Below that, what finer runs differ in is round-off and what Newton's method leaves.
        if true[column] > 1e-10 * scale:
            bar = rows[-1][k]
            yield {"column": column, "error": true[column] / scale, "width": bar / true[column],
                   "inside": inside[column], "inside_at_the_end": true[column] <= bar}
