"""Plots error over time of several programs, one SVG a scene: `plot_curves.py rivals.csv FOLDER`."""

import csv
import sys

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

import curves

# Okabe and Ito: told apart in colour blindness, and by marks and dashes in print.
STYLES = {
    "beamsim, order 1": ("#0072B2", "o", "-"),
    "beamsim, order 2": ("#009E73", "s", "-"),
    "beamsim, order 3": ("#000000", "D", "-"),
    "Exudyn": ("#D55E00", "^", "--"),
    "OpenSees, ExactFrame": ("#CC79A7", "X", ":"),
}


def frontier(runs):
    """Those that no other run beats in error and time, the cheapest first."""
    best, kept = float("inf"), []
    for cpu, error in sorted((float(run["cpu"]), float(run["error"])) for run in runs):
        if error < 0.95 * best:
            best = error
            kept.append((cpu, error))
    return kept


def plot(scene, runs, path):
    figure, axes = plt.subplots(figsize=(7.2, 4.6), layout="constrained")
    for name, (colour, mark, dash) in STYLES.items():
        own = [run for run in runs if run["program"] == name]
        if own:
            axes.plot([float(r["cpu"]) for r in own], [float(r["error"]) for r in own], mark, color=colour, markersize=3, alpha=0.3)
            times, errors = zip(*frontier(own))
            axes.plot(times, errors, dash, marker=mark, color=colour, markersize=6, label=name)
    axes.set(xscale="log", yscale="log", title=curves.TITLES[scene], xlabel="CPU time / s", ylabel="error, relative")
    axes.grid(True, which="major", color="#dddddd")
    axes.set_axisbelow(True)
    figure.legend(loc="outside right upper", frameon=False)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


matplotlib.rcParams["svg.hashsalt"] = "beamsim"
with open(sys.argv[1], newline="") as file:
    rows = list(csv.DictReader(file))
for scene in dict.fromkeys(row["scene"] for row in rows):
    plot(scene, [row for row in rows if row["scene"] == scene], f"{sys.argv[2]}/rivals_{scene}.svg")
