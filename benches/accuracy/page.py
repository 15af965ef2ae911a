"""Writes the tables of `docs/accuracy.md` and `docs/accuracy/measurements.md` from what is stored, each between its marks;
the prose between them is by hand."""

import csv
import re
import statistics

import scenes

# A run of a frontier is worth a line if its error is that much smaller than that of the line before.
WORTH_TELLING = 0.5


def write(store, pages):
    """Replaces what stands between `<!-- table: NAME -->` and `<!-- end -->`."""
    texts = {page: page.read_text() for page in pages}
    for name, table in tables(store).items():
        marked = re.compile(rf"(<!-- table: {re.escape(name)} -->\n).*?(<!-- end -->)", re.S)
        page = next((page for page, text in texts.items() if marked.search(text)), None)
        if page is None:
            raise SystemExit(f"no page has a place for the table {name}")
        texts[page] = marked.sub(lambda match: match[1] + "\n".join(table) + "\n" + match[2], texts[page])
    for page, text in texts.items():
        page.write_text(text)


def tables(store):
    found = {f"frontier of {name}": frontier(read(store / f"{name}.csv")) for name in scenes.STUDIES if (store / f"{name}.csv").exists()}
    found["as the decks stand"] = as_they_stand(store)
    if (store / "rivals.csv").exists():
        found["rivals"] = rivals(read(store / "rivals.csv"))
    if (store / "targets.csv").exists():
        rows = read(store / "targets.csv")
        found |= {"targets": targets(rows), "targets in short": targets_in_short(rows)}
    if (store / "bars.csv").exists():
        rows = read(store / "bars.csv")
        found |= {"bars": bars(rows), "bars in short": bars_in_short(rows)}
    if (store / "forecasts.csv").exists():
        found["forecasts in short"] = forecasts_in_short(read(store / "forecasts.csv"))
    return found


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def frontier(runs):
    lines = ["| error | CPU | iterations | limited by | with |", "| ---: | ---: | ---: | --- | --- |"]
    told = float("inf")
    for run in sorted((run for run in runs if run["frontier"] == "true"), key=lambda run: -float(run["error"])):
        if float(run["error"]) < WORTH_TELLING * told:
            told = float(run["error"])
            lines.append(f"| {told:.1e} | {time(float(run['cpu_seconds']))} | {run['iterations']} | {run['limited_by']} | {settings(run)} |")
    return lines


def as_they_stand(store):
    """What the settings of the decks themselves, which are the paper's in its scenes, cost and are worth."""
    lines = ["| scene | settings of the deck | error | CPU | cheapest with the same accuracy | CPU | | most accurate in the same time | error |",
             "| --- | --- | ---: | ---: | --- | ---: | ---: | --- | ---: |"]
    for name in scenes.STUDIES:
        if not (store / f"{name}.csv").exists():
            continue
        runs = [run for run in read(store / f"{name}.csv") if run["status"] == "finished"]
        own = next((run for run in runs if not run["settings"]), None)
        if own is None:
            continue
        cost = lambda run: float(run["cpu_seconds"])
        error = lambda run: float(run["error"])
        cheapest = min((run for run in runs if error(run) <= error(own)), key=cost)
        best = min((run for run in runs if cost(run) <= 1.05 * cost(own)), key=error)
        lines.append(f"| `{name}` | {settings(own)} | {error(own):.1e} | {time(cost(own))} | {settings(cheapest)} | {time(cost(cheapest))} "
                     f"| {cost(own) / cost(cheapest):.1f} x | {settings(best)} | {error(best):.1e} |")
    return lines


RIVALS = ["Exudyn", "OpenSees, ExactFrame"]
ERRORS = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]


def rivals(rows):
    """For each error the least time of beamsim, and those of the others over it."""
    lines = ["| scene | error at most | beamsim | " + " | ".join(RIVALS) + " |", "| --- | ---: | --- |" + " ---: |" * len(RIVALS)]
    for name in dict.fromkeys(row["scene"] for row in rows):
        for error in ERRORS:
            own = cheapest_of(rows, name, "beamsim", error)
            others = [cheapest_of(rows, name, rival, error) for rival in RIVALS]
            if own is None and not any(others):
                continue
            mine = f"{time(float(own['cpu']))}, {own['program'].removeprefix('beamsim, ')}" if own else "not reached"
            ratio = lambda other: "not reached" if other is None else f"{float(other['cpu']) / float(own['cpu']):.1f} x" if own else time(float(other["cpu"]))
            lines.append(f"| {name} | {error:g} | {mine} | " + " | ".join(map(ratio, others)) + " |")
    return lines


def cheapest_of(rows, scene_name, program, error):
    own = [row for row in rows if row["scene"] == scene_name and row["program"].startswith(program) and float(row["error"]) <= error]
    return min(own, key=lambda row: float(row["cpu"]), default=None)


def settings(run):
    """Order, interpolation, elements and step of a run of a study."""
    words = []
    if run["order"]:
        words.append(f"order {run['order']}")
    words += [run[key] for key in ("interpolation", "scheme") if run[key]]
    if run["elements"]:
        words.append(f"{run['elements']} element{'' if run['elements'] == '1' else 's'}")
    words += [steps(float(run["step"]))] if run["step"] else []
    return ", ".join(words)


def steps(factor):
    """Over the step of the deck."""
    return {2.0: "double step", 1.0: "step of the deck", 0.5: "half step", 0.25: "quarter step"}.get(factor, f"step x {factor:g}")


def time(seconds):
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.0995 else f"{seconds:.2f} s"


def scene(deck):
    return deck.rsplit("/", 1)[1].removesuffix(".toml")


def targets(rows):
    """A line a scene: for each target the estimate and the true error."""
    lines = ["| scene | " + " | ".join(f"{float(target):g}" for target in scenes.TARGETS) + " |", "| --- |" + " --- |" * len(scenes.TARGETS)]
    for deck in dict.fromkeys(row["deck"] for row in rows):
        own = {float(row["target"]): row for row in rows if row["deck"] == deck}
        lines.append(f"| `{scene(deck)}` | " + " | ".join(target(own[t]) for t in scenes.TARGETS) + " |")
    return lines


def target(row):
    if row["result"] != "reached":
        return "not reached" if "limit" in row["result"] else row["result"]
    if not row["error"]:
        return f"{float(row['estimate']):.1e} / –"
    missed = float(row["error"]) > float(row["target"])
    return f"{float(row['estimate']):.1e} / {'**' if missed else ''}{float(row['error']):.1e}{'**' if missed else ''}"


def targets_in_short(rows):
    """What became of all runs, and their times over those of the cheapest variants. There are some of every kind, or what was measured is no good."""
    judged = [row for row in rows if row["result"] == "reached" and row["error"]]
    met = [row for row in judged if float(row["error"]) <= float(row["target"])]
    worst = max((float(row["error"]) / float(row["target"]) for row in judged), default=0.0)
    refused = [row for row in rows if row["result"] != "reached"]
    effect = sorted(float(row["estimate"]) / float(row["error"]) for row in judged if float(row["error"]) > 1e-12)
    timed = [row for row in rows if row.get("seconds")]
    own = sorted(float(row["seconds"]) / float(row["cheapest"]) for row in timed)
    searched = sorted(float(row["searched"]) / float(row["cheapest"]) for row in timed)
    return [
        f"Of {len(rows)} searches in {len({row['deck'] for row in rows})} scenes {len(rows) - len(refused)} finished within {scenes.BUDGET} s and {len(refused)} ended with an error. "
        f"Of the {len(judged)} whose true error is known {len(met)} are below the target ({100 * len(met) / max(len(judged), 1):.0f} %), the worst is {worst:.2g} times it. "
        f"Estimates over true errors: median {statistics.median(effect):.2g}, from {effect[0]:.2g} to {effect[-1]:.2g}.",
        "",
        f"In the {len(timed)} for which a study without options has an equally accurate variant, the chosen run takes {statistics.median(own):.2g} times the CPU time "
        f"of the cheapest such variant (median; 90 % below {tenth(own):.2g}, the worst {own[-1]:.2g}), and including the search {statistics.median(searched):.2g} times "
        f"(90 % below {tenth(searched):.2g}, the worst {searched[-1]:.2g}): whole processes, in alternating runs.",
    ]


def tenth(ordered):
    """What nine in ten are below."""
    return ordered[min(len(ordered) - 1, int(0.9 * len(ordered)))]


def bars(rows):
    """A line a scene: how many outputs have an error that is inside, and how wide bars are."""
    lines = ["| scene | outputs | inside at all rows | inside at the end | width, median | widest |", "| --- | ---: | ---: | ---: | ---: | ---: |"]
    for deck in dict.fromkeys(row["deck"] for row in rows):
        own = [row for row in rows if row["deck"] == deck]
        widths = sorted(float(row["width"]) for row in own)
        lines.append(f"| `{scene(deck)}` | {len(own)} | {count(own, 'inside')} | {count(own, 'inside_at_the_end')} | {statistics.median(widths):.2g} | {widths[-1]:.2g} |")
    return lines


def count(rows, key):
    return sum(row[key] == "True" for row in rows)


def bars_in_short(rows):
    widths = sorted(float(row["width"]) for row in rows)
    share = lambda key: 100 * count(rows, key) / len(rows)
    return [
        f"Of {len(rows)} outputs of {len({row['deck'] for row in rows})} scenes {share('inside_at_the_end'):.0f} % have their largest error inside the bar at the last row, and for {share('inside'):.0f} % this is true at every row. "
        f"Bars are {statistics.median(widths):.2g} times as wide as the error (median; 90 % below {tenth(widths):.2g}, the widest {widths[-1]:.2g}).",
    ]


def forecasts_in_short(rows):
    ratios = sorted(float(row["foretold"]) / float(row["seconds"]) for row in rows)
    right = sum(0.5 <= ratio <= 2.0 for ratio in ratios)
    longest = max(float(row["seconds"]) for row in rows)
    return [
        f"Of the {len(rows)} decks of `decks/` (without `hard/long`) that take 0.1 s and more, up to {longest:.0f} s, {right} took between half and twice the estimated time; "
        f"the ratio of estimated to actual time is from {ratios[0]:.2f} to {ratios[-1]:.2f}, median {statistics.median(ratios):.2f}.",
    ]
