"""The scenes that all programs simulate, values that independent programs agree on, and what the peer scripts share.

A script `peer_NAME.py` takes one job as JSON in its first argument (scene, elements, levels or step, and settings of
its own) and prints one JSON line: see `report`.
"""

import json
import math
import sys
import time

# Sections by their resultants; J are rotary inertias per length.
SECTIONS = {
    "S1": {"EA": 1e4, "GA": 1e4, "GJ": 1e2, "EI": 1e2, "rhoA": 1.0, "rhoJ": (1.0, 1.0, 1.0)},
    "S2": {"EA": 1e7, "GA": 5e6, "GJ": 5e6 / 6, "EI": 1e7 / 12, "rhoA": 1.0, "rhoJ": (1.0, 1.0, 1.0)},
    "S3": {"EA": 1e6, "GA": 1e6, "GJ": 1e3, "EI": 1e3, "rhoA": 1.0, "rhoJ": (20.0, 10.0, 10.0)},
    "S5": {"EA": 1e4, "GA": 1e4, "GJ": 5e2, "EI": 5e2, "rhoA": 1.0, "rhoJ": (10.0, 10.0, 10.0)},
    "S6": {"EA": 1e6, "GA": 1e6, "GJ": 1e2, "EI": 1e2, "rhoA": 1.0, "rhoJ": (0.01, 0.005, 0.005)},
}
SECTIONS["S4"] = SECTIONS["S1"]

LENGTH = 10.0  # of the straight beams and of each leg of the right angle
CIRCLES = {"S1": 1.0, "S4": 0.01}  # how far the end moment rolls the beam up
BEND_RADIUS, BEND_ANGLE, BEND_FORCE = 100.0, math.pi / 4, 600.0
END_TIME = {"S3": 30.0, "S5": 15.0, "S6": 60.0}  # in S6 damped motion has come to rest
FLOOR_GAP, FLOOR_RADIUS, FLOOR_WEIGHT = 0.01, 0.1, 0.0144  # S6: twice the weight per length that lays the tip flat
FLYING_START, FLYING_END = (6.0, 0.0, 0.0), (0.0, 8.0, 0.0)  # the loads act at the start

# S2: shooting and several programs. S3: largest and smallest uz, uz at t = 30. S5: ends at t = 15.
BEND_TIP = (15.68480, 47.15044, 53.47486)
RIGHT_ANGLE_VALUES = {"elbow max": 6.1128, "tip min": -9.727, "tip max": 8.252, "elbow end": -0.2236, "tip end": 0.1687}
FLYING_ENDS = {"start": (69.364, 2.200, -2.546), "end": (61.377, 6.012, 1.984)}


def roll_up_moment(scene):
    """The end moment of S1 and S4 about z."""
    return CIRCLES[scene] * 2 * math.pi * SECTIONS[scene]["EI"] / LENGTH


def roll_up_exact(scene, fraction):
    """Where the point at this fraction of the length comes to lie: on a circular arc."""
    angle = CIRCLES[scene] * 2 * math.pi
    radius = LENGTH / angle
    return (radius * math.sin(angle * fraction), radius * (1 - math.cos(angle * fraction)), 0.0)


def floor_middle():
    """Where the middle of the beam of S6 comes to lie by linear theory, if slope and moment vanish where it meets the floor."""
    free = (72 * SECTIONS["S6"]["EI"] * FLOOR_GAP / FLOOR_WEIGHT) ** 0.25
    part = 0.5 * LENGTH / free
    return (0.5 * LENGTH, 0.0, -3 * FLOOR_GAP * (part**4 - 8 / 3 * part**3 + 2 * part**2))


def right_angle_force(t):
    """Force along z at the elbow of S3."""
    return 50.0 * max(0.0, min(t, 2.0 - t))


def flying_pulse(t):
    """T(t) of S5: the force is T/10 along x, the moment (0, -T/2, -T)."""
    return 80.0 * max(0.0, min(t, 5.0 - t))


def line(a, b, n):
    """n + 1 points from a to b."""
    return [tuple(p + (q - p) * i / n for p, q in zip(a, b)) for i in range(n + 1)]


def nodes(scene, n):
    """The n + 1 nodes of a scene with n two-node elements, in order along the beam."""
    if scene in CIRCLES or scene == "S6":
        return line((0.0, 0.0, 0.0), (LENGTH, 0.0, 0.0), n)
    if scene == "S2":
        angles = [BEND_ANGLE * i / n for i in range(n + 1)]
        return [(BEND_RADIUS * (1 - math.cos(a)), BEND_RADIUS * math.sin(a), 0.0) for a in angles]
    if scene == "S3":
        elbow, tip = (LENGTH, 0.0, 0.0), (LENGTH, LENGTH, 0.0)
        return line((0.0, 0.0, 0.0), elbow, n // 2) + line(elbow, tip, n // 2)[1:]
    return line(FLYING_START, FLYING_END, n)



def job():
    """The job of this peer script."""
    return json.loads(sys.argv[1])


class Clock:
    """CPU seconds of this process in a `with` block."""

    def __enter__(self):
        self.start = time.process_time()
        return self

    def __exit__(self, *_):
        self.cpu = time.process_time() - self.start


def report(version, ok, iterations, cpu, places=None, history=None):
    """Prints the result: `places` of named nodes at the end, or in S3 `history` rows (t, uz of elbow, uz of tip)."""
    result = {"version": version, "ok": bool(ok), "iterations": iterations, "cpu": cpu}
    result["places"] = {name: [float(x) for x in place] for name, place in (places or {}).items()}
    result["history"] = [[float(x) for x in row] for row in (history or [])]
    print("\n" + json.dumps(result), flush=True)
