#!/usr/bin/env python3
"""Kills, pairs of runs, full disks: what a crash leaves behind, and how it goes on.

    python3 tests/reliability/kills.py [--beamsim PATH] [--kills N] [--pairs N] [--seed S]

kills   runs, sweeps, cost studies and searches for an accuracy are killed at random instants, by SIGKILL and by
        signals that they hear. Every file with a final name must be whole and belong to the run.json beside it, and
        the run that goes on must end with the bytes of one that never stopped.
pairs   two runs into one folder at the same time, some in PID namespaces of their own: one wins, the other is refused
        as `locked`, and the folder holds the winner's files alone.
full    a limit on file sizes takes the place of a full disk, at ten sizes: the run ends as `io`, and what it reached
        is kept under its name.

Ends with status 1 if anything differs, and prints a table.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SWING = os.path.join(os.path.dirname(os.path.abspath(__file__)), "swing.toml")
UNTIMED = ("seconds", "threads", "resumed")


def read(path):
    try:
        with open(path, "rb") as file:
            return file.read()
    except FileNotFoundError:
        return None


def record(folder):
    """run.json without times; None if there is none."""
    text = read(os.path.join(folder, "run.json"))
    if text is None:
        return None
    content = json.loads(text)
    for key in UNTIMED:
        content.pop(key, None)
    return content


class Study:
    def __init__(self, beamsim, seed):
        self.beamsim = beamsim
        self.random = random.Random(seed)
        self.faults = []
        self.counts = {}

    def count(self, what, more=1):
        self.counts[what] = self.counts.get(what, 0) + more

    def fault(self, what):
        self.faults.append(what)
        print("FAULT", what, flush=True)

    def command(self, arguments):
        return [self.beamsim, *arguments]

    def whole(self, arguments):
        done = subprocess.run(self.command(arguments), capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{arguments}: {done.stderr}")

    def same(self, one, other):
        """The names of files in which two folders of results differ; lists of lists for folders of points."""
        differ = []
        names = sorted(set(os.listdir(one)) | set(os.listdir(other)))
        for name in names:
            a, b = os.path.join(one, name), os.path.join(other, name)
            if os.path.isdir(a) and os.path.isdir(b):
                differ += [f"{name}/{inner}" for inner in self.same(a, b)]
            elif name == "run.json":
                differ += [] if record(one) == record(other) else [name]
            elif name.endswith(".json"):
                differ += [] if untimed(read(a)) == untimed(read(b)) else [name]
            elif read(a) != read(b):
                differ.append(name)
        return differ

    def judge_killed(self, folder, wholes):
        """After a kill: files with final names are those of one of the whole runs, together."""
        history = read(os.path.join(folder, "history.csv"))
        if history is None:
            return
        known = [whole for whole in wholes if read(os.path.join(whole, "history.csv")) == history]
        if not known:
            self.fault(f"history.csv of no whole run in {folder}")
        elif record(folder) not in [None] + [record(whole) for whole in known]:
            self.fault(f"history.csv and run.json of two runs in {folder}")

    def kills_of_runs(self, kills, extra):
        """Runs over the results of an older run, killed and resumed until they end."""
        for out, step in (("older", "0.002"), ("newer", "0.0005")):
            self.whole(["run", "swing.toml", "-q", "--out", out, "--set", f"stage.0.step={step}", *extra])
        begun = time.time()
        self.whole(["run", "swing.toml", "-q", "--out", "timed", *extra])
        usual = time.time() - begun
        done = 0
        while done < kills:
            shutil.rmtree("killed", ignore_errors=True)
            shutil.copytree("older", "killed")
            mode = []
            while True:
                run = ["run", "swing.toml", "-q", "--out", "killed", "--checkpoint", "0.02s", *mode, *extra]
                child = subprocess.Popen(self.command(run), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
                try:
                    child.wait(self.random.uniform(0, 1.2 * usual))
                except subprocess.TimeoutExpired:
                    child.send_signal(self.random.choice([signal.SIGKILL] * 3 + [signal.SIGTERM]))
                    done += 1
                errors = child.communicate()[1].decode()
                self.judge_killed("killed", ["older", "newer"])
                if child.returncode == 0:
                    break
                if child.returncode not in (-signal.SIGKILL, -signal.SIGTERM, 143):
                    self.fault(f"status {child.returncode} after a kill: {errors[-200:]}")
                    break
                mode = ["--resume"] if os.path.exists("killed/checkpoint") else []
                self.count("resumed", len(mode))
            differ = self.same("killed", "newer")
            if differ:
                self.fault(f"a resumed run differs in {differ}")
        self.count("kills of runs", done)

    def kills_of_studies(self, name, arguments, kills, same):
        """Sweeps and studies, which go on by themselves."""
        begun = time.time()
        self.whole([*arguments, "--out", "study_whole"])
        usual = time.time() - begun
        done = 0
        while done < kills:
            shutil.rmtree("study", ignore_errors=True)
            while True:
                child = subprocess.Popen(
                    self.command([*arguments, "--out", "study"]), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
                )
                try:
                    child.wait(self.random.uniform(0, usual))
                except subprocess.TimeoutExpired:
                    child.kill()
                    done += 1
                errors = child.communicate()[1].decode()
                if child.returncode == 0:
                    break
                if child.returncode != -signal.SIGKILL:
                    self.fault(f"{name}: status {child.returncode} after a kill: {errors[-200:]}")
                    break
            for file in same:
                if read(f"study/{file}") != read(f"study_whole/{file}"):
                    self.fault(f"{name}: {file} differs after kills")
            left = [file for _, _, files in os.walk("study") for file in files if file.endswith(".part")]
            if left:
                self.fault(f"{name}: {left} are left")
        self.count(f"kills of {name}", done)
        shutil.rmtree("study_whole")

    def pairs(self, count, namespaces):
        """Two runs into one folder."""
        prefix = ["unshare", "-p", "-f"] if namespaces else []
        if namespaces and subprocess.run([*prefix, "true"], capture_output=True).returncode:
            print("skipped: `unshare` is denied here, so that no PID namespaces can be tried")
            return
        variants = {stiffness: f"section.rod.EI={stiffness}" for stiffness in (100, 101)}
        for stiffness, setting in variants.items():
            self.whole(["run", "swing.toml", "-q", "--out", f"alone{stiffness}", "--set", setting])
        for _ in range(count):
            shutil.rmtree("both", ignore_errors=True)
            runs = [
                subprocess.Popen(
                    prefix + self.command(["run", "swing.toml", "-q", "--out", "both", "--set", setting]),
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                )
                for setting in variants.values()
            ]
            errors = [run.communicate()[1].decode() for run in runs]
            statuses = [run.returncode for run in runs]
            refused = [error for error, status in zip(errors, statuses) if status]
            if any("error[locked]" not in error for error in refused):
                self.fault(f"two runs: {refused}")
            if len(refused) == 2:
                self.fault("two runs: both were refused")
            # The last to finish, if they did not overlap; else the only one.
            if not any(self.same("both", f"alone{stiffness}") == [] for stiffness in variants):
                self.fault("two runs: the folder holds the files of neither")
            self.count("pairs refused one", len(refused) == 1)
        self.count("pairs in PID namespaces" if namespaces else "pairs", count)

    def full_disks(self):
        """A limit on the size of files in the place of a full disk; the smallest have no room for run.json."""
        self.whole(["run", "swing.toml", "-q", "--out", "roomy"])
        whole = read("roomy/history.csv")
        parts = [len(whole) * k // 10 for k in (5, 6, 7, 8, 9)]
        for size in [0, 100, 4096, 60_000, 70_000, *parts]:

            def limit(size=size):
                resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

            shutil.rmtree("tight", ignore_errors=True)
            run = self.command(["run", "swing.toml", "-q", "--out", "tight"])
            done = subprocess.run(run, preexec_fn=limit, restore_signals=False, capture_output=True, text=True)
            kept = read("tight/history.partial.csv") if os.path.isdir("tight") else None
            if done.returncode != 4 or "error[io]" not in done.stderr:
                self.fault(f"disk full at {size}: status {done.returncode}: {done.stderr[-200:]}")
            elif read("tight/history.csv"):
                self.fault(f"disk full at {size}: a part has a final name")
            elif kept is None and size > 65_536:
                self.fault(f"disk full at {size}: what was reached is not kept: {os.listdir('tight')}")
            elif kept is not None and not (whole.startswith(kept) and kept.endswith(b"\n")):
                self.fault(f"disk full at {size}: what is kept is not the beginning of the history")
            self.count("full disks")


def untimed(text):
    content = json.loads(text)
    if isinstance(content, dict):
        for key in UNTIMED:
            content.pop(key, None)
    return content


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--beamsim", default="target/release/beamsim")
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    wanted = parser.parse_args()
    study = Study(os.path.abspath(wanted.beamsim), wanted.seed)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        shutil.copy(SWING, "swing.toml")
        half = wanted.kills // 2
        study.kills_of_runs(half, [])
        study.kills_of_runs(wanted.kills // 8, ["--set", "output.vtk=true", "--set", "stage.0.end=0.2"])
        short = ["-q", "--set", "stage.0.end=0.2"]
        sweep = ["sweep", "swing.toml", *short, "--vary", "section.rod.EI=90:110:12"]
        study.kills_of_studies("sweeps", sweep, wanted.kills // 8, ["sweep.csv"])
        study.kills_of_studies("cost", ["cost", "swing.toml", *short], wanted.kills // 16, [])
        accuracy = ["run", "swing.toml", *short, "--accuracy", "1e-4"]
        study.kills_of_studies("accuracy", accuracy, wanted.kills // 16, ["history.csv"])
        study.pairs(wanted.pairs, False)
        study.pairs(max(1, wanted.pairs * 3 // 20), True)
        study.full_disks()
        os.chdir("/")
    print(f"{len(study.faults)} faults;", ", ".join(f"{what}: {count}" for what, count in sorted(study.counts.items())))
    sys.exit(1 if study.faults else 0)


if __name__ == "__main__":
    main()
