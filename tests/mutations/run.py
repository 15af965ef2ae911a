#!/usr/bin/env python3
"""Tests the tests: puts one naive mistake of the field at a time into a copy of the sources, and demands that what its
patch names, decks (by `beamsim verify`) or a test (by `cargo test`), then fails.

    tests/mutations/run.py [NAME ...] [--table FILE] [--target FOLDER] [--timeout SECONDS]
    tests/mutations/run.py --applies

A patch begins with lines `# mistake:`, `# names:` (decks and tests `module::name`), `# why:`. A mutant that does not
apply or build is an error, not a success; `--applies` only looks whether each one applies and names what is there.
Exit status: 0 all found, 1 a mutant survives, 2 an error of the suite.
Builds are incremental and without optimisation; where one has been killed and the next does not link, remove the
target folder.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# Without optimisation a mutant is built in half a minute.
PROFILE = ["--profile", "mutations"]


class SuiteError(Exception):
    """Something that says nothing about the mutant."""


@dataclass
class Mutant:
    name: str
    patch: Path
    mistake: str
    decks: list
    tests: list


def read(patch):
    text = patch.read_text()
    head = dict(re.findall(r"^# (mistake|names|why): (.+)$", text, re.M))
    if len(head) != 3:
        raise SuiteError(f"{patch.name}: needs `# mistake:`, `# names:` and `# why:`")
    words = head["names"].split()
    decks = [word for word in words if word.endswith(".toml")]
    return Mutant(patch.stem, patch, head["mistake"], decks, [word for word in words if word not in decks])


class Copy:
    """A copy of the sources with a target folder of its own, which is kept so that builds are incremental."""

    def __init__(self, folder, target, timeout):
        self.folder, self.target, self.timeout = folder, target, timeout
        # A repository around the copy would make `git apply` skip the patch.
        ceiling = {"GIT_CEILING_DIRECTORIES": str(folder.parent)}
        self.environment = os.environ | ceiling | {"CARGO_TARGET_DIR": str(target)}
        listed = subprocess.run(["git", "ls-files", "-z", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True)
        for name in filter(None, listed.stdout.decode().split("\0")):
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(ROOT / name, folder / name)

    def call(self, command, timeout=None):
        """(status, stdout, stderr); status None where it did not end in time."""
        options = {"cwd": self.folder, "env": self.environment, "capture_output": True, "text": True}
        try:
            done = subprocess.run(command, timeout=timeout, **options)
        except subprocess.TimeoutExpired:
            return None, "", ""
        return done.returncode, done.stdout, done.stderr

    def must(self, command):
        status, _, stderr = self.call(command)
        if status != 0:
            raise SuiteError(f"`{' '.join(map(str, command))}` failed:\n{stderr[-2000:]}")

    def build(self):
        """The tests, and the program with them."""
        self.must(["cargo", "test", *PROFILE, "--test", "suite", "--no-run"])

    def verify(self, deck):
        """How a deck fails; None where it holds."""
        if not (self.folder / deck).is_file():
            raise SuiteError(f"there is no {deck}")
        status, stdout, stderr = self.call([self.target / PROFILE[1] / "beamsim", "verify", deck], self.timeout)
        return None if status == 0 else first_failure(status, stdout, stderr, self.timeout)

    def test(self, name):
        """How a test fails; None where it passes."""
        command = ["cargo", "test", *PROFILE, "--test", "suite", name, "--", "--exact"]
        status, stdout, _ = self.call(command, 10 * self.timeout)
        if status is not None and f"test {name} ... " not in stdout:
            raise SuiteError(f"there is no test {name}")
        if status == 0:
            return None
        panic = re.search(r"panicked at [^\n]*\n(.*)", stdout)
        return shorten(panic.group(1)) if panic else "did not end in time" if status is None else "failed"

    def judge(self, mutant):
        """For each named deck or test how it fails, or None."""
        decks = {deck: self.verify(deck) for deck in mutant.decks}
        return decks | {f"test {name}": self.test(name) for name in mutant.tests}


def first_failure(status, stdout, stderr, timeout):
    if status is None:
        return f"did not end within {timeout} s"
    broken = [line.split(maxsplit=1)[1] for line in stdout.splitlines() if line.startswith("  X ")]
    errors = [line for line in stderr.splitlines() if line.startswith("error")]
    if not broken:
        return shorten((errors or [f"exit status {status}"])[0])
    parts = re.split(r" {2,}", broken[0])
    if len(parts) < 3:
        return shorten(" ".join(parts))
    came = parts[2].split(": ")[0]  # of a failure its name
    return shorten(f"{parts[0]}: {came} instead of {parts[1]}")


def shorten(text):
    text = " ".join(text.split()).replace("|", "\\|")
    return text if len(text) <= 160 else text[:157] + "..."


def try_mutant(copy, mutant):
    copy.must(["git", "apply", mutant.patch])
    try:
        copy.build()
        return copy.judge(mutant)
    finally:
        copy.must(["git", "apply", "--reverse", mutant.patch])


def check_unmutated(copy, mutants):
    copy.build()
    for mutant in mutants:
        broken = [what for what, failure in copy.judge(mutant).items() if failure]
        if broken:
            raise SuiteError(f"without any mutation {', '.join(broken)} fails already")


def row(mutant, results):
    what = "<br>".join(name if name.startswith("test ") else name.removeprefix("decks/") for name in results)
    how = "<br>".join(failure or "**survives**" for failure in results.values())
    return f"| {mutant.mistake} | {what} | {how} |"


def applies(mutants):
    """Fails on patches that do not fit the sources any more, and on decks and tests that are not there."""
    with tempfile.TemporaryDirectory(prefix="beamsim-mutations-") as folder:
        copy = Copy(Path(folder).resolve(), ROOT / "target" / "mutations", 0.0)
        for mutant in mutants:
            copy.must(["git", "apply", "--check", mutant.patch])
            for deck in mutant.decks:
                if not (copy.folder / deck).is_file():
                    raise SuiteError(f"{mutant.name}: there is no {deck}")
            for test in mutant.tests:
                module, name = test.split("::")
                if f"fn {name}(" not in (copy.folder / "tests" / "suite" / f"{module}.rs").read_text():
                    raise SuiteError(f"{mutant.name}: there is no test {test}")
    print(f"{len(mutants)} patches apply")
    return 0


def run(arguments):
    mutants = [read(patch) for patch in sorted(HERE.glob("*.patch"))]
    if arguments.applies:
        return applies(mutants)
    unknown = set(arguments.names) - {mutant.name for mutant in mutants}
    if unknown:
        raise SuiteError(f"there is no patch {', '.join(sorted(unknown))}")
    mutants = [mutant for mutant in mutants if not arguments.names or mutant.name in arguments.names]
    with tempfile.TemporaryDirectory(prefix="beamsim-mutations-") as folder:
        copy = Copy(Path(folder).resolve(), arguments.target.resolve(), arguments.timeout)
        check_unmutated(copy, mutants)
        table = ["| mistake | deck or test | how it fails |", "| --- | --- | --- |"]
        survivors = []
        for mutant in mutants:
            results = try_mutant(copy, mutant)
            table.append(row(mutant, results))
            print(table[-1], flush=True)
            if None in results.values():
                survivors.append(mutant.name)
    if arguments.table:
        arguments.table.write_text("\n".join(table) + "\n")
    print(f"{len(mutants) - len(survivors)} of {len(mutants)} mistakes are found")
    print("".join(f"survives: {name}\n" for name in survivors), end="")
    return 1 if survivors else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="patches without their ending; else all")
    parser.add_argument("--applies", action="store_true", help="only look whether the patches fit the sources")
    parser.add_argument("--table", type=Path, metavar="FILE", help="write the markdown table there too")
    parser.add_argument("--target", type=Path, default=ROOT / "target" / "mutations", help="kept between runs")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds a deck may take")
    try:
        return run(parser.parse_args())
    except SuiteError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
