"""Runs of beamsim: variants of decks, what they take, and finer runs to hold them against."""

import resource
import statistics
import subprocess
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Seconds after which a run is given up: a reference, and anything else.
LONGEST_REFERENCE = 120
LONGEST = 900


def beamsim(program, *words, longest=LONGEST):
    """Runs it, with its exit status, the last line of its errors, and CPU and wall seconds of the process."""
    status, output, cpu, wall = process(program, *words, longest=longest)
    last = output.stderr.strip().splitlines()[-1:] if output else ["took too long"]
    return status, " ".join(last), cpu, wall


def process(program, *words, longest=LONGEST):
    """Runs it, with its exit status, what it says, and CPU and wall seconds of the process."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    try:
        done = subprocess.run([program, *map(str, words)], cwd=ROOT, capture_output=True, text=True, timeout=longest)
        status, output = done.returncode, done
    except subprocess.TimeoutExpired:
        status, output = None, None
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - start
    return status, output, (after.ru_utime + after.ru_stime) - (before.ru_utime + before.ru_stime), wall


def run(program, deck, settings, out, *words, longest=LONGEST):
    """Runs a variant of a deck into `out`."""
    chosen = [word for setting in settings for word in ("--set", setting)]
    return beamsim(program, "run", deck, *chosen, "--out", out, *words, longest=longest)


def seconds(program, deck, variants, out, repeats):
    """CPU seconds of the processes of variants that take turns: medians."""
    def cpu(settings):
        status, last, seconds_taken, _ = run(program, deck, settings, out)
        if status != 0:
            raise SystemExit(f"{deck} with {settings}: {last}")
        return seconds_taken

    times = [[cpu(settings) for settings in variants] for _ in range(repeats)]
    return [statistics.median(of_one) for of_one in zip(*times)]


def finer(record, settings, elements, steps):
    """Settings that make of a run, which left this record, one with so many times its elements and steps: cubic, with the same names of nodes."""
    words = dict(setting.split("=", 1) for setting in settings)
    table = record["deck"]
    for k, beam in enumerate(table.get("beam", [])):
        own = beam.get("elements", 1)
        counts = [int(count) for count in (own if isinstance(own, list) else [own])]
        if "numbering" not in beam:
            words[f"beam.{k}.numbering"] = listed([count * int(beam.get("order", 1)) for count in counts])
        words[f"beam.{k}.elements"] = listed([count * elements for count in counts])
        words[f"beam.{k}.order"] = "3"
    for k, stage in enumerate(table.get("stage", [])):
        if stage.get("kind") == "dynamic":
            words[f"stage.{k}.step"] = repr(stage["step"] / steps)
            if stage.get("adaptive"):
                words[f"stage.{k}.adaptive"] = "false"
    words["output.every"] = "1"
    return [f"{key}={value}" for key, value in words.items()]


def listed(counts):
    return str(counts[0]) if len(counts) == 1 else str(counts)
