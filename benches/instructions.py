#!/usr/bin/env python3
"""Counts instructions with valgrind's callgrind, which no other work on the machine disturbs.

    benches/instructions.py [--beamsim PATH] [--bless]

Each scene is a chain of 60 elements, run over few and over many steps; the difference, over elements and iterations, is what an element
costs in an iteration, without the start of the program. The allocator's own instructions are left out: how long it searches its lists
depends on the lengths of paths and of the deck, by up to 1 % of a run. It may exceed what benches/instructions.csv holds by 5 %
(compilers differ); `--bless` records new numbers. Scenes that differ only by tables without effect must cost the same to 0.1 %, copies left
out, too: what is absent costs nothing; contacts out of reach may cost 1 %. Where valgrind is not installed, that is said, and nothing
fails.
Exit status: 0 fine or skipped, 1 something costs more than it should, 2 a run failed.
"""

import argparse
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
RECORD = ROOT / "benches" / "instructions.csv"
ELEMENTS = 60
# Steps of the short run, so many that none is cut back, of the long run, and of the long one where costs are compared to 0.1 %: a run's own
# instructions vary by some 1,600, mostly with the digits of the seconds that it writes, which is 0.1 % of eight steps.
FEW, MANY, MANY_TO_COMPARE = 4, 8, 32
# A compiler's whims, scenes that must cost the same, and contacts out of reach.
TOLERANCE, SAME, NEARLY_SAME = 0.05, 1e-3, 1e-2
# Instructions of a function in callgrind_annotate's list, and the functions of the allocator.
LISTED = re.compile(r"^\s*([\d,]+) \(\s*[\d.]+%\)\s+\S*?:(.*)$", re.MULTILINE)
ALLOCATOR = re.compile(r"malloc|calloc|realloc|memalign|_int_free|free\b|unlink_chunk|alloc_perturb|systrim|tcache|morecore")
# Valgrind counts `rep stosb` and `rep movsb` once a byte, whether glibc takes them depends on how much is cleared or copied at once, and
# whether a compiler calls glibc at all on its whims: of 2,900 static planar ones `memset` rose from 115 to 270 so, at equal work. Loops of
# vectors are counted instead.
NO_REPEATED_BYTES = {"GLIBC_TUNABLES": f"glibc.cpu.x86_rep_stosb_threshold={2**40}:glibc.cpu.x86_rep_movsb_threshold={2**40}"}
# Copies of the same bytes take more or fewer instructions by how they are aligned: seven of 6,900 have been seen.
ALLOCATOR_AND_COPIES = re.compile(f"{ALLOCATOR.pattern}|__mem(?:cpy|move|set)_")

BASE = """
[point]
root = [0, 0, 0]
tip = [10, 0, 0]
[section.s]
EA = 1e4
GA = 1e4
GJ = 1e3
EI = 1e3
rhoA = {rhoA}
rhoJ = {rhoJ}
[[beam]]
name = "b"
section = "s"
through = ["root", "tip"]
elements = {elements}
interpolation = "{interpolation}"
order = {order}
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, 0, {force}]
[effects]
planar = {planar}
{rest}
[output]
nodes = ["tip"]
every = 1000
"""
STATIC = '[[stage]]\nkind = "static"\nsteps = {steps}\n'
DYNAMIC = '[[stage]]\nkind = "dynamic"\nend = {steps}e-2\nstep = 1e-2\n'


def scene(dynamic=False, top="", rest="", tables="", **changes):
    """The text of a deck but for its number of steps."""
    values = {"rhoA": 1, "rhoJ": "[0, 0, 0]", "elements": ELEMENTS, "interpolation": "relative", "order": 1}
    values |= {"planar": "false", "force": 5 if dynamic else 50} | changes
    return top + BASE.format(rest=rest, **values) + tables + (DYNAMIC if dynamic else STATIC)


ROTARY = {"dynamic": True, "rhoJ": "[2, 1, 1]"}
GRAVITY = "gravity = [0, 0, -9.81]\n"
SCENES = {
    "static, relative": scene(),
    "static, total": scene(interpolation="total"),
    "static, order 3": scene(order=3),
    "static, planar": scene(planar="true"),
    "static, gravity": scene(top=GRAVITY),
    "dynamic, relative": scene(dynamic=True),
    "dynamic, planar": scene(dynamic=True, planar="true"),
    "dynamic, rotary inertia": scene(**ROTARY),
    "dynamic, mass damping": scene(**ROTARY, tables="[damping]\nmass = 0.1\n"),
    "dynamic, strain-rate damping": scene(**ROTARY, tables="[damping]\nstiffness = 1e-3\n"),
}
# Surfaces that nothing can reach.
FAR_PLANE = '[[surface]]\nname = "floor"\nkind = "plane"\npoint = [0, 0, -50]\nnormal = [0, 0, 1]\n'
FAR_SPHERE = '[[surface]]\nname = "floor"\nkind = "sphere"\nat = [5, 0, -50]\nradius = 3\n'
CONTACT = '[[contact]]\nname = "c"\nbeams = ["b"]\nsurfaces = ["floor"]\nradius = 0.01\n'
# Pairs that must cost nearly the same.
FAR = {
    "plane, static": (scene(), scene(tables=FAR_PLANE + CONTACT)),
    "sphere, static": (scene(), scene(tables=FAR_SPHERE + CONTACT)),
    "plane, dynamic": (scene(dynamic=True), scene(dynamic=True, tables=FAR_PLANE + CONTACT)),
    "sphere, dynamic planar": (scene(dynamic=True, planar="true"), scene(dynamic=True, planar="true", tables=FAR_SPHERE + CONTACT)),
}
# Pairs that must cost the same.
ABSENT = {
    "mass in statics": (scene(), scene(rhoA=0)),
    "rotary inertia in statics": (scene(), scene(rhoJ="[2, 1, 1]")),
    "gravity switched off": (scene(), scene(top=GRAVITY, rest="gravity = false")),
    "gravity of zero": (scene(), scene(top="gravity = [0, 0, 0]\n")),
    "damping of zero": (scene(dynamic=True), scene(dynamic=True, tables="[damping]\nmass = 0\nstiffness = 0\n")),
    "rotary inertia switched off": (scene(dynamic=True), scene(**ROTARY, rest="rotary_inertia = false")),
}


# What valgrind says of an instruction that it cannot count: which of several encodings a compiler takes changes from build to build.
UNKNOWN = "unhandled instruction bytes"


class UnknownInstruction(Exception):
    """Valgrind knows less than the machine."""


class Bench:
    """A program to count, and a folder to count in."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def run(self, text, steps, left_out):
        """Instructions outside the functions that are left out, and iterations, of a run."""
        # One for each run: the results of an earlier one would be read, to tell whose they are.
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        deck, out, counts = (folder / name for name in ("deck.toml", "out", "counts"))
        deck.write_text(text.format(steps=steps))
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}"]
        command += [str(self.program), "run", str(deck), "--out", str(out)]
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ | NO_REPEATED_BYTES)
        if UNKNOWN in done.stderr:
            raise UnknownInstruction
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}\n{done.stderr}\n{deck.read_text()}")
        report = json.loads((out / "run.json").read_text())
        return own_instructions(counts, left_out), report["counters"]["iterations"]

    def costs(self, texts, most=MANY, left_out=ALLOCATOR):
        """Instructions for an element and an iteration of each scene; as many are run at once as there are cores."""
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            return list(threads.map(lambda text: self.cost(text, most, left_out), texts))

    def cost(self, text, most, left_out):
        """Instructions for an element and an iteration; the long run has `most` steps."""
        (few, at_few), (many, at_many) = (self.run(text, steps, left_out) for steps in (FEW, most))
        return (many - few) / (at_many - at_few) / ELEMENTS


def own_instructions(counts, left_out):
    """The instructions in a file of callgrind's, but for those of functions that are left out."""
    command = ["callgrind_annotate", "--threshold=100", "--auto=no", str(counts)]
    listing = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    listed = [(int(count.replace(",", "")), function) for count, function in LISTED.findall(listing)]
    if not listed:
        raise RuntimeError(f"{' '.join(command)} lists nothing:\n{listing}")
    return sum(count for count, function in listed if not left_out.search(function))


def recorded():
    """The costs that are held, by scene."""
    if not RECORD.exists():
        return {}
    with RECORD.open(newline="") as file:
        return {row["scene"]: float(row["instructions"]) for row in csv.DictReader(file)}


def record(costs):
    """Holds these costs from now on."""
    with RECORD.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["scene", "instructions"])
        writer.writerows((name, f"{cost:.0f}") for name, cost in costs.items())


def present(bench, bless):
    """Whether what is there costs no more than it did."""
    before, costs = recorded(), dict(zip(SCENES, bench.costs(SCENES.values())))
    if bless:
        record(costs)
        before = recorded()
    fine = True
    for name, cost in costs.items():
        known = before.get(name)
        holds = known is not None and cost <= known * (1 + TOLERANCE)
        fine &= holds
        print(f"{'ok ' if holds else 'X  '} {name:<30} {cost:8.0f} instructions an element and iteration, held {known}")
    return fine


def compared(bench, what, pairs, most):
    """Whether the second scene of each pair costs no more than the first, but for the part `most` of it."""
    fine = True
    costs = iter(bench.costs([text for pair in pairs.values() for text in pair], MANY_TO_COMPARE, ALLOCATOR_AND_COPIES))
    for name, without, inert in zip(pairs, costs, costs):
        holds = inert - without <= most * without
        fine &= holds
        print(f"{'ok ' if holds else 'X  '} {what}: {name:<28} {inert:8.0f} instead of {without:.0f}")
    return fine


def why_not():
    """Why nothing can be counted here, if so."""
    if not shutil.which("valgrind"):
        return "valgrind is not installed"
    flags = Path("/proc/cpuinfo")
    if not (flags.exists() and "avx2" in flags.read_text()):
        return "the machine has no AVX2, for which the recorded numbers are"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--beamsim", type=Path, default=TARGET / "release" / "beamsim")
    parser.add_argument("--bless", action="store_true")
    arguments = parser.parse_args()
    if reason := why_not():
        print(f"instruction counts: skipped, {reason}")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(arguments.beamsim, Path(folder))
        try:
            fine = [
                present(bench, arguments.bless),
                compared(bench, "absent", ABSENT, SAME),
                compared(bench, "out of reach", FAR, NEARLY_SAME),
            ]
        except UnknownInstruction:
            print("instruction counts: skipped from here on, this valgrind does not know an instruction of this build")
            return 0
        except (RuntimeError, OSError, subprocess.CalledProcessError) as error:
            print(error, file=sys.stderr)
            return 2
    return 0 if all(fine) else 1


if __name__ == "__main__":
    sys.exit(main())
