#!/usr/bin/env python3
"""Runs every deck and command of the user guide, and follows every link.

    python3 tests/book/run.py --beamsim target/release/beamsim [PAGE…] [--site target/book] [--keep DIR]

Each page of docs/SUMMARY.md, and README.md, has a folder of its own, with `decks` and `docs` of the repository in it. In it,
from top to bottom:

- A fenced block whose first line is `# file: NAME` is written to that file; so is an HTML comment that begins with `file: NAME`, which
  readers do not see. Other `toml` blocks are fragments, which must only be TOML.
- Each line of a `sh` block that begins with `beamsim`, with `python3` and a file of the page, or with a command that only looks (`cat`, `head`, …), is
  run. Its exit status must be 0, or that of a comment at its end: `# exit 3`. Other lines, and those with an ellipsis, are counted as skipped; so are
  scripts that import a module that is not installed. /tmp/ means a folder of the page.
- A `text` block shows what the last block of commands under the same heading prints: each of its lines must be there, in order; an ellipsis stands for anything, a
  line of nothing else, like an empty one, for any lines. After `cat FILE` the block that follows is held against the file, whatever its language.

As many pages are worked through at once as there are cores.

In all pages below docs/, in README.md and CHANGELOG.md relative links must lead to files, and anchors to headings. In the guide they must stay in
docs/, since the site holds nothing else; and every page must be in SUMMARY.md. With --site the built HTML is held to the same.

Ends with status 1 if anything fails.
"""

import argparse
import ast
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse
from concurrent.futures import ThreadPoolExecutor
from html.parser import HTMLParser
from pathlib import Path

try:
    import tomllib
except ImportError:  # Python before 3.11
    tomllib = None

ROOT = Path(__file__).resolve().parent.parent.parent
DOCS = ROOT / "docs"

TIMEOUT = 120
# Commands that only look at files.
LOOKS = ("cat", "cut", "diff", "grep", "head", "ls", "sort", "tail", "test")
# A stand-in for GNU parallel where it is not installed: one job after the other.
PARALLEL = """#!/usr/bin/env python3
import subprocess, sys
words = sys.argv[1:]
job, places = words[: words.index(":::")], words[words.index(":::") + 1 :]
sys.exit(sum(subprocess.call([word.replace("{}", place) for word in job]) != 0 for place in places))
"""
# Words in the options of a command that needs another program or machine.
ELSEWHERE = ("--engine slurm", "--sbatch")


class Block:
    def __init__(self, language, line, text):
        self.language, self.line, self.text = language, line, text

    def file(self):
        match = re.match(r"# file: (\S+)\n", self.text)
        return match and match.group(1)


def blocks(text):
    """Fenced blocks and hidden files, with the line each begins on."""
    lines = text.split("\n")
    at = 0
    while at < len(lines):
        if re.match(r"#+ ", lines[at]):
            yield Block("heading", at + 1, "")
        fence = re.match(r"( *)(```+)\s*([\w-]*)", lines[at])
        hidden = re.match(r"<!-- file: (\S+)\s*$", lines[at])
        begin = at
        if fence:
            indent, marks, language = fence.groups()
            body = []
            at += 1
            while at < len(lines) and lines[at].strip() != marks:
                body.append(lines[at][len(indent) :] if lines[at].startswith(indent) else lines[at])
                at += 1
            yield Block(language, begin + 1, "\n".join(body) + "\n")
        elif hidden:
            body = [f"# file: {hidden.group(1)}"]
            at += 1
            while at < len(lines) and lines[at].strip() != "-->":
                body.append(lines[at])
                at += 1
            yield Block("hidden", begin + 1, "\n".join(body) + "\n")
        at += 1


def missing_module(script):
    """The name of a module that a Python script imports and that is not installed."""
    for node in ast.walk(ast.parse(script.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module]
        for name in names:
            if importlib.util.find_spec(name.split(".")[0]) is None:
                return name
    return None


def shown(expected, printed):
    """The first line of a text block that was not printed where it should be, or None."""
    printed = [line.strip() for line in printed.split("\n")]
    at = 0
    anywhere = True
    for line in expected.split("\n"):
        line = line.strip()
        if line in ("…", ""):
            anywhere = True
            continue
        pattern = ".*".join(re.escape(re.sub(r"\s+", " ", part)) for part in line.split("…"))
        hits = [i for i in range(at, len(printed)) if re.fullmatch(pattern, re.sub(r"\s+", " ", printed[i]))]
        if not hits or (not anywhere and hits[0] != at):
            return line
        at = hits[0] + 1
        anywhere = False
    return None


class Page:
    def __init__(self, path, folder, beamsim):
        self.path, self.folder, self.beamsim = path, folder, beamsim
        self.name = str(path.relative_to(ROOT))
        self.files = self.fragments = self.commands = self.texts = 0
        self.skipped = []
        self.failures = []
        self.printed = None
        self.cat = False

    def fail(self, line, what):
        self.failures.append(f"{self.name}:{line}: {what}")

    def worked_through(self):
        self.folder.mkdir(parents=True)
        tools = self.folder / ".bin"
        tools.mkdir()
        (tools / "beamsim").symlink_to(self.beamsim)
        if shutil.which("parallel") is None:
            (tools / "parallel").write_text(PARALLEL)
            (tools / "parallel").chmod(0o755)
        for name in ("decks", "docs"):
            (self.folder / name).symlink_to(ROOT / name)
        self.environment = {**os.environ, "NO_COLOR": "1", "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}"}
        for block in blocks(self.path.read_text()):
            name = block.file()
            if block.language == "heading":
                self.printed = None
            elif self.cat and block.language not in ("sh", "hidden"):
                self.compare(block)
            elif name:
                self.write(block, name)
            elif block.language == "toml":
                self.fragment(block)
            elif block.language == "sh":
                self.shell(block)
            elif block.language == "text" and self.printed is not None:
                self.compare(block)
            if block.language != "sh":
                self.cat = False
        return self

    def compare(self, block):
        self.texts += 1
        line = shown(block.text, self.printed)
        if line is not None:
            self.fail(block.line, f"not printed by the commands above: {line}\n  they printed:\n{indented(self.printed)}")

    def write(self, block, name):
        target = self.folder / name
        if ".." in Path(name).parts or target.is_absolute() and self.folder not in target.parents:
            self.fail(block.line, f"{name} lies outside of the folder")
            return
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(block.text)
        self.files += 1

    def fragment(self, block):
        self.fragments += 1
        if tomllib is None:
            return
        try:
            tomllib.loads(block.text)
        except tomllib.TOMLDecodeError as error:
            self.fail(block.line, f"not TOML: {error}")

    def shell(self, block):
        self.printed = ""
        lines = block.text.rstrip("\n").split("\n")
        at = 0
        while at < len(lines):
            number = block.line + 1 + at
            line = lines[at]
            while line.endswith("\\") and at + 1 < len(lines):
                at += 1
                line = line[:-1] + lines[at]
            at += 1
            if line.strip() and not line.lstrip().startswith("#"):
                self.command(number, line.strip())

    def command(self, number, line):
        words = line.split()
        script = self.folder / words[1] if words[0] == "python3" and len(words) > 1 else None
        if "…" in line or any(word in line for word in ELSEWHERE):
            self.skipped.append(line)
            return
        if script is not None and script.is_file() and self.folder in script.resolve().parents:
            lacks = missing_module(script)
            if lacks:
                self.skipped.append(f"{line} ({lacks} is not installed)")
                return
        elif words[0] != "beamsim" and words[:2] != ["parallel", "beamsim"] and words[0] not in LOOKS:
            self.skipped.append(line)
            return
        self.commands += 1
        self.cat = words[0] == "cat"
        match = re.search(r"#\s*exit (\d+)\b[^#]*$", line)
        wanted = int(match.group(1)) if match else 0
        try:
            ran = subprocess.run(
                ["sh", "-c", line.replace("/tmp/", "tmp/")],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=TIMEOUT,
            )
        except subprocess.TimeoutExpired:
            self.fail(number, f"`{line}` took longer than {TIMEOUT} s")
            return
        printed = ran.stdout.decode("utf-8", "replace")
        self.printed += printed
        if ran.returncode != wanted:
            self.fail(number, f"`{line}` ended with {ran.returncode}, not {wanted}:\n{indented(printed)}")

    def summary(self):
        said = [f"{self.files} files", f"{self.commands} commands", f"{self.texts} outputs", f"{self.fragments} fragments"]
        if self.skipped:
            said.append(f"{len(self.skipped)} lines skipped")
        if self.failures:
            said.append(f"{len(self.failures)} FAILED")
        return f"{self.name}: " + ", ".join(said)


def indented(text):
    lines = text.rstrip("\n").split("\n")
    if len(lines) > 40:
        lines = lines[:20] + ["…"] + lines[-20:]
    return "\n".join("    " + line for line in lines)


# Links


def without_code(text):
    """The text with the content of fences, code spans and comments blanked, lines kept."""
    blank = lambda match: re.sub(r"[^\n]", " ", match.group(0))
    text = re.sub(r"^( *)(```+)[^\n]*\n.*?^ *\2 *$", blank, text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", blank, text, flags=re.S)
    return re.sub(r"(?<!`)(`+)(?!`)(.+?)(?<!`)\1(?!`)", blank, text, flags=re.S)


def anchor(heading):
    """The anchor of a heading, as mdBook and GitHub form it."""
    heading = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    kept = (c for c in heading.strip().lower() if c.isalnum() or c in "_-" or c.isspace())
    return "".join("-" if c.isspace() else c for c in kept)


def anchors(path, known={}):
    if path not in known:
        text = re.sub(r"^( *)(```+)[^\n]*\n.*?^ *\2 *$", "", path.read_text(), flags=re.M | re.S)
        found, seen = set(), {}
        for match in re.finditer(r"^#{1,6} +(.+?) *#*$", text, flags=re.M):
            name = anchor(match.group(1))
            count = seen.get(name, 0)
            seen[name] = count + 1
            found.add(f"{name}-{count}" if count else name)
        found.update(re.findall(r'\b(?:id|name)="([^"]+)"', text))
        known[path] = found
    return known[path]


def links(path):
    """Links and pictures of a page: line and target."""
    text = without_code(path.read_text())
    patterns = (r"\]\(\s*<?([^()\s>]*(?:\([^()\s]*\))?[^()\s>]*)>?(?:\s+\"[^\"]*\")?\s*\)", r"^\[[^\]]+\]:\s+(\S+)", r"\b(?:src|href)=\"([^\"]+)\"")
    for pattern in patterns:
        for match in re.finditer(pattern, text, flags=re.M):
            yield text.count("\n", 0, match.start()) + 1, match.group(1)


def check_links(pages, inside):
    """Failures of the relative links of these pages; those of pages in `inside` must stay in docs/."""
    count, failures = 0, []
    for page in pages:
        name = page.relative_to(ROOT)
        for line, target in links(page):
            if re.match(r"[a-z][a-z0-9+.-]*:", target, flags=re.I):
                continue
            count += 1
            place, _, fragment = target.partition("#")
            file = (page.parent / urllib.parse.unquote(place)).resolve() if place else page
            if not file.exists():
                failures.append(f"{name}:{line}: {target} leads nowhere")
            elif fragment and file.suffix == ".md" and fragment not in anchors(file):
                failures.append(f"{name}:{line}: {target}: no such heading")
            elif page in inside and DOCS != file and DOCS not in file.parents:
                failures.append(f"{name}:{line}: {target} leads out of the site")
    return count, failures


class Html(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.ids, self.links = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for key, value in attributes:
            if key == "id" and value:
                self.ids.add(value)
            if key in ("href", "src") and value and tag in ("a", "img"):
                self.links.append(value)


def check_site(site, pages):
    """Failures of the built site: pages that lack, links that lead nowhere."""
    failures, read, count = [], {}, 0
    for page in pages:
        built = site / page.relative_to(DOCS).with_suffix(".html")
        if built.name == "README.html":
            built = built.with_name("index.html")
        if not built.is_file():
            failures.append(f"{built}: not built")
    for file in site.rglob("*.html"):
        read[file.resolve()] = Html(file.read_text())
    for file, html in read.items():
        if file.name in ("404.html", "toc.html", "print.html"):
            continue
        for link in html.links:
            if re.match(r"[a-z][a-z0-9+.-]*:", link, flags=re.I) or link.startswith("/"):
                continue
            count += 1
            place, _, fragment = link.partition("#")
            target = (file.parent / urllib.parse.unquote(place)).resolve() if place else file
            if not target.exists():
                failures.append(f"{file.relative_to(site.resolve())}: {link} leads nowhere")
            elif fragment and target in read and urllib.parse.unquote(fragment) not in read[target].ids:
                failures.append(f"{file.relative_to(site.resolve())}: {link}: no such place")
    return count, failures


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("pages", nargs="*", type=Path, metavar="PAGE", help="only these pages")
    parser.add_argument("--beamsim", type=Path, default=ROOT / "target/release/beamsim", help="the program (default: target/release/beamsim)")
    parser.add_argument("--site", type=Path, help="also check the links of the site that mdBook has built here")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="work in this folder and keep it")
    parser.add_argument("--verbose", action="store_true", help="tell which lines were skipped")
    options = parser.parse_args()
    beamsim = options.beamsim.resolve()
    if not os.access(beamsim, os.X_OK):
        sys.exit(f"{beamsim}: no such program; build it, or name it with --beamsim")

    failures = []
    everything = sorted(DOCS.rglob("*.md")) + [ROOT / "README.md", ROOT / "CHANGELOG.md"]
    guide = [(DOCS / target).resolve() for _, target in links(DOCS / "SUMMARY.md") if target]
    for page in everything:
        if DOCS in page.parents and page not in guide and page.name != "SUMMARY.md":
            failures.append(f"{page.relative_to(ROOT)}: not in SUMMARY.md")
    run = [page for page in guide if page.is_file()] + [ROOT / "README.md"]
    if options.pages:
        run = [page.resolve() for page in options.pages]

    folder = options.keep.resolve() if options.keep else Path(tempfile.mkdtemp(prefix="beamsim-book-"))
    commands = 0
    try:
        pages = []
        for path in run:
            place = folder / re.sub(r"[^\w-]+", "_", str(path.relative_to(ROOT).with_suffix("")))
            shutil.rmtree(place, ignore_errors=True)
            pages.append(Page(path, place, beamsim))
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            for page in threads.map(Page.worked_through, pages):
                commands += page.commands
                failures += page.failures
                print(page.summary(), flush=True)
                for line in page.skipped if options.verbose else []:
                    print(f"    skipped: {line}")
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)

    count, found = check_links(everything, set(guide))
    failures += found
    print(f"links: {count} in {len(everything)} pages")
    if options.site:
        count, found = check_site(options.site.resolve(), [page for page in guide if page.is_file()])
        failures += found
        print(f"site: {count} links")
    for failure in failures:
        print(failure)
    print(f"{commands} commands, {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
