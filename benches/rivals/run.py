#!/usr/bin/env python3
"""Measures beamsim against other programs on the same scenes, all in one run, and writes a Markdown table of ratios.

    cargo build --release
    python3 benches/rivals/run.py --peers exudyn,opensees --scenes S1,S3 --repeat 5 --out rivals.md

Each peer gets a virtual environment of its own under --venvs (pip needs the network the first time; CalculiX must be
on the path). A peer that does not install, or whose run fails or misses the reference, stays in the table and says so.
Within a group the programs take turns, --repeat times, so that a noisy machine hits all alike; the first row of a
group is the yardstick. All run with one thread; a run that fails is not repeated.

CPU seconds are medians: of the whole process for beamsim (reading the deck and writing results included) and CalculiX,
of the call that solves for all others. Ratios are peer / beamsim, above 1 where beamsim is faster. Accuracy comes
first: a run beyond the allowed error gets no CPU ratio. Exit status 1 if beamsim itself misses a reference.
"""

import argparse
import csv
import json
import math
import os
import platform
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

sys.dont_write_bytecode = True  # no caches beside the scripts

import deck
import scenes

HERE = Path(__file__).resolve().parent
ENVIRONMENT = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
ENVIRONMENT["PYTHONDONTWRITEBYTECODE"] = "1"

# For each peer its script, its packages, and the module or command that tells whether it works.
PEERS = {
    "exudyn": ("peer_exudyn.py", ["exudyn==1.13.6", "numpy", "scipy"], "exudyn"),
    "opensees": ("peer_opensees.py", ["xara==0.0.46", "numpy"], "opensees.openseespy"),
    "openseespy": ("peer_opensees.py", ["openseespy==3.7.1.2"], "openseespy.opensees"),
    "kratos": ("peer_kratos.py", [f"Kratos{part}==10.4.4" for part in (
        "Multiphysics", "StructuralMechanicsApplication", "LinearSolversApplication")], "KratosMultiphysics"),
    "mujoco": ("peer_mujoco.py", ["mujoco==4.0.0", "numpy"], "mujoco"),
    "elastica": ("peer_elastica.py", ["pyelastica==1.0.0"], "elastica"),
    "calculix": ("peer_calculix.py", [], "ccx"),
}


def case(program, label, remark="", **settings):
    return {"program": program, "label": label, "remark": remark, "settings": settings}


def group(scene, title, limit, cases, **settings):
    """Cases of one scene with common settings; `limit` is the error that is allowed, a length."""
    for one in cases:
        one["job"] = {"scene": scene, **settings, **one.pop("settings")}
    return {"scene": scene, "title": title, "limit": limit, "cases": cases}


OTHER_INERTIA = "rotary inertia does not turn with the section: compare µs only"
EXPLICIT = "explicit: an iteration is a step"
REST = "steps until it rests"
XARA = {"library": "xara"}
OPENSEESPY = {"library": "openseespy"}
SPACE = {"element": "3d"}
LOOSE = {"rotations": "vector", "tolerance": 1e-4}  # Exudyn does not reach its default tolerance in S4

GROUPS = [
    group("S1", "S1 full circle, in space, 100 elements", 1e-3, [
        case("beamsim", "1 level", levels=1),
        case("beamsim", "total, 1 level", levels=1, interpolation="total"),
        case("opensees", "ExactFrame, 1 level", levels=1, **XARA),
        case("openseespy", "corotational, 40 levels", levels=40, **OPENSEESPY),
        case("exudyn", "3D, 1 level", levels=1, rotations="vector", **SPACE),
        case("kratos", "corotational, 8 levels", levels=8),
        case("calculix", "B31, 20 levels", levels=20, element="B31"),
    ], elements=100),
    group("S1", "S1 full circle, in space, 1000 elements", 1e-5, [
        case("beamsim", "1 level", levels=1),
        case("beamsim", "total, 1 level", levels=1, interpolation="total"),
        case("opensees", "ExactFrame, 1 level", levels=1, **XARA),
        case("openseespy", "corotational, 40 levels", levels=40, **OPENSEESPY),
        case("exudyn", "3D, 1 level", levels=1, rotations="vector", **SPACE),
        case("kratos", "corotational, 8 levels", levels=8),
    ], elements=1000),
    group("S1", "S1 full circle, in the plane, 1000 elements", 1e-5, [
        case("beamsim", "1 level", levels=1, planar=True),
        case("exudyn", "2D, 1 level", levels=1, element="2d"),
    ], elements=1000),
    group("S2", "S2 bend, 64 elements", 5e-3, [
        case("beamsim", "1 level", levels=1),
        case("beamsim", "total, 1 level", levels=1, interpolation="total"),
        case("beamsim", "12 levels", levels=12),
        case("opensees", "ExactFrame, 3 levels", levels=3, **XARA),
        case("openseespy", "corotational, 12 levels", levels=12, **OPENSEESPY),
        case("exudyn", "3D, 12 levels", levels=12, **SPACE),
        case("kratos", "corotational, 2 levels", levels=2),
        case("calculix", "B31, 20 levels", levels=20, element="B31"),
    ], elements=64),
    group("S2", "S2 bend, 512 elements", 1e-4, [
        case("beamsim", "1 level", levels=1),
        case("beamsim", "total, 1 level", levels=1, interpolation="total"),
        case("beamsim", "10 levels", levels=10),
        case("opensees", "ExactFrame, 10 levels", levels=10, **XARA),
    ], elements=512),
    group("S3", "S3 right angle, 20 elements, h = 0.01", 0.15, [
        case("beamsim", ""),
        case("beamsim", "total", interpolation="total"),
        case("beamsim", "tolerance 1e-6", tolerance=1e-6),
        case("exudyn", "3D, modified Newton", modified=True, **SPACE),
        case("exudyn", "3D, modified Newton, tolerance 1e-6", modified=True, tolerance=1e-6, **SPACE),
        case("exudyn", "3D, full Newton", **SPACE),
        case("opensees", "ExactFrame", OTHER_INERTIA, **XARA),
        case("openseespy", "corotational", OTHER_INERTIA, **OPENSEESPY),
        case("kratos", "corotational", "no rotary inertia"),
        case("mujoco", "rigid links, RK4", EXPLICIT),
        case("elastica", "h = 0.0005", EXPLICIT, step=0.0005),
    ], elements=20, step=0.01),
    group("S3", "S3 right angle, 20 elements, h = 0.05", 0.15, [
        case("beamsim", ""),
        case("beamsim", "total", interpolation="total"),
        case("exudyn", "3D, modified Newton", modified=True, **SPACE),
        case("mujoco", "rigid links, RK4", EXPLICIT),
    ], elements=20, step=0.05),
    *(group("S4", f"S4 chain, in space, {title} elements", 1e-4, [
        case("beamsim", ""),
        case("beamsim", "total", interpolation="total"),
        case("beamsim", "tolerance 1e-4", tolerance=1e-4),
        case("opensees", "ExactFrame", system="ProfileSPD", **XARA),
        case("exudyn", "3D, tolerance 1e-4", **SPACE, **LOOSE),
        case("kratos", "corotational"),
    ], elements=elements, levels=1) for title, elements in [("10 000", 10_000), ("100 000", 100_000)]),
    group("S4", "S4 chain, in the plane, 100 000 elements", 1e-4, [
        case("beamsim", "", planar=True),
        case("beamsim", "tolerance 1e-4", planar=True, tolerance=1e-4),
        case("exudyn", "2D, tolerance 1e-4", element="2d", **LOOSE),
    ], elements=100_000, levels=1),
    group("S5", "S5 flying beam, 20 elements, h = 0.01", 0.05, [
        case("beamsim", ""),
        case("beamsim", "total", interpolation="total"),
        case("exudyn", "3D, modified Newton", modified=True, **SPACE),
        case("exudyn", "3D, full Newton", **SPACE),
        case("mujoco", "rigid links, RK4", EXPLICIT),
        case("elastica", "h = 0.0025", EXPLICIT, step=0.0025),
    ], elements=20, step=0.01),
    group("S6", "S6 beam that sags onto a floor, 50 elements", 1e-4, [
        case("beamsim", "statics, 4 levels", levels=4),
        case("mujoco", "rigid links, damped, implicitfast", REST, step=0.005),
        case("elastica", "100 elements, damped, h = 0.00005", REST, elements=100, step=0.00005),
    ], elements=50),
]


SCENES = sorted({one["scene"] for one in GROUPS})


class Failed(Exception):
    """A program could not be installed, did not finish or did not converge."""


def run_process(command, timeout):
    """Runs a command; returns exit status, what it printed, CPU seconds and peak memory in MB."""
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, env={**os.environ, **ENVIRONMENT},
                                   start_new_session=True)
        late = threading.Event()
        watchdog = threading.Timer(timeout, lambda: (late.set(), os.killpg(process.pid, signal.SIGKILL)))
        watchdog.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except KeyboardInterrupt:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        finally:
            watchdog.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        if late.is_set():
            raise Failed(f"no end after {timeout:g} s")
        output.seek(0)
        return process.returncode, output.read(), usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def cause(text):
    """The line of a program's output that tells best why it failed: the first error, or the last line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()] or ["no message"]
    errors = [line for line in lines if "error: " in line.lower() or line.startswith("error[")]
    return (errors or lines[-1:])[0][:150].replace("|", "/")


def install(peer, venvs):
    """The Python that runs a peer: of its virtual environment, which is made if need be."""
    _, packages, module = PEERS[peer]
    if not packages:
        if not shutil.which(module):
            raise Failed(f"{module} is not on the path")
        return sys.executable
    python = venvs / peer / "bin" / "python"
    stamp = venvs / peer / "packages"
    if not stamp.exists() or stamp.read_text() != " ".join(packages):
        pip = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages]
        for command in ([sys.executable, "-m", "venv", venvs / peer], pip):
            code, text, _, _ = run_process(command, 600)
            if code:
                raise Failed(f"not installed: {cause(text)}")
        stamp.write_text(" ".join(packages))
    code, text, _, _ = run_process([python, "-c", f"import {module}"], 120)
    if code:
        raise Failed(f"does not import: {cause(text)}")
    return str(python)


def prepare(peers, venvs):
    """For each peer the Python that runs it, or why there is none."""
    venvs.mkdir(parents=True, exist_ok=True)
    pythons = {}
    for peer in peers:
        progress(f"preparing {peer}")
        try:
            pythons[peer] = install(peer, venvs.resolve())
        except Failed as failure:
            pythons[peer] = failure
    return pythons


def run_peer(python, script, job, timeout):
    """Runs a peer's script once; returns its report, with the peak memory of the process."""
    code, text, _, peak = run_process([python, HERE / script, json.dumps(job)], timeout)
    lines = [line for line in text.splitlines() if line.startswith("{")]
    if code or not lines:
        raise Failed(f"exit status {code}: {cause(text)}")
    result = {**json.loads(lines[-1]), "peak": peak}
    if not result["ok"]:
        raise Failed(f"not converged, after {result['iterations']} iterations and {result['cpu']:.3g} CPU s")
    return result


def run_beamsim(beamsim, job, timeout):
    """Runs a deck once; returns the same as `run_peer`, and the seconds of run.json."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(deck.deck(job))
        code, text, cpu, peak = run_process([beamsim, "run", path, "--threads", "1", "--out", f"{folder}/out"], timeout)
        if code:
            raise Failed(f"exit status {code}: {cause(text)}")
        run = json.loads((Path(folder) / "out" / "run.json").read_text())
        with open(Path(folder) / "out" / "history.csv", newline="") as file:
            rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    result = {"version": run["version"], "iterations": run["counters"]["iterations"], "cpu": cpu, "peak": peak,
              "seconds": run["seconds"]["total"], "history": [], "places": {}}
    if job["scene"] == "S3":
        result["history"] = [(row["time"], row["elbow.uz"], row["tip.uz"]) for row in rows]
    else:
        for column in (name for name in rows[-1] if name.endswith(".x")):
            node = column[:-2]
            result["places"][node.replace("b@0.5", "middle")] = [rows[-1][f"{node}.{axis}"] for axis in "xyz"]
    return result


def interpolate(rows, t):
    """Row of a history with equal steps at time t, linear between rows."""
    step = (rows[-1][0] - rows[0][0]) / (len(rows) - 1)
    k = min(int(t / step + 1e-9), len(rows) - 2)
    part = (t - rows[k][0]) / step
    return [a + part * (b - a) for a, b in zip(rows[k], rows[k + 1])]


def worst(errors):
    """The largest of some errors; infinite where one is not a number."""
    return max(math.inf if math.isnan(error) else error for error in errors)


def history_error(rows, reference):
    """The larger of the root mean squares of both columns' distances to the reference, at every 0.1."""
    if abs(rows[-1][0] - scenes.END_TIME["S3"]) > 1e-6:
        return math.inf
    times = [0.1 * k for k in range(301)]
    pairs = [(interpolate(rows, t), interpolate(reference, t)) for t in times]
    return worst(math.sqrt(statistics.fmean((a[c] - b[c]) ** 2 for a, b in pairs)) for c in (1, 2))


def converged_history(beamsim, timeout):
    """The reference of S3: a fine run of beamsim, held against values that independent programs agree on."""
    rows = run_beamsim(beamsim, {"scene": "S3", "elements": 20, "order": 3, "step": 0.005}, timeout)["history"]
    _, elbow, tip = zip(*rows)
    came = {"elbow max": max(elbow), "tip min": min(tip), "tip max": max(tip),
            "elbow end": elbow[-1], "tip end": tip[-1]}
    for name, value in scenes.RIGHT_ANGLE_VALUES.items():
        if not abs(came[name] - value) < 2e-3:
            raise SystemExit(f"the fine history of S3 is off: {name} is {came[name]:.5f}, expected {value}")
    return rows


def error_of(scene, result, reference):
    """How far a result is from its reference: a length."""
    if scene == "S3":
        return history_error(result["history"], reference)
    if scene == "S2":
        exact = {"tip": scenes.BEND_TIP}
    elif scene == "S5":
        exact = scenes.FLYING_ENDS
    elif scene == "S6":
        exact = {"middle": scenes.floor_middle()}
    else:
        exact = {"middle": scenes.roll_up_exact(scene, 0.5), "tip": scenes.roll_up_exact(scene, 1.0)}
    return worst(math.dist(result["places"][name], place) for name, place in exact.items())


def measure(group, arguments, pythons, reference):
    """Runs all cases of a group in turns and stores what came in each: `results`, or `failure`."""
    for one in group["cases"]:
        one["results"] = []
        if isinstance(pythons.get(one["program"]), Failed):
            one["failure"] = str(pythons[one["program"]])
    for turn in range(arguments.repeat):
        for one in group["cases"]:
            if "failure" in one:
                continue
            progress(f"{group['title']}: {one['program']} {one['label']} ({turn + 1}/{arguments.repeat})")
            try:
                if one["program"] == "beamsim":
                    result = run_beamsim(arguments.beamsim, one["job"], arguments.timeout)
                else:
                    python, script = pythons[one["program"]], PEERS[one["program"]][0]
                    result = run_peer(python, script, one["job"], arguments.timeout)
                result["error"] = error_of(group["scene"], result, reference)
                del result["history"]
                one["results"].append(result)
            except Failed as failure:
                one["failure"] = str(failure)


def progress(text):
    print(text, file=sys.stderr, flush=True)


def summary(one, limit):
    """Medians of a case."""
    results = one["results"]
    cpu = [result["cpu"] for result in results]
    middle = statistics.median(cpu)
    return {
        "error": max(result["error"] for result in results),
        "accurate": max(result["error"] for result in results) <= limit,
        "iterations": results[0]["iterations"],
        "cpu": middle,
        "least": min(cpu),
        "most": max(cpu),
        "seconds": statistics.median(result.get("seconds", 0.0) for result in results),
        "each": middle * 1e6 / (one["job"]["elements"] * results[0]["iterations"]),
        "peak": max(result["peak"] for result in results),
    }


HEADER = ("| scene | program | error | iterations | CPU s | µs per element and iteration "
          "| CPU ratio | CPU / run s | µs ratio | peak MB | remark |\n| --- | --- " + "| ---: " * 8 + "| --- |")

LEGEND = """\
- *program*: levels are load levels; `total` is beamsim's other interpolation of rotations.
- *error*: distance to the exact or agreed place; in S3 root mean square over the history, the larger of elbow and tip.
- *CPU s*: median (least … most), of beamsim's whole process, of a peer's call that solves (CalculiX: of its process).
- *CPU ratio*, *µs ratio*: to the first row of the scene, above 1 where that is faster.
- *CPU / run s*: to the first row's seconds in run.json, which stand in parentheses: wall time of the run itself.
- *peak MB*: of the process, Python included; what is below 40 is not resolved."""


def table_row(group, one, yard):
    """A line of the table; `yard` is the summary of the group's first case, if it has one."""
    name = ", ".join(filter(None, (one["program"], one["label"])))
    if "failure" in one:
        return f"| {group['title']} | {name} |" + " – |" * 8 + f" **failed**: {one['failure']} |"
    own = summary(one, group["limit"])
    mine = one["program"] == "beamsim"
    remarks = [one["remark"]]
    if not own["accurate"]:
        remarks.insert(0, f"**inaccurate**, {group['limit']:g} allowed")
    elif yard and not mine and own["error"] < 0.95 * yard["error"] and yard["error"] > 1e-6 * group["limit"]:
        remarks.append("more accurate than the first row")
    compared = yard and yard["accurate"] and own["accurate"]
    ratio = f"{own['cpu'] / yard['cpu']:.2f}" if compared else "–"
    run_ratio = f"{own['cpu'] / yard['seconds']:.2f}" if compared else "–"
    if mine:
        run_ratio = f"({own['seconds']:.4f} s)"
    each_ratio = f"{own['each'] / yard['each']:.2f}" if yard else "–"
    return (f"| {group['title']} | {name} | {own['error']:.1e} | {own['iterations']} "
            f"| {own['cpu']:.4f} ({own['least']:.4f} … {own['most']:.4f}) | {own['each']:.2f} "
            f"| {ratio} | {run_ratio} | {each_ratio} | {own['peak']:.0f} | {'; '.join(filter(None, remarks))} |")


def versions(groups):
    """The programs that ran, with the versions that they told."""
    ran = {one["program"]: one["results"][0]["version"] for group in groups for one in group["cases"] if one["results"]}
    return ", ".join(f"{program} {version}" for program, version in ran.items())


def report(groups, repeat):
    """The whole report as Markdown."""
    lines = [
        f"{versions(groups)}; medians of {repeat} runs in turns, one thread on {platform.machine()}.",
        "",
        LEGEND,
        "",
        HEADER,
    ]
    for one_group in groups:
        yardstick = one_group["cases"][0]
        yard = None if "failure" in yardstick else summary(yardstick, one_group["limit"])
        lines += [table_row(one_group, one, yard) for one in one_group["cases"]]
    return "\n".join(lines) + "\n"


def beamsim_holds(groups):
    """Whether all runs of beamsim finished within the allowed error."""
    own = [(one, group) for group in groups for one in group["cases"] if one["program"] == "beamsim"]
    return all("failure" not in one and summary(one, group["limit"])["accurate"] for one, group in own)


def chosen(allowed):
    """A type for argparse: names separated by commas."""
    def names(text):
        unknown = [name for name in text.split(",") if name not in allowed]
        if unknown:
            raise argparse.ArgumentTypeError(f"{', '.join(unknown)}: choose from {', '.join(allowed)}")
        return text.split(",")
    return names


def parse():
    repository = HERE.parent.parent
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers", type=chosen(list(PEERS)), default=list(PEERS), help="default: all")
    parser.add_argument("--scenes", type=chosen(SCENES), default=SCENES)
    parser.add_argument("--repeat", type=int, default=5, help="runs of each program (5)")
    parser.add_argument("--beamsim", type=Path, default=repository / "target" / "release" / "beamsim")
    parser.add_argument("--out", type=Path, help="file for the table; it is printed in any case")
    parser.add_argument("--venvs", type=Path, default=Path(tempfile.gettempdir()) / "beamsim-rivals")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds a run may take (120)")
    return parser.parse_args()


def main():
    arguments = parse()
    if not arguments.beamsim.exists():
        raise SystemExit(f"{arguments.beamsim} is not there: build with `cargo build --release` or give --beamsim")
    pythons = prepare(arguments.peers, arguments.venvs)
    reference = converged_history(arguments.beamsim, arguments.timeout) if "S3" in arguments.scenes else None
    groups = [group for group in GROUPS if group["scene"] in arguments.scenes]
    for one_group in groups:
        one_group["cases"] = [one for one in one_group["cases"] if one["program"] in ("beamsim", *arguments.peers)]
        measure(one_group, arguments, pythons, reference)
    text = report(groups, arguments.repeat)
    print(text)
    if arguments.out:
        arguments.out.write_text(text)
    return 0 if beamsim_holds(groups) else 1


if __name__ == "__main__":
    sys.exit(main())
