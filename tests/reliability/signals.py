#!/usr/bin/env python3
"""Measures how soon beamsim ends after a signal at a random instant.

    python3 tests/reliability/signals.py BINARY [--seed 1] [--instants 50] [--elements N] [--wait S] [KIND ...]

KIND is static, modal, buckling, dynamic, rest, path, net, dense (runs of 10 to 100,000 elements, by the instant), or
commands (the other subcommands). Each instant starts a process, waits a random time, sends INT, TERM or HUP, and
measures the time until the process has ended. Prints a row per kind, and the instants that took more than a second.
On a machine with other work the processor time between the signal and the end tells more, which is measured, too.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import tempfile
import time

LIMIT = 1.0

SECTION = """
[section.rod]
EA = 1e6
GA = 4e5
GJ = 80
EI = 100
rhoA = 1.0
rhoJ = [2e-3, 1e-3, 1e-3]
"""

ARM = """
[param]
n = {n}
[point]
root = [0, 0, 0]
tip = [2, 0, 0]
""" + SECTION + """
[[beam]]
name = "arm"
section = "rod"
through = ["root", "tip"]
elements = "n"
order = {order}
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = {force}
[output]
columns = ["u", "reaction"]
"""

STAGES = {
    "static": 'kind = "static"\nsteps = 200',
    "modal": 'kind = "static"\nsteps = 1\n[[stage]]\nkind = "modal"\nmodes = {modes}',
    "buckling": 'kind = "buckling"\nmodes = 4',
    "dynamic": 'kind = "dynamic"\nend = 100\nstep = 0.001',
    "path": 'kind = "static"\ncontrol = "arc_length"\nsteps = 200',
}

# A cable that only its weight holds.
REST = """
gravity = [0, 0, -9.81]
[param]
n = {n}
[point]
left = [0, 0, 0]
right = [1, 0, 0]
middle = [0.5, 0, 1]
[section.rod]
EA = 1e5
GA = 4e4
GJ = 1e-5
EI = 1e-5
rhoA = 1.0
[[beam]]
name = "cable"
section = "rod"
through = ["left", "middle", "right"]
elements = "n"
[[support]]
at = "left"
fix = "pin"
[[support]]
at = "right"
fix = "pin"
[[stage]]
kind = "static"
steps = 20
"""


def arm(rng, kind, elements):
    n = elements or int(10 ** rng.uniform(1, 5))
    # A force across the beam is symmetric in no plane but that of the scene.
    force = {"static": "[0, 3, 40]", "path": "[0, 3, 40]", "modal": "[0, 0, 0.1]", "buckling": "[-1, 0, 0]",
             "dynamic": "[0, 1, 2]"}[kind]
    text = ARM.format(n=n, order=rng.choice([1, 2, 3]), force=force)
    modes = max(1, min(200, 200_000 // n))
    return f"{n} elements", text + "[[stage]]\n" + STAGES[kind].format(modes=modes) + "\n"


def rest(rng, _, elements):
    n = elements or int(10 ** rng.uniform(1, 4))
    return f"{n} elements", REST.format(n=n)


def net(rng, _, __):
    """A square net of beams: the factors have fill."""
    m = rng.choice([5, 10, 20, 40])
    points, beams = [], []
    for i in range(m + 1):
        for j in range(m + 1):
            points.append(f"p{i}_{j} = [{i}, {j}, 0]")
    elements = m * rng.choice([1, 4])
    for i in range(m + 1):
        along = ", ".join(f'"p{i}_{j}"' for j in range(m + 1))
        across = ", ".join(f'"p{j}_{i}"' for j in range(m + 1))
        for name, through in [(f"a{i}", along), (f"b{i}", across)]:
            beams.append(f'[[beam]]\nname = "{name}"\nsection = "rod"\nthrough = [{through}]\n'
                         f"elements = {elements}\naxis3 = [0, 0, 1]\n")
    corners = ["p0_0", f"p{m}_0", f"p0_{m}", f"p{m}_{m}"]
    supports = "".join(f'[[support]]\nat = "{p}"\nfix = "all"\n' for p in corners)
    follows = rng.choice(["", 'frame = "body"\n'])
    text = "[point]\n" + "\n".join(points) + SECTION + "".join(beams) + supports
    text += f'[[load]]\nat = "p{m // 2}_{m // 2}"\nforce = [0, 0, 5]\n{follows}[[stage]]\nkind = "static"\nsteps = 50\n'
    return f"net of {m} x {m}", text


def dense(rng, _, __):
    """Nodes that are all tied to one another by springs: too much fill for factors in blocks."""
    m = rng.choice([60, 120, 240])
    points = [f"p{i} = [{i}, {rng.uniform(-1, 1):.3f}, {rng.uniform(-1, 1):.3f}]" for i in range(m)]
    names = ", ".join(f'"p{i}"' for i in range(m))
    text = "[point]\n" + "\n".join(points) + SECTION
    text += f'[[beam]]\nname = "line"\nsection = "rod"\nthrough = [{names}]\nelements = {2 * m}\n'
    for i in range(m):
        for j in range(i + 2, m):
            text += f'[[spring]]\nbetween = ["p{i}", "p{j}"]\nstiffness = 1\n'
    text += '[[support]]\nat = "p0"\nfix = "all"\n'
    text += f'[[load]]\nat = "p{m - 1}"\nforce = [0, 0, 5]\n[[stage]]\nkind = "static"\nsteps = 50\n'
    return f"{m} nodes, all tied", text


MAKERS = {**{kind: arm for kind in STAGES}, "rest": rest, "net": net, "dense": dense}


class Answer:
    """The end of a process after a signal: seconds on the clock and of the processor, and the exit status."""

    def __init__(self, seconds, cpu, status):
        self.seconds = seconds
        self.cpu = cpu
        self.status = status

    def is_late(self):
        return min(self.seconds, self.cpu) > LIMIT

    def __str__(self):
        return f"{self.seconds:.2f} s, {self.cpu:.2f} s of the processor"


def used(pid):
    """Processor seconds of a process so far."""
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def send(binary, arguments, folder, wait, number):
    """Starts a process and sends a signal after a time: the answer, or the exit status if it ended by itself."""
    with open(os.path.join(folder, "log"), "wb") as log:
        process = subprocess.Popen([binary, *arguments], cwd=folder, stdout=log, stderr=log)
    begun = time.time()
    while process.poll() is None and time.time() - begun < wait:
        time.sleep(min(0.01, wait))
    if process.poll() is not None:
        return None, process.returncode
    before = used(process.pid)
    process.send_signal(number)
    sent = time.time()
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            break
        if time.time() - sent > 60:
            process.send_signal(signal.SIGKILL)
        time.sleep(0.002)
    seconds = time.time() - sent
    process.returncode = os.waitstatus_to_exitcode(status)
    # A process that no handler has reached yet is ended by the signal itself.
    shown = 128 - process.returncode if process.returncode < 0 else process.returncode
    return Answer(seconds, usage.ru_utime + usage.ru_stime - before, shown), shown


def judge(folder, status, number, out):
    """What is wrong with an end after a signal."""
    wrong = []
    if status != 128 + number:
        wrong.append(f"status {status}")
    left = os.listdir(os.path.join(folder, out)) if out and os.path.isdir(os.path.join(folder, out)) else []
    if any(name.endswith(".part") for name in left):
        wrong.append("parts are left")
    results = [name for name in left if name != "checkpoint"]
    if status == 128 + number and left and sorted(results) != ["history.partial.csv", "run.json"]:
        wrong.append(f"left {sorted(left)}")
    return wrong


def study(binary, kind, rng, instants, elements, longest):
    rows, bad, done = [], [], 0
    while len(rows) < instants and done < 4 * instants:
        folder = tempfile.mkdtemp(prefix="signals-")
        what, text = MAKERS[kind](rng, kind, elements)
        with open(os.path.join(folder, "deck.toml"), "w") as file:
            file.write(text)
        number = rng.choice([signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
        wait = longest * rng.random() ** 2
        threads = rng.choice(["1", "2"])
        words = ["run", "deck.toml", "-q", "--threads", threads, "--out", "o"]
        answer, status = send(binary, words, folder, wait, number)
        if answer is None and status == 0:
            done += 1
        elif answer is None:
            bad.append(f"{what}: ended by itself with {status}: {open(os.path.join(folder, 'log')).read()[-300:]}")
            done += 1
        elif status == 0:
            # The signal came when the results were complete.
            done += 1
        else:
            rows.append(answer)
            wrong = judge(folder, status, number, "o")
            if answer.is_late():
                wrong.append(str(answer))
            if wrong:
                bad.append(f"{what}, {threads} threads, {signal.Signals(number).name} after {wait:.3f} s: "
                           + ", ".join(wrong))
        shutil.rmtree(folder)
    report(kind, rows, bad, done)


def report(kind, rows, bad, done):
    fine = sum(not answer.is_late() for answer in rows)
    seconds = sorted(answer.seconds for answer in rows) or [float("nan")]
    cpu = sorted(answer.cpu for answer in rows) or [float("nan")]
    print(f"{kind:<14} {fine} of {len(rows)} within {LIMIT:.0f} s, median {1e3 * seconds[len(seconds) // 2]:.0f} ms, "
          f"largest {1e3 * seconds[-1]:.0f} ms ({1e3 * cpu[-1]:.0f} ms of the processor), {done} had ended before",
          flush=True)
    for line in bad:
        print(f"    {line}", flush=True)


def commands(binary, rng, instants):
    """The other subcommands, on one deck."""
    folder = tempfile.mkdtemp(prefix="signals-")
    write = lambda name, text: open(os.path.join(folder, name), "w").write(text)
    force = "[0, 3, 40]"
    deck = ARM.format(n=100, order=2, force=force) + "[[stage]]\n" + STAGES["dynamic"] + "\n"
    write("motion.toml", deck)
    large = ARM.format(n=100000, order=3, force=force) + "[[stage]]\n" + STAGES["static"] + "\n"
    write("large.toml", large)
    short = ARM.format(n=40, order=1, force=force) + '[[stage]]\nkind = "dynamic"\nend = 20\nstep = 0.001\n'
    write("short.toml", short.replace("[output]", '[output]\nvtk = false'))
    os.mkdir(os.path.join(folder, "odd"))
    os.mkfifo(os.path.join(folder, "odd", "pipe.toml"))
    os.mkfifo(os.path.join(folder, "pipe.toml"))
    os.symlink("..", os.path.join(folder, "odd", "up"))
    tools = os.path.join(folder, "tools")
    os.mkdir(tools)
    for name in ("sbatch", "squeue", "scontrol"):
        path = os.path.join(tools, name)
        with open(path, "w") as file:
            file.write("#!/bin/sh\nexec sleep 1000\n")
        os.chmod(path, 0o755)
    os.environ["PATH"] = tools + os.pathsep + os.environ["PATH"]
    subprocess.run([binary, "run", "short.toml", "-q", "--out", "done"], cwd=folder, check=True)
    table = os.path.join(folder, "done", "history.csv")
    with open(table) as file:
        head, *lines = file.read().splitlines()
    with open(os.path.join(folder, "long.csv"), "w") as file:
        file.write("\n".join([head] + lines * 100) + "\n")
    cases = {
        "check": ["check", "large.toml"],
        "verify": ["verify", "motion.toml"],
        "verify a pipe": ["verify", "pipe.toml"],
        "verify loops": ["verify", "odd", "motion.toml"],
        "effects": ["effects", "motion.toml"],
        "cost": ["cost", "motion.toml", "--threads", "2", "--out", "c"],
        "accuracy": ["run", "motion.toml", "--accuracy", "1e-6", "--out", "a"],
        "error bars": ["run", "motion.toml", "--error-bars", "--out", "e"],
        "sweep": ["sweep", "motion.toml", "--vary", "param.n=100,200,300,400", "--out", "s"],
        "slurm": ["sweep", "motion.toml", "--vary", "param.n=100,200", "--engine", "slurm", "--out", "q"],
        "report": ["report", "done", "--out", "page.html"],
        "plot": ["plot", "long.csv", "--column", "tip.uz", "--out", "p.svg"],
        "compare": ["compare", "long.csv", "long.csv"],
    }
    for name, words in cases.items():
        rows, bad, done = [], [], 0
        while len(rows) < instants and done < 3 * instants:
            number = rng.choice([signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
            wait = 3.0 * rng.random() ** 2
            answer, status = send(binary, words, folder, wait, number)
            if answer is None or status == 0:
                done += 1
                continue
            rows.append(answer)
            wrong = judge(folder, status, number, None)
            if answer.is_late():
                wrong.append(str(answer))
            if wrong:
                bad.append(f"{signal.Signals(number).name} after {wait:.3f} s: " + ", ".join(wrong))
        report(name, rows, bad, done)
    shutil.rmtree(folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("kinds", nargs="*", metavar="KIND")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--instants", type=int, default=50)
    parser.add_argument("--elements", type=int, help="size of all runs (default: from 10 to 100,000)")
    parser.add_argument("--wait", type=float, default=6.0, help="longest time before a signal, in seconds")
    arguments = parser.parse_args()
    binary = os.path.abspath(arguments.binary)
    # Processes inherit what `nohup` and shells switch off.
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    for kind in arguments.kinds or ["static", "modal", "buckling", "dynamic"]:
        rng = random.Random(f"{arguments.seed} {kind}")
        if kind == "commands":
            commands(binary, rng, arguments.instants)
        else:
            study(binary, kind, rng, arguments.instants, arguments.elements, arguments.wait)


if __name__ == "__main__":
    main()
