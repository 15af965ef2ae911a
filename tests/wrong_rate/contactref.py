"""What every answer with contact must satisfy: distances from surfaces and of beams, balance, sides; of a deck and its run alone."""
import numpy as np
from scenes_static import unit

# ---- distances ----------------------------------------------------------------------------------------------------

def from_line(p, a, b, ra, rb, ends=True):
    """Distances of points from the hull of spheres along a line, and the parts of the line at which the points are."""
    a, b = np.array(a), np.array(b); l = np.linalg.norm(b - a); e, q = (b - a) / l, (rb - ra) / l
    s = (p - a) @ e; d = np.linalg.norm(p - a - s[:, None] * e, axis=1); t = s + d * q / np.sqrt(1 - q * q)
    if ends: t = np.clip(t, 0, l)
    return np.hypot(d, s - t) - ra - q * t, s / l

def from_tube(p, s):
    """Distances from straight pieces of a tube, and which points are beyond its open ends."""
    ends = zip(s['through'], s['through'][1:])
    d, t = np.swapaxes([from_line(p, a, b, s['radius'], s['radius']) for a, b in ends], 0, 1); nearest = d.argmin(axis=0)
    return d.min(axis=0), (nearest == 0) & (t[0] < 0) | (nearest == len(d) - 1) & (t[-1] > 1)

def from_torus(p, s):
    a = unit(s['axis']); h = (p - s['at']) @ a
    return np.hypot(np.linalg.norm(p - s['at'] - h[:, None] * a, axis=1) - s['ring'], h) - s['radius']

def from_box(p, s):
    q = np.abs((p - s['at']) @ np.array([*s['axes'], np.cross(*s['axes'])]).T) - s['half']
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)

DISTANCE = dict(plane=lambda p, s: (p - s['point']) @ unit(s['normal']), torus=from_torus, box=from_box,
                sphere=lambda p, s: np.linalg.norm(p - s['at'], axis=1) - s['radius'],
                cylinder=lambda p, s: from_line(p, s['from'], s['to'], s['radius'], s['radius'], False)[0],
                capsule=lambda p, s: from_line(p, s['from'], s['to'], s['radius'], s['radius'])[0],
                cone=lambda p, s: from_line(p, s['from'], s['to'], *s['radius'])[0])

def distance(s, p):
    """Distances of points from a surface where it stood at the start, positive where beams may be."""
    d, beyond = from_tube(p, s) if s['kind'] == 'tube' else (DISTANCE[s['kind']](p, s), False)
    return np.where(beyond, np.inf, -d if s.get('side') == 'inside' else d)

def home(s, p, factor):
    """Points that go back with a surface to where it stood at the start."""
    if 'angle' not in s: return p - factor * np.array(s.get('move', [0., 0, 0]))
    k, angle = np.cross(np.eye(3), unit(s['rotate'])), factor * s['angle']
    return (p - s['about']) @ (np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k) + s['about']

def line(x, order, t):
    """Points of a beam at places counted in nodes, by the polynomials through the nodes of its elements."""
    k = np.minimum(t // order, (len(x) - 1) // order - 1).astype(int) * order; at = range(order + 1)
    return sum(np.prod([(t - k - j) / (i - j) for j in at if j != i], axis=0)[:, None] * x[k + i] for i in at)

def spread(x): return np.linspace(0, len(x) - 1, 4 * (len(x) - 1) + 1)

def pieces(a, b):
    """The vectors from all pieces of one polyline to those of another where they are closest."""
    A, u, B, v = a[:-1, None], np.diff(a, axis=0)[:, None], b[None, :-1], np.diff(b, axis=0)[None]
    dot, within, w = lambda x, y: (x * y).sum(-1), lambda x: np.clip(x, 0, 1), A - B
    uu, uv, vv = dot(u, u), dot(u, v), dot(v, v)
    s = within((uv * dot(v, w) - vv * dot(u, w)) / np.maximum(uu * vv - uv**2, 1e-12 * uu * vv)); t = within((s * uv + dot(v, w)) / vv)
    s = within((t * uv - dot(u, w)) / uu); t = within((s * uv + dot(v, w)) / vv)
    return t[..., None] * v - w - s[..., None] * u

def between(a, b):
    """The vector from one beam, given by nodes and order, to another where they are closest: the closest pieces, in ever finer parts."""
    t = [spread(a[0]), spread(b[0])]
    for _ in range(4):
        d = pieces(line(*a, t[0]), line(*b, t[1])); i = np.unravel_index(np.linalg.norm(d, axis=2).argmin(), d.shape[:2])
        t = [np.linspace(q[max(k - 1, 0)], q[min(k + 2, len(q) - 1)], 25) for q, k in zip(t, i)]
    return d[i]

# ---- rows of a run ------------------------------------------------------------------------------------------------

def vectors(run, nodes, names, row=-1):
    return np.array([[run.rows[row, run.cols.index(f'{n}.{c}')] for c in names] for n in nodes])

def nodes(d, part): return [n for n in d['output']['nodes'] if n.split(':')[0] == part]

def shape(d, run, part, row=-1):
    """The places of the nodes of a beam and its order."""
    return vectors(run, nodes(d, part), 'xyz', row), next(b['order'] for b in d['beam'] if b['name'] == part)

def seen(d, run, x, row):
    """Points of a row as the surface saw them at the start."""
    s, f = d['surface'][0], run.rows[row, 2]
    if 'on' not in s: return home(s, x, np.interp(f, *d['history']['out'].values()) if 'history' in s else f)
    (Q, at), (Q0, at0) = [(vectors(run, ['car'], [f'd{i}{c}' for i in '123' for c in 'xyz'], k).reshape(3, 3),
                           vectors(run, ['car'], 'xyz', k)) for k in (row, 0)]
    return (x - at) @ Q.T @ Q0 + at0

def depth(d, run):
    """How deep the deepest point is at the end, as a part of what is allowed."""
    k = d['contact'][0]
    if 'with' in k: return (sum(k['radius'].values()) - np.linalg.norm(between(*(shape(d, run, b) for b in 'bc')))) / k['penetration']
    if 'nodes' in k: x = vectors(run, k['nodes'], 'xyz')
    else: x, order = shape(d, run, 'b'); x = line(x, order, spread(x))
    return (k['radius'] - distance(d['surface'][0], seen(d, run, x, -1)).min()) / k.get('penetration', k['radius'] / 1000)

def unbalanced(d, run):
    """The largest sum of the forces on a beam, as a part of the largest force, and of moments about the origin, where no line load acts
    and the surface stands on the ground."""
    worst, (pressed, twisted) = 0., vectors(run, ['k'], ['fx', 'fy', 'fz', 'mx', 'my', 'mz'])[0].reshape(2, 3)
    for part, sign in [('b', 1)] + [('c', -1)] * ('with' in d['contact'][0]):
        at = nodes(d, part); x, f, m = (vectors(run, at, n) for n in ('xyz', ['fx', 'fy', 'fz'], ['mx', 'my', 'mz']))
        ends = next(b['through'] for b in d['beam'] if b['name'] == part)
        length = np.linalg.norm(np.subtract(*(d['point'][e] for e in ends)))
        along = sum((length * np.array(l['force']) for l in d.get('load', []) if l.get('along') == part), np.zeros(3))
        tip = sum((np.array(l['force']) for l in d.get('load', []) if l.get('at') in ends), np.zeros(3))
        least = 1e-9 * d['section']['s']['EA']                              # of which round-off is left where nothing acts
        size = max(least, *(np.abs(v).max() for v in (f, pressed, along, tip)))
        off = [np.abs(f.sum(axis=0) + sign * pressed + along + tip).max()]
        if not along.any() and not any('on' in s for s in d.get('surface', [])):
            m = (np.cross(x, f) + m).sum(axis=0) + np.cross(x[-1], tip) + sign * twisted
            off.append(np.abs(m).max() / max(length, np.abs(x).max()))
        worst = max(worst, *(o / size for o in off))
    return worst

def crossed(d, run):
    """Does a beam come to the other side along the chords between two rows? A wide way round in one level looks the same. Beams along each
    other are not looked at: they may slide off each other sideways."""
    rows = range(len(run.rows))
    if 'with' in d['contact'][0]:
        b, c = (unit(x[-1] - x[0]) for x, _ in (shape(d, run, part, 0) for part in 'bc'))
        if abs(b @ c) > .97: return False
        gaps = [unit(between(*(shape(d, run, b, i) for b in 'bc'))) for i in rows]
        return any(a @ b < -.5 for a, b in zip(gaps, gaps[1:]))
    s = d['surface'][0]; x = [seen(d, run, shape(d, run, 'b', i)[0], i) for i in rows]
    thick = 0 if s['kind'] == 'plane' else .5 * np.min(s.get('radius', s.get('half')))
    return any(distance(s, a + t * (b - a)).min() < -thick for a, b in zip(x, x[1:]) for t in np.linspace(0, 1, 11))

def insane(d, run, fine):
    """What is wrong with a fall: momentum, energy, friction, depth, and the end of a ball's way beside that in quarters of the steps."""
    t, total, kinetic = run.col('time'), run.col('energy.total'), run.col('energy.kinetic').max(); out = []
    ends = [d['point'][e] for e in 'ae'] if 'beam' in d else None
    mass = d['section']['s']['rhoA'] * np.linalg.norm(np.subtract(*ends)) if ends else d['body'][0]['mass']
    f, p = (np.array([run.col(n + c) for c in 'xyz']).T for n in ('k.f', 'momentum.p'))
    given = np.vstack([np.zeros(3), np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(t)[:, None], axis=0)]) + mass * np.outer(t, d['gravity'])
    lost, drift = np.abs(p - p[0] - given).max() / np.linalg.norm(p[0]), np.ptp(total) / kinetic
    if lost > .03: out.append(f'momentum off by {lost:.2g}')
    if drift > .05: out.append(f'energy off by {drift:.2g}')
    if np.diff(run.col('energy.friction')).min() < -.01 * kinetic: out.append('friction gives energy')
    limit = d['contact'][0]['friction'] * run.col('k.normal') * (1 + 1e-6)
    if np.any(run.col('k.friction') > limit): out.append('friction beyond its limit')
    if depth(d, run) > 1: out.append('too deep at the end')
    if 'body' in d and fine.ok:
        way = vectors(fine, ['ball'], 'xyz') - vectors(fine, ['ball'], 'xyz', 0)
        off = np.abs(vectors(run, ['ball'], 'xyz') - vectors(fine, ['ball'], 'xyz')).max() / np.abs(way).max()
        if off > .1: out.append(f'{off:.2g} of the way off')
    return out
