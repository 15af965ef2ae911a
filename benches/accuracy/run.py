#!/usr/bin/env python3
"""Measures what accuracy costs, and whether a wanted accuracy and error bars keep their word, for `docs/accuracy.md`.

    cargo build --release
    python3 benches/accuracy/run.py                 # all of it, about half an hour
    python3 benches/accuracy/run.py --only tables   # the tables of the page from what is stored

What is measured is stored in `docs/accuracy/`: a study of each scene (`.csv`, `.svg`), `targets.csv`, `bars.csv` and `forecasts.csv`.
Errors are held against runs with more elements and shorter steps, by arithmetic of its own (`errors.py`).
"""

import argparse
import csv
import re
import shutil
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True  # no caches beside the scripts

import errors
import page
import scenes
import variants

STORE = variants.ROOT / "docs" / "accuracy"
BUDGET = scenes.BUDGET  # seconds on the wall
# Of the reference of a run, over that run.
ELEMENTS, STEPS = 2, 4
REPEATS = 5
SHORTEST_FORECAST = 0.1  # seconds


def studies(program, work, only):
    """A study of each scene, as `beamsim cost` makes it without options."""
    for name, deck in scenes.STUDIES.items():
        if only and only not in deck:
            continue
        status, last, cpu, wall = variants.beamsim(program, "cost", deck, "--out", work / name)
        print(f"study of {name}: {wall:.1f} s {last}", flush=True)
        if status != 0:
            raise SystemExit(f"{deck}: no study")
        shutil.copy(work / name / "cost.csv", STORE / f"{name}.csv")
        shutil.copy(work / name / "cost.svg", STORE / f"{name}.svg")


def targets(program, work, only):
    """Runs with a wanted accuracy: estimate, true error, and time beside that of the cheapest variant of a study."""
    rows = []
    for deck in scenes.KNOWN:
        if only and only not in deck:
            continue
        study = study_of(program, deck, work)
        for target in scenes.TARGETS:
            row = {"deck": deck, "target": target, **wanted(program, deck, target, study, work)}
            print({key: f"{value:.3g}" if isinstance(value, float) else value for key, value in row.items()}, flush=True)
            rows.append(row)
    return rows


def study_of(program, deck, work):
    """The runs of a study that came to their end, the cheapest first."""
    out = work / "study"
    status, last, _, _ = variants.beamsim(program, "cost", deck, "--out", out)
    if status != 0:
        print(f"{deck}: no study, {last}", flush=True)
        return []
    with open(out / "cost.csv", newline="") as file:
        runs = [run for run in csv.DictReader(file) if run["status"] == "finished"]
    return sorted(runs, key=lambda run: float(run["cpu_seconds"]))


def wanted(program, deck, target, study, work):
    out, finer, cheap = work / "wanted", work / "finer", work / "cheap"
    status, last, search, wall = variants.run(program, deck, [], out, "--accuracy", target, "--budget", BUDGET)
    if status != 0:
        return {"result": last.split(":")[0] or "failed", "search": wall}
    record = errors.record(out)
    found = record["accuracy"]
    estimates = {column: estimate for column, (_, estimate) in found["columns"].items() if estimate is not None}
    row = {"result": "reached", "estimate": max(estimates.values()), "elements": short(found["settings"], "elements"),
           "order": short(found["settings"], "order"), "step": short(found["settings"], "step")}
    status, last, _, _ = variants.run(program, deck, variants.finer(record, found["settings"], ELEMENTS, STEPS), finer, longest=variants.LONGEST_REFERENCE)
    if status == 0:
        row["error"] = max(errors.errors(out, finer).values(), default=0.0)
    else:
        row["reference"] = last
    best = next((run["settings"] for run in study if float(run["error"]) <= target), None)
    if best is not None:
        own, cheapest = variants.seconds(program, deck, [found["settings"], best.split(" ") if best else []], cheap, REPEATS)
        row |= {"seconds": own, "searched": search, "cheapest": cheapest, "cheapest_is": best}
    return row


def short(settings, key):
    return " ".join(dict.fromkeys(s.split("=", 1)[1] for s in settings if s.split("=", 1)[0].endswith("." + key)))


def bars(program, work, only):
    """Error bars of decks as they stand, column by column: how wide they are over the true error, and whether it ever is outside."""
    rows = []
    for deck in scenes.KNOWN:
        if only and only not in deck:
            continue
        out, finer = work / "bars", work / "finer"
        status, last, _, _ = variants.run(program, deck, ["output.every=1"], out, "--error-bars")
        if status != 0:
            print(deck, last, flush=True)
            continue
        status, last, _, _ = variants.run(program, deck, variants.finer(errors.record(out), [], 2 * ELEMENTS, STEPS), finer, longest=variants.LONGEST_REFERENCE)
        if status != 0:
            print(deck, last, flush=True)
            continue
        own = list(errors.bars(out, finer))
        print(deck, " ".join(f"{row['column']}:{row['width']:.2g}{'' if row['inside'] else '!'}" for row in own), flush=True)
        rows += [{"deck": deck, **row} for row in own]
    return rows


def forecasts(program, work, only):
    """How long `check` says that decks will take, and how long they took: those of a tenth of a second and more, but for the runs of minutes."""
    rows = []
    for deck in sorted((variants.ROOT / "decks").rglob("*.toml")):
        if "long" in deck.parts or only and only not in str(deck):
            continue
        deck = str(deck.relative_to(variants.ROOT))
        status, output, _, seconds = variants.process(program, "run", deck, "--out", work / "run")
        if seconds >= SHORTEST_FORECAST and output:
            told = foretold(variants.process(program, "check", deck)[1].stdout)
            print(f"{deck}: {seconds:.2f} s, foretold {told:.2f} s", "" if status == 0 else f"(exit {status})", flush=True)
            rows.append({"deck": deck, "status": status, "seconds": seconds, "foretold": told})
    return rows


def foretold(text):
    """Seconds in `run: about 3.2 s on this machine`."""
    number, unit = re.search(r"^run: about (\S+) (\w+)", text, re.M).groups()
    return float(number) * {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}[unit]


def store(name, rows):
    """Writes a table; columns in the order in which they were met."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    with open(STORE / name, "w", newline="") as file:
        writer = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows)


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--program", default=str(variants.ROOT / "target" / "release" / "beamsim"))
    words.add_argument("--only", choices=["studies", "targets", "bars", "forecasts", "tables"])
    words.add_argument("--scene", help="only decks whose path has this in it; nothing is stored")
    given = words.parse_args()
    STORE.mkdir(exist_ok=True)
    chosen = lambda part: given.only in (None, part)
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        if chosen("studies"):
            studies(given.program, work, given.scene)
        for part, measure in (("targets", targets), ("bars", bars), ("forecasts", forecasts)):
            if chosen(part):
                rows = measure(given.program, work, given.scene)
                if not given.scene:
                    store(f"{part}.csv", rows)
    if not given.scene:
        page.write(STORE, [STORE.parent / "accuracy.md", STORE / "measurements.md"])


main()
