"""Random scenes of contact, which begin apart: a beam and a surface, two beams, falls. Made in lengths and forces of one, then turned
and put in other units. Each generator gives (deck, name, group), or None where its parts miss each other or meet where they are held."""
import numpy as np
from contactref import DISTANCE, distance, home
from scenes_static import beam, direction, power, unit
from transforms import place, rotation, units

SPOTS, TURNED = ('at', 'from', 'to', 'point', 'about', 'through', 'move'), ('normal', 'axis', 'axes', 'rotate')
ALL = ['ux', 'uy', 'uz', 'rx', 'ry', 'rz']

def body(g, kind, c, u):
    """A surface about the place c, or a plane through it that faces against u."""
    e, R, f = direction(g), power(g, -1.5, .2), direction(g); s = dict(kind=kind, radius=R)
    ends = {'from': c - e * R * g.uniform(.5, 3), 'to': c + e * R * g.uniform(.5, 3)}
    if kind == 'plane': return dict(kind=kind, point=c, normal=.3 * e - u)
    if kind == 'box': return dict(kind=kind, at=c, half=R * g.uniform(.5, 2, 3), axes=[e, unit(np.cross(e, f))])
    if kind == 'sphere': return dict(s, at=c)
    if kind == 'torus': return dict(s, at=c, axis=e, ring=R * g.uniform(1.3, 4))
    if kind == 'tube': return dict(s, through=[ends['from'], c, ends['to'] + f * R], radius=R / 2, smooth=False)
    return dict(s, **ends, **(dict(radius=[R * .8, R * g.uniform(.2, .8)]) if kind == 'cone' else {}))

def hollow(g, kind):
    """A surface with the beam inside. (A box is wide in one direction: a tip in its corners does not converge, a known limit.)"""
    e = unit([1, *g.uniform(-.1, .1, 2)]); a, m, b = -.4 * e, .5 * e, 1.4 * e; s = dict(kind=kind, side='inside', radius=1e-3)
    if kind == 'box': return dict(kind=kind, side='inside', at=m, half=np.array([.8, 1e-3, 1.]), axes=[e, unit(np.cross(e, direction(g)))])
    if kind == 'sphere': return dict(s, at=m)
    if kind == 'torus': ring = g.uniform(2, 9); return dict(s, at=np.array([.5, 0, -ring]), axis=np.array([0., 1, 0]), ring=ring)
    if kind == 'tube': return dict(s, through=[a, m + .03 * direction(g), b], smooth=False)
    return dict(s, **{'from': a, 'to': b})

def apart(s, p, u, room):
    """The surface so placed along u, or so wide, that it is apart from points by `room`; None where it misses them."""
    if s.get('side') == 'inside':
        key = 'half' if 'half' in s else 'radius'
        return {**s, key: s[key] + room - distance(s, p).min()}
    at = lambda far: {k: np.array(v) + far * u if k in SPOTS else v for k, v in s.items()}; far = 12.
    while far > -6:
        gap = distance(at(far), p).min() - room; far -= gap
        if gap < 1e-6: return at(far)
    return None

def start(g, fixed):
    """A beam of length one, held as a cantilever or at both ends, with its contact."""
    o, n, lam = int(g.integers(1, 4)), int(power(g, .31, 1.6)), power(g, 1.3, 2.5)
    held = [dict(at='a', fix=ALL)] if fixed else [dict(at='a', fix=ALL[:4]), dict(at='e', fix=['uy', 'uz'])]
    k = dict(name='k', beams=['b'], radius=power(g, -2.3, -1.2), friction=0. if g.random() < .34 else float(g.choice([1, g.uniform(0, 1)])))
    if g.random() < .3: k['penetration'] = k['radius'] * power(g, -5, -2)
    s = dict(EA=lam**2, GA=.4 * lam**2, GJ=.8, EI=[1., float(g.choice([1, 1, 3, .3]))])
    return dict(point=dict(a=[0., 0, 0], e=[1., 0, 0]), section=dict(s=s), beam=[beam('b', 'a', 'e', elements=n, order=o)], support=held,
                contact=[k], output=dict(nodes=[f'b:{i}' for i in range(n * o + 1)], columns=['x', 'reaction', 'd', 'contact']),
                stage=[dict(kind='static', steps=int(power(g, 0, 1.7)))])

def moved(d, at, way):
    """Nodes go some way: the displacements that hold them become motions."""
    for s in [s for s in d['support'] if s['at'] in at]:
        d.setdefault('motion', []).extend({'at': s['at'], f: float(way['xyz'.index(f[1])])} for f in s['fix'] if f[0] == 'u')
        s['fix'] = [f for f in s['fix'] if f[0] == 'r']
    d['support'] = [s for s in d['support'] if s['fix']]

def carried(d, s, u, depth, arm):
    """A surface on a body that moves against u, or at the end of an elastic arm whose other end does."""
    car = np.reshape(next(s[k] for k in ('at', 'from', 'point', 'through') if k in s), (-1, 3))[0]
    d['point']['car'] = list(car); s['on'] = 'car'; d['output']['nodes'].append('car'); root = 'far' if arm else 'car'
    if arm: d['point']['far'] = list(car + u); d['beam'].append(beam('arm', 'far', 'car', elements=3, order=2))
    else: d['body'] = [dict(at='car', mass=1.)]
    d['support'].append(dict(at=root, fix=list(ALL))); moved(d, [root], -depth * u)

def pushed(g):
    """A beam and a surface that come together in some way."""
    fixed, inside, turn, g0 = g.random() < .6, g.random() < .25, g.uniform(0, 2 * np.pi), power(g, -3, -1); d = start(g, fixed)
    r = d['contact'][0]['radius']; u = unit([g.normal() * .3 if fixed else 0, np.cos(turn), np.sin(turn)])
    c = np.cross(u, [1, 0, 0]) * r * g.choice([0, g.normal()]) + [g.uniform(.4, 1.05) if fixed else g.uniform(.25, .75), 0, 0]
    kind = str(g.choice(['sphere', 'cylinder', 'capsule', 'torus', 'box', 'tube'] if inside else ['plane', 'cone', *DISTANCE, 'tube']))
    p, depth = np.linspace(0, 1, 401)[:, None] * [1, 0, 0], g0 + g.uniform(.02, .3 if fixed else .15)
    s = apart(hollow(g, kind) if inside else body(g, kind, c, u), p, u, r + g0); w = unit(np.cross(u, direction(g)))
    if s is None: return None
    way = str(g.choice(['load', 'swing'] if inside else ['move', 'turn', 'history', 'motion', 'body', 'arm', 'load']))
    path = dict(move=-depth * u)
    if way == 'swing': path = dict(rotate=np.cross([1, 0, 0], u), about=np.zeros(3), angle=depth)
    if way == 'turn': path = dict(rotate=np.cross(w, u), about=c + 1.5 * w, angle=depth / 1.5)
    if way == 'load': path = {}
    held = np.array([[0, 0, 0], [1, 0, 0]])[:1 if fixed else 2]; room = r + (.99 * g0 if inside else .05)
    if min(distance(s, home(path, held, f)).min() for f in np.linspace(0, 1, 9)) < room: return None
    if way in ('move', 'turn', 'history', 'swing'): s.update(path)
    if way == 'history': s['history'] = 'out'; d['history'] = dict(out=dict(times=[0, .4, 1.], values=[0, 1, g.uniform(.3, .9)]))
    if way == 'load': d['load'] = [dict({'at': 'e'} if fixed else dict(along='b'), force=list(u * power(g, 0, 1.2 if fixed else 2)))]
    if way == 'motion': moved(d, ['a', 'e'], depth * u)
    if way in ('body', 'arm'): carried(d, s, u, depth, way == 'arm')
    d['surface'] = [dict(s, name='s')]; d['contact'][0]['surfaces'] = ['s']
    return d, f'{kind}{" around" * inside}, {way}', 'surface'

def pair(g):
    """A beam and another one above it, across or along, that come together."""
    fixed, across, g0 = g.random() < .6, g.random() < .7, power(g, -3, -1); d = start(g, fixed); k = d['contact'][0]
    first, r = k['radius'], k['radius'] * power(g, -.5, .5)
    yaw, half = (g.uniform(.35, 2.8), g.uniform(.3, .8)) if across else (g.uniform(-.1, .1), .5)
    w = np.array([np.cos(yaw), np.sin(yaw), 0]) * half; way = np.array([0, 0, -g0 - g.uniform(.02, .15)])
    m = np.array([g.uniform(.3, .8) if across else .8, 0 if across else g.uniform(-1, 1) * r, first + r + g0])
    o, n, EI, held = int(g.integers(1, 4)), int(g.integers(2, 15)), power(g, -1, 1), ['c0', 'c1'] if across else ['c0']
    d['point'].update(c0=list(m + w), c1=list(m - w)); d['section']['t'] = dict(EA=1e3 * EI, GA=400 * EI, GJ=.8 * EI, EI=EI)
    d['beam'].append(dict(beam('c', 'c0', 'c1', elements=n, order=o), section='t'))
    d['output']['nodes'] += [f'c:{i}' for i in range(n * o + 1)]
    d['support'] += [dict(at=p, fix=list(ALL)) for p in held]
    k.update({'with': ['c'], 'radius': dict(b=first, c=r), 'penetration': k.get('penetration', 1e-3 * min(first, r))})
    if g.random() < .6: moved(d, held, way)
    else: d['load'] = [dict(along='c', force=list(way * EI * power(g, 2, 3)))]
    return d, 'across' if across else 'along', 'pair'

def falls(g, ball):
    """A ball or a free beam that flies at a surface."""
    d, u = start(g, True), direction(g); k = d['contact'][0]; r = k['radius']; g0 = r * g.uniform(.1, .6); d.pop('support')
    kind, p, c = str(g.choice(['cone', *DISTANCE, 'tube'])), np.linspace(0, 1, 401)[:, None] * [1, 0, 0], np.array([g.uniform(0, 1), 0, 0])
    if ball: p, c = np.zeros((1, 3)), r * g.uniform(-.3, .3, 3)
    s = apart(body(g, kind, c, u), p, u, r + g0); depth = r * power(g, -1.5, -.7); touch = np.pi * depth
    if s is None: return None
    d['surface'] = [dict(s, name='s')]; k.update(surfaces=['s'], stiffness=1 / depth**2, penetration=1.2 * depth)
    v, spin = list(u + .5 * direction(g) * g.choice([0, 1])), list(direction(g) / r * g.choice([0, 1]))
    if ball:
        d.pop('beam'); d.pop('section'); k.pop('beams'); k['nodes'] = d['output']['nodes'] = ['ball']; d['point'] = dict(ball=[0., 0, 0])
        d['body'] = [dict(at='ball', mass=1., inertia=[.4 * r * r] * 3)]; d['initial'] = [dict(at='ball', velocity=v, spin=spin)]
        if g.random() < .3: k.update(restitution=float(g.uniform(.1, 1)), speed=1.)
    else: d['section']['s'].update(rhoA=1., rhoJ=[r * r / 2, r * r / 4, r * r / 4]); d['initial'] = [dict(beam='b', velocity=v)]
    d['gravity'] = list(u * g.choice([0, .3])); d['output']['columns'] = ['x', 'contact', 'energy', 'momentum']
    d['stage'] = [dict(kind='dynamic', end=2.5 * g0 + (3 if ball else 5) * touch, step=float(touch / g.uniform(15, 30)))]
    return d, f'{"ball" if ball else "beam"} on {kind}', 'dynamic'

def turned(d, R, a, f, c):
    """The deck turned, and with numbers of lengths times a, of forces times f, of times times c."""
    d = units(place(d, R), a, f, c); k = d['contact'][0]; r = k['radius']
    for s in d.get('surface', []):
        s.update({n: (np.array(v) @ R.T * (a if n in SPOTS else 1)).tolist() for n, v in s.items() if n in SPOTS + TURNED})
        s.update({n: (np.array(s[n]) * a).tolist() for n in ('radius', 'ring', 'half') if n in s})
    k['radius'] = {n: v * a for n, v in r.items()} if isinstance(r, dict) else r * a
    k.update({n: float(k[n] * q) for n, q in dict(penetration=a, stiffness=f / a, speed=a / c).items() if n in k})
    return d

def contact_scene(g, seed):
    """(deck, the length of its beam, name, group) of a seed."""
    kinds, found = [pushed, pushed, pair, pushed, lambda g: falls(g, True), pushed, pushed, pair, pushed, lambda g: falls(g, False)], None
    while found is None: found = kinds[seed % 10](g)
    a = power(g, -3, 3)
    return turned(found[0], rotation(g), a, power(g, -3, 3), power(g, -2, 2) if found[2] == 'dynamic' else 1.), a, *found[1:]
