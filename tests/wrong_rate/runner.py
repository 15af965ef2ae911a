"""Writes decks, runs beamsim on them, reads what came back."""
import csv, json, os, re, shutil, subprocess, tempfile
import numpy as np

def value(v):
    """A Python value as TOML."""
    if isinstance(v, (bool, np.bool_)): return 'true' if v else 'false'
    if isinstance(v, (int, np.integer)): return str(int(v))
    if isinstance(v, (float, np.floating)): return repr(float(v))
    if isinstance(v, str): return json.dumps(str(v))
    if isinstance(v, dict): return '{ ' + ', '.join(f'{k} = {value(x)}' for k, x in v.items()) + ' }'
    return '[' + ', '.join(value(x) for x in v) + ']'

def toml(deck, comment=''):
    """A deck as text: plain keys first, then tables, tables by name and arrays of tables."""
    out = ['# ' + line for line in comment.split('\n')] if comment else []
    array = lambda v: isinstance(v, list) and v and isinstance(v[0], dict)
    body = lambda t: [f'{k} = {value(x)}' for k, x in t.items()]
    out += [f'{k} = {value(v)}' for k, v in deck.items() if not isinstance(v, dict) and not array(v) and v != []]
    for k, v in deck.items():
        if isinstance(v, dict):
            named = v.items() if k in ('section', 'material', 'history') else [(None, v)]
            for name, t in named: out += [f'\n[{k}.{name}]' if name else f'\n[{k}]'] + body(t)
        elif array(v):
            for t in v: out += [f'\n[[{k}]]'] + body(t)
    return '\n'.join(out) + '\n'

def _number(text):
    try: return float(text)
    except ValueError: return np.nan

class Run:
    """What one run of beamsim left: rc, fail (name of the failure), warn (lines), rows and cols of the history,
    events, counters, modes (omega, growth) and buckling (loads)."""

    def __init__(self, text, args, rc, err, out):
        self.text, self.args, self.rc, self.err = text, list(args), rc, err
        self.warn = [line for line in err.split('\n') if line.startswith('warning')]
        named = re.search(r'error\[(\w+)\]', err)
        self.fail = named.group(1) if named else None
        try:
            with open(f'{out}/run.json') as f: self.info = json.load(f)
        except (OSError, ValueError): self.info = {}
        self.events, self.counters = self.info.get('events', []), self.info.get('counters', {})
        read = self._table
        self.cols, self.rows = read(f'{out}/history.csv' if rc == 0 else f'{out}/history.partial.csv')
        modes, buckling = read(f'{out}/modes.csv')[1], read(f'{out}/buckling.csv')[1]
        self.modes = None if modes is None else modes[:, 2:4]
        self.buckling = None if buckling is None else buckling[:, 2]

    @staticmethod
    def _table(path):
        try:
            with open(path) as f: lines = list(csv.reader(f))
            return lines[0], np.array([[_number(x) for x in line] for line in lines[1:]], ndmin=2)
        except (OSError, ValueError, IndexError): return None, None

    @property
    def ok(self): return self.rc == 0 and self.rows is not None and self.rows.size > 0

    @property
    def load(self): return float(self.rows[-1, 2]) if self.rows is not None and self.rows.size else None

    def full(self):
        """Has the run come to the load factor 1?"""
        return self.ok and abs(self.load - 1) < 1e-9

    def col(self, name): return self.rows[:, self.cols.index(name)]

    def ucols(self): return [c for c in self.cols if c.split('.')[-1] in ('ux', 'uy', 'uz')]

    def end(self):
        """Displacements of the last row, a line a node."""
        return np.array([self.rows[-1, self.cols.index(c)] for c in self.ucols()]).reshape(-1, 3)

class Bench:
    """Runs decks in a folder of its own; a run longer than `limit` seconds counts as refused, named `timeout`."""

    def __init__(self, binary, limit=20.):
        self.binary, self.limit, self.runs = binary, limit, 0
        self.folder = tempfile.mkdtemp(prefix='wrong_rate_')

    def run(self, deck, args=(), limit=None):
        self.runs += 1; text = toml(deck)
        path, out = os.path.join(self.folder, 'deck.toml'), os.path.join(self.folder, 'out')
        with open(path, 'w') as f: f.write(text)
        shutil.rmtree(out, ignore_errors=True)
        cmd = [self.binary, 'run', path, '--out', out, '--quiet', '--threads', '1', *args]
        try:
            p = subprocess.run(cmd, capture_output=True, text=True, timeout=limit or self.limit)
            rc, err = p.returncode, p.stderr
        except subprocess.TimeoutExpired: rc, err = -9, 'error[timeout]'
        return Run(text, args, rc, err, out)

    def close(self): shutil.rmtree(self.folder, ignore_errors=True)
