#!/usr/bin/env python3
"""Holds src/deck/schema.json against decks: no good deck may be refused, and wrong ones should be.

    python3 tests/schema/validate.py [--engine taplo|jsonschema] [--list]

Taplo comes from npm (through npx) where node is there; else PyPI's jsonschema is put into a virtual environment in
target/. Good decks are those in decks/ and the TOML blocks of the documentation; wrong ones are those in
tests/bad_decks/ and those in decks/ that expect to fail as `deck` or `limit`. Many mistakes are beyond a schema (names
that nothing defines, what an expression says, mechanics): `--list` names the wrong decks that it accepts. Exit status:
1 if a good deck is refused, or if a key lacks its words.
"""

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCHEMA = ROOT / "src/deck/schema.json"
TAPLO = "@taplo/cli@0.7.0"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--engine", choices=["taplo", "jsonschema"], help="default: taplo where node is there")
    parser.add_argument("--list", action="store_true", help="name the wrong decks that are accepted")
    options = parser.parse_args()
    engine = options.engine or ("taplo" if shutil.which("npx") else "jsonschema")
    refused = refused_by_taplo if engine == "taplo" else refused_by_jsonschema
    schema = json.loads(SCHEMA.read_text())
    words = list(wordless(schema, ""))
    with tempfile.TemporaryDirectory() as folder:
        groups = collect(Path(folder))
        out = refused([path for _, _, paths in groups for path in paths], schema)
    print(f"{'with ' + engine:34} decks  accepted  refused")
    wrongly = []
    for name, good, paths in groups:
        no = [path for path in paths if path in out]
        print(f"{name:34} {len(paths):5} {len(paths) - len(no):9} {len(no):8}")
        if good:
            wrongly += [(path, out[path]) for path in no]
        elif options.list:
            print("".join(f"    accepted: {path.relative_to(ROOT)}\n" for path in paths if path not in out), end="")
    for path, why in wrongly:
        print(f"error: {path} is refused {why}".rstrip())
    for what in words:
        print(f"error: {what}")
    sys.exit(1 if wrongly or words else 0)


def collect(folder):
    """Groups of decks: (name, whether they are good, paths). Blocks of the documentation become files in `folder`."""
    decks = [path for path in sorted((ROOT / "decks").rglob("*.toml")) if not is_sweep(path.read_text())]
    wrong = [path for path in decks if expects_refusal(path)]
    blocks = []
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for number, block in enumerate(re.findall(r"^```toml\n(.*?)^```", page.read_text(), re.M | re.S)):
            if is_sweep(block):
                continue
            block_file = folder / f"{page.stem}_{len(blocks)}_block_{number}.toml"
            block_file.write_text(block)
            blocks.append(block_file)
    return [
        ("good: decks/", True, [path for path in decks if path not in wrong]),
        ("good: blocks of the documentation", True, blocks),
        ("wrong: tests/bad_decks/", False, sorted((ROOT / "tests/bad_decks").glob("*.toml"))),
        ("wrong: decks/ that say so", False, wrong),
    ]


def is_sweep(text):
    """Whether a text is not a deck, but says how one is varied."""
    return bool(re.search(r"^deck\s*=", text, re.M))


def expects_refusal(path):
    try:
        deck = tomllib.loads(path.read_text())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError):
        return True
    return any(expect.get("fails") in ("deck", "limit") for expect in deck.get("expect", []))


def refused_by_taplo(paths, _schema):
    """What Taplo refuses, by path."""
    command = ["npx", "--yes", TAPLO, "lint", "--no-auto-config", "--colors", "never", "--schema", SCHEMA.as_uri()]
    environment = {**os.environ, "RUST_LOG": "error"}
    ran = subprocess.run([*command, *map(str, paths)], capture_output=True, text=True, cwd=ROOT, env=environment)
    out = {Path(path): "(see `taplo lint`)" for path in re.findall(r'invalid file.* path="([^"]+)"', ran.stderr)}
    if (ran.returncode == 0) != (not out) or not set(out) <= set(paths):
        sys.exit(f"taplo did not do its work:\n{ran.stderr[-2000:]}")
    return out


def refused_by_jsonschema(paths, schema):
    """What jsonschema refuses, with the first message, by path."""
    try:
        from jsonschema import Draft7Validator
    except ModuleNotFoundError:
        home = ROOT / "target/schema-venv"
        python = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        if Path(sys.prefix) == home:
            raise
        if not python.exists():
            venv.create(home, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "jsonschema>=4,<5"], check=True)
        sys.exit(subprocess.run([python, __file__, *sys.argv[1:], "--engine=jsonschema"]).returncode)
    Draft7Validator.check_schema(schema)
    validator = Draft7Validator(schema)
    wrong = [error for sample in samples(schema, "") if (error := sample_error(validator, *sample))]
    if wrong:
        sys.exit("\n".join(wrong))
    out = {}
    for path in paths:
        try:
            deck = tomllib.loads(path.read_text())
        except tomllib.TOMLDecodeError as error:
            out[path] = f"({error})"
            continue
        error = next(validator.iter_errors(as_json(deck)), None)
        if error:
            out[path] = f"({'.'.join(map(str, error.path))}: {error.message[:200]})"
    return out


def sample_error(validator, path, what, value, sub):
    error = next(validator.evolve(schema=sub).iter_errors(value), None)
    return f"error: {what} of {path} is refused: {error.message}" if error else None


def as_json(value):
    """A TOML value as a validator of JSON sees it: what is not finite is no number."""
    if isinstance(value, dict):
        return {key: as_json(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [as_json(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, (bool, int, float, str)) else str(value)


def children(sub, path):
    """The keys, named tables and entries of lists of tables below."""
    for key, entry in sub.get("properties", {}).items():
        yield f"{path}.{key}".lstrip("."), entry
    if isinstance(sub.get("additionalProperties"), dict):
        yield f"{path}.NAME", sub["additionalProperties"]
    if "properties" in sub.get("items", {}) and sub.get("type") == "array":
        yield f"{path}[]", sub["items"]


def wordless(sub, path):
    for word in ("description", "x-unit", "examples"):
        if not sub.get(word):
            yield f"`{path}` has no {word}"
    for below, entry in children(sub, path):
        yield from wordless(entry, below)


def samples(sub, path):
    """Examples and defaults, which must be allowed themselves."""
    for example in sub.get("examples", []):
        yield path, "an example", example, sub
    if "default" in sub:
        yield path, "the default", sub["default"], sub
    for below, entry in children(sub, path):
        yield from samples(entry, below)


main()
