#!/usr/bin/env python3
"""Critical loads and stability do not depend on how a scene is written: decks in three unit systems and five orientations, with their joints
in every order. Buckling loads must be those that the deck expects, verdicts and numbers of negative pivots those of the deck as written.

    python3 otherwise.py --beamsim BIN DECK.toml ...
"""
import argparse, itertools, json, math, os, subprocess, sys, tempfile
import numpy as np
from runner import Bench
from transforms import place, rotation, units

UNITS = [(1., 1., 1.), (1e3, 1., 1.), (1e-3, 1e-6, 60.)]     # lengths, forces, times: as written; a thousandth; odd
MOST_ORDERS = 24

def resolved(bench, path):
    """The deck as the program read it, with numbers in place of expressions."""
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([bench.binary, 'run', path, '--out', out, '--quiet'], check=True, capture_output=True)
        with open(f'{out}/run.json') as f: return json.load(f)['deck']

def expected(d):
    """The expectations of buckling loads: (index, value, tolerance)."""
    for e in d.pop('expect', []):
        column = e.get('column', '')
        if column.startswith('buckling') and column.endswith('.load'):
            value = float(e['value'])
            yield int(column[8:-5]) - 1, value, e.get('rtol', 0) * abs(value) + e.get('atol', 0)

def verdicts(run): return [(s['verdict'], s['negative']) for s in run.info.get('stability', [])]

def main():
    p = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    p.add_argument('--beamsim', required=True); p.add_argument('decks', nargs='+'); a = p.parse_args()
    bench, failed, g = Bench(os.path.abspath(a.beamsim)), 0, np.random.default_rng(34)
    for path in a.decks:
        d = resolved(bench, path); loads = list(expected(d)); joints = d.get('joint', [])
        for k in ('title', 'param', '$schema'): d.pop(k, None)
        d.setdefault('output', dict(nodes=[]))
        every = math.factorial(len(joints)) <= MOST_ORDERS
        orders = list(itertools.permutations(range(len(joints)))) if every else [g.permutation(len(joints)) for _ in range(MOST_ORDERS)]
        worst, runs, other, efforts = 0., 0, 0, set()
        base = verdicts(bench.run(d))
        for order, scale, turn in itertools.product(orders, UNITS, range(5)):
            e = dict(d, joint=[joints[i] for i in order]) if joints else dict(d)
            r = bench.run(units(place(e, rotation(g) if turn else np.eye(3)), *scale)); runs += 1
            found = [] if r.buckling is None else r.buckling
            worst = max([worst] + [abs(found[k] - value) / allowed if k < len(found) else np.inf for k, value, allowed in loads])
            other += r.rc != 0 or verdicts(r) != base; efforts.add(r.counters.get('iterations'))
        failed += worst > 1 or other > 0
        print(f'{path}: {len(loads)} loads in {runs} ways, farthest off by {worst:.2g} of the tolerance; {other} other verdicts than '
              f'{base}; iterations {sorted(n for n in efforts if n is not None)}')
    bench.close(); return 1 if failed else 0

if __name__ == '__main__': sys.exit(main())
