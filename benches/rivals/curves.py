#!/usr/bin/env python3
"""Error over time of beamsim and other programs in the same scenes: each over a grid of elements and steps, of which the frontier counts.

    cargo build --release
    python3 benches/rivals/curves.py --out docs/accuracy    # some twenty minutes; writes rivals.csv and a plot of each scene
    python3 benches/rivals/curves.py --out docs/accuracy --only plots

Programs are installed as for `run.py`, and matplotlib likewise. Errors are those of `run.py` over a length of the scene. CPU seconds are those
of the whole process for beamsim and of the call that solves for the others; load levels are those, of a few, that take the least time.
"""

import argparse
import csv
import itertools
import math
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True  # no caches beside the scripts

import run
import scenes

run.PEERS["plot"] = ("", ["matplotlib==3.11.2"], "matplotlib")

# What errors are told over: the length of the beam, what its tip moves, the width of the swing, the way that it flies.
LENGTHS = {"S1": 10.0, "S2": 53.5, "S3": 10.0, "S5": 60.0}
TITLES = {"S1": "S1: roll-up to a full circle, in space", "S2": "S2: 45-degree bend", "S3": "S3: right-angle cantilever, t = 30",
          "S5": "S5: beam in free flight, t = 15"}
LEVELS = [1, 3, 10]
# A run that takes longer ends a family's walk to finer grids.
LONGEST = 60.0
REPEATED_BELOW = 1.0

FAMILIES = {
    "beamsim, order 1": {"program": "beamsim", "order": 1},
    "beamsim, order 2": {"program": "beamsim", "order": 2},
    "beamsim, order 3": {"program": "beamsim", "order": 3},
    "Exudyn": {"program": "exudyn", "element": "3d"},
    "OpenSees, ExactFrame": {"program": "opensees", "library": "xara"},
}
EXTRA = {("exudyn", "S1"): {"rotations": "vector"}, ("exudyn", "S3"): {"modified": True}, ("exudyn", "S5"): {"modified": True}}
ABSENT = {("opensees", "S5")}  # not set up there

ELEMENTS = {"S1": {1: [10, 20, 50, 100, 200, 500, 1000, 2000], 2: [4, 8, 16, 32, 64, 128], 3: [2, 4, 8, 16, 32]},
            "S2": {1: [4, 8, 16, 32, 64, 128, 256, 512, 1024], 2: [2, 4, 8, 16, 32, 64], 3: [2, 4, 8, 16]},
            "S3": {1: [8, 16, 32, 64, 128], 2: [4, 8, 16, 32], 3: [4, 8, 16]},
            "S5": {1: [10, 20, 40, 80, 160], 2: [4, 8, 16, 32], 3: [4, 8, 16]}}
STEPS = {"S3": [0.1, 0.05, 0.02, 0.01, 0.005, 0.0025, 0.001], "S5": [0.1, 0.05, 0.02, 0.01, 0.005, 0.0025, 0.001]}
REFERENCE = {"elements": 24, "order": 3}
REFERENCE_STEPS = (0.001, 0.0005)
AGREED = 0.01  # how far apart the other programs' ends of S5 are


def reference(arguments, scene):
    """What errors are held against: histories of S3 and ends of S5 with half the step, extrapolated, after a look at what other programs agree on."""
    if scene not in STEPS:
        return None
    coarse, fine = (run.run_beamsim(arguments.beamsim, {"scene": scene, **REFERENCE, "step": step}, 600.0) for step in REFERENCE_STEPS)
    limit = lambda a, b: b + (b - a) / 3.0
    if scene == "S3":
        run.converged_history(arguments.beamsim, 600.0)
        kept = coarse["history"][1:]
        return [coarse["history"][0]] + [(a[0], *map(limit, a[1:], b[1:])) for a, b in zip(kept, fine["history"][2::2])]
    places = {name: tuple(map(limit, coarse["places"][name], place)) for name, place in fine["places"].items()}
    for name, agreed in scenes.FLYING_ENDS.items():
        if not math.dist(places[name], agreed) < AGREED:
            raise SystemExit(f"the fine run of S5 is off: {name} is {places[name]}, expected {agreed}")
    return places


def error_of(scene, result, known):
    if scene == "S5":
        return run.worst(math.dist(result["places"][name], place) for name, place in known.items())
    return run.error_of(scene, result, known)


def once(arguments, pythons, family, job):
    if family["program"] == "beamsim":
        return run.run_beamsim(arguments.beamsim, job, LONGEST)
    return run.run_peer(pythons[family["program"]], run.PEERS[family["program"]][0], job, LONGEST)


def measured(arguments, pythons, family, job, known):
    """Error and time of one setting; `None` where it fails."""
    try:
        first = once(arguments, pythons, family, job)
        times = [first["cpu"]]
        while len(times) < 5 and first["cpu"] < REPEATED_BELOW:
            times.append(once(arguments, pythons, family, job)["cpu"])
        return error_of(job["scene"], first, known) / LENGTHS[job["scene"]], statistics.median(times)
    except run.Failed as failure:
        run.progress(f"{job}: {failure}")
        return None


def jobs(scene, family):
    """Settings of a family in a scene, the cheapest first."""
    own = {key: value for key, value in family.items() if key != "program"} | EXTRA.get((family["program"], scene), {})
    elements = ELEMENTS[scene][family.get("order", 1)]
    if scene in STEPS:
        grid = sorted(itertools.product(elements, STEPS[scene]), key=lambda pair: pair[0] / pair[1])
        return [{"scene": scene, "elements": count, "step": step, **own} for count, step in grid]
    return [{"scene": scene, "elements": count, "levels": levels, **own} for count in elements for levels in LEVELS]


def walk(arguments, pythons, scene, name, known):
    """All runs of a family in a scene, but those that would take too long."""
    family = FAMILIES[name]
    pace = 0.0  # seconds an element and step
    for job in jobs(scene, family):
        work = job["elements"] / job.get("step", 1.0)
        if pace * work > LONGEST:
            break
        came = measured(arguments, pythons, family, job, known)
        if came:
            error, cpu = came
            pace = cpu / work if scene in STEPS else pace
            yield {"scene": scene, "program": name, "elements": job["elements"], "levels": job.get("levels", ""), "step": job.get("step", ""), "error": f"{error:.4g}", "cpu": f"{cpu:.4g}"}


def store(path, scene, rows):
    """Replaces the rows of a scene, and keeps those of the others."""
    kept = []
    if path.exists():
        with open(path, newline="") as file:
            kept = [row for row in csv.DictReader(file) if row["scene"] != scene]
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(sorted(kept + rows, key=lambda row: row["scene"]))


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--beamsim", type=Path, default=run.HERE.parents[1] / "target" / "release" / "beamsim")
    words.add_argument("--venvs", type=Path, default=Path(tempfile.gettempdir()) / "beamsim-rivals")
    words.add_argument("--scenes", type=run.chosen(list(LENGTHS)), default=list(LENGTHS))
    words.add_argument("--out", type=Path, required=True)
    words.add_argument("--only", choices=["plots"])
    given = words.parse_args()
    pythons = run.prepare(["exudyn", "opensees", "plot"], given.venvs)
    for failure in (python for python in pythons.values() if isinstance(python, run.Failed)):
        raise SystemExit(str(failure))
    path = given.out / "rivals.csv"
    for scene in given.scenes if given.only != "plots" else []:
        known, rows = reference(given, scene), []
        for name in FAMILIES:
            if (FAMILIES[name]["program"], scene) not in ABSENT:
                rows += walk(given, pythons, scene, name, known)
                run.progress(f"{scene} {name}: {len(rows)} runs in all")
        store(path, scene, rows)
    subprocess.run([pythons["plot"], run.HERE / "plot_curves.py", path, given.out], check=True)


if __name__ == "__main__":
    main()
