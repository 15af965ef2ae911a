"""Random scenes of what only its loads hold, or what is laid loosely: (deck, group, check), where `check` takes a run and gives how far
it is off, as a part of what is allowed; or None for scenes that have no state of rest."""
import math
import numpy as np
from scenes_static import power
from transforms import rotation

DOWN = np.array([0, 0, -9.81])

def list_of(v): return [float(c) for c in v]

def solved(gap, guesses):
    """The root of two equations by Newton's method from the first of some guesses that leads there; None where none does."""
    for guess in guesses:
        x = np.array(guess, float)
        for _ in range(100):
            r = gap(x); J = np.array([(gap(x + d) - r) / d.sum() for d in np.diag(1e-7 * np.abs(x))]).T
            try: dx = -np.linalg.solve(J, r)
            except np.linalg.LinAlgError: break
            size = np.linalg.norm(dx); x = x + dx * min(1, .5 * np.linalg.norm(x) / max(size, 1e-300))
            if not np.isfinite(x).all(): break
            if size < 1e-12 * np.linalg.norm(x) and x[0] > 0: return x
    return None

def leaning(a, tilt, R):
    """From the vertical plane to space: turned about the line between the ends by `tilt`, then by R."""
    k, c, s = np.array([math.cos(a), 0, math.sin(a)]), math.cos(tilt), math.sin(tilt)
    def place(p):
        v = np.array([p[0], 0, p[1]]); return R @ (v * c + np.cross(k, v) * s + k * (k @ v) * (1 - c))
    return place

def opening(f, goal):
    """Where the falling function f of an angle is `goal`."""
    low, high = 1e-9, math.pi
    for _ in range(100):
        m = (low + high) / 2; low, high = (m, high) if f(m) > goal else (low, m)
    return low

def held_ends(end_force, R, weight, name, allowed):
    """How far the force of the first support is off."""
    def check(run):
        F = R.T @ [run.col(f'{name}.f{c}')[-1] for c in 'xyz']
        return np.abs(F - [-end_force[0], 0, end_force[1]]).max() / weight / allowed
    return check

def frame_of(g): return rotation(g) if g.random() < .7 else np.eye(3)

def chain(g):
    """Links between ball joints, against links that point along the force in their middle."""
    n, l, w = int(g.integers(2, 15)), power(g, -3, 3), power(g, -2, 4); span, R = n * l * g.uniform(.3, .95), frame_of(g)
    rise = g.uniform(-.4, .4) * math.sqrt((n * l)**2 - span**2); D, a = math.hypot(span, rise), math.atan2(rise, span)
    turn = lambda s, i: s * (2 * (i + .5) / n - 1)
    s = opening(lambda s: sum(l * math.cos(turn(s, i)) for i in range(n)), D)
    p = np.cumsum([[0, 0]] + [[l * math.cos(a + turn(s, i)), l * math.sin(a + turn(s, i))] for i in range(n)], axis=0)
    EA, place = w * power(g, 4, 7), leaning(a, g.uniform(-1, 1) if g.random() < .6 else 0, R)
    def gap(x):
        v = x[1] - (np.arange(n) + .5) * w; T = np.hypot(x[0], v); e = l * (1 + T / EA)
        return np.array([(e * x[0] / T).sum() - span, -(e * v / T).sum() - rise])
    force = solved(gap, [[h * n * w, n * w / 2] for h in (.5, 1, 2, 4, .2, 8)])
    if force is None: return None
    d = dict(gravity=list_of(R @ DOWN), point={f'p{i}': list_of(place(q)) for i, q in enumerate(p)},
             section=dict(s=dict(EA=EA, GA=EA, GJ=EA * l * l / 100, EI=EA * l * l / 100, rhoA=w / 9.81 / l)),
             beam=[dict(name=f'l{i}', section='s', through=[f'p{i}', f'p{i + 1}'], elements=1, order=int(g.integers(1, 3))) for i in range(n)],
             joint=[dict(kind='spherical', at=f'p{i}', beams=[f'l{i - 1}', f'l{i}']) for i in g.permutation(np.arange(1, n))],
             support=[dict(at='p0', fix='pin'), dict(at=f'p{n}', fix='pin')], stage=[dict(kind='static', steps=int(g.choice([1, 4, 10])))],
             output=dict(nodes=['p0'], columns=['reaction']))
    return d, 'chain', held_ends(force, R, n * w, 'p0', 1e-3)

def cable(g):
    """A cable with next to no bending stiffness, laid as an arc, as a V or straight, against the elastic catenary."""
    L, w = power(g, -2, 2), power(g, -2, 4); span, R = L * g.uniform(.3, .95), frame_of(g)
    rise = g.uniform(-.5, .5) * math.sqrt(L * L - span**2); D, a = math.hypot(span, rise), math.atan2(rise, span)
    EA, EI, n, way = w * L * power(g, 3, 6), w * L**3 * power(g, -9, -6), int(g.choice([16, 24, 40])), g.choice(['arc', 'straight', 'v'])
    place = leaning(a, g.uniform(-1, 1) if g.random() < .4 else 0, R); along, below = np.array([math.cos(a), math.sin(a)]), np.array([math.sin(a), -math.cos(a)])
    d = dict(gravity=list_of(R @ DOWN), section=dict(s=dict(EA=EA, GA=EA / 2.6, GJ=EI, EI=EI, rhoA=w / 9.81)),
             support=[dict(at='a', fix='pin')], stage=[dict(kind='static', steps=int(g.choice([1, 5, 10])))], output=dict(nodes=['a'], columns=['reaction']))
    beam = lambda name, n, **line: dict(name=name, section='s', elements=n, order=2, **line)
    if way == 'straight':
        d['point'] = dict(a=[0., 0., 0.], b=list_of(place(L * along))); d['beam'] = [beam('c', n, through=['a', 'b'])]
        moved = place(D * along) - place(L * along); d['motion'] = [{'at': 'b', f'u{c}': float(moved[k])} for k, c in enumerate('xyz')]
    else:
        half = opening(lambda s: math.sin(s) / s, D / L)
        sag = D / 2 * math.tan(half / 2) if way == 'arc' else math.sqrt(L * L - D * D) / 2
        middle = list_of(place(D / 2 * along + sag * below)); d['point'] = dict(a=[0., 0., 0.], b=list_of(place(D * along)), m=middle)
        d['support'].append(dict(at='b', fix='pin'))
        if way == 'arc': d['beam'] = [beam('c', n, arc=['a', middle, 'b'])]
        else:
            d['beam'] = [beam('c1', n // 2, through=['a', 'm']), beam('c2', n // 2, through=['m', 'b'])]
            d['joint'] = [dict(kind='spherical', at='m', beams=['c1', 'c2'])]
    def gap(x):
        H, V = x; e = (V - w * L) / H
        return np.array([H * L / EA + H / w * (math.asinh(V / H) - math.asinh(e)) - span,
                         -(V * L - w * L * L / 2) / EA - H / w * (math.hypot(1, V / H) - math.hypot(1, e)) - rise])
    force = solved(gap, [[h * w * L, w * L / 2] for h in (.3, .1, 1, 3, .03)])
    return None if force is None else (d, f'cable: {way}', held_ends(force, R, w * L, 'a', 2e-3))

def hung(g, way):
    """A bar, straight or bent, that hangs from its end in some way."""
    L, rho, R, at = power(g, -2, 2), power(g, -2, 3), rotation(g), g.uniform(-2.9, 2.9); E = rho * L * 9.81 * power(g, 4, 7)
    x = np.array([math.sin(at), 0, -math.cos(at)]); side = np.array([math.cos(at), .3, math.sin(at)])
    d = dict(gravity=list_of(R @ DOWN), point=dict(a=[0., 0., 0.], b=list_of(R @ (L * x))),
             section=dict(s=dict(EA=E, GA=E, GJ=E * L * L / 1e3, EI=E * L * L / 1e3, rhoA=rho)),
             beam=[dict(name='x', section='s', through=['a', 'b'], elements=int(g.integers(1, 5)), order=int(g.integers(1, 4)))],
             stage=[dict(kind='static', steps=int(g.choice([1, 3, 10])))], output=dict(nodes=['b'], columns=['x']))
    if way == 'bent, on a ball':
        d['point']['c'] = list_of(R @ (L * x + .5 * L * side)); d['beam'].append(dict(name='y', section='s', through=['b', 'c'], elements=2, order=2))
    if 'ball' in way: d['support'] = [dict(at='a', fix='pin')]
    if way == 'hinge': d['joint'] = [dict(kind='revolute', at='a', beams=['x'], axis=list_of(R @ [0, 1, 0]))]
    if way == 'slide': d['joint'] = [dict(kind='prismatic', at='a', beams=['x'], axis=list_of(R @ [0, 1, 0]))]
    def check(run): return np.abs(R.T @ [run.col(f'b.{c}')[-1] for c in 'xyz'] - np.array([0, 0, -L])).max() / L / 2e-3
    return d, f'bar: {way}', check if way in ('hinge', 'ball') else None

def blade(g):
    """A blade on a free flap or lag hinge in a rotating frame, coned or swept at the start."""
    R0, W, rho, R, cone = g.uniform(1, 10), power(g, -1, 2), power(g, -1, 2), rotation(g), g.uniform(-1.2, 1.2); e, E = g.uniform(.05, .4) * R0, rho * W**2 * R0**2 * power(g, 4, 6)
    flaps = g.random() < .5; x = np.array([math.cos(cone), 0, math.sin(cone)] if flaps else [math.cos(cone), math.sin(cone), 0])
    hub, axis = np.array([e, 0, 0]), np.array([0, 1, 0] if flaps else [0, 0, 1])
    J = rho * R0 * R0 * 1e-6; s = dict(EA=E, GA=E, GJ=E * R0 * R0 / 1e3, EI=E * R0 * R0 / 1e3, rhoA=rho, rhoJ=[2 * J, J, J])
    d = dict(point=dict(hub=[0., 0., 0.], h=list_of(R @ hub), tip=list_of(R @ (hub + (R0 - e) * x))), section=dict(s=s),
             beam=[dict(name='arm', section='s', through=['hub', 'h'], elements=1, order=2), dict(name='bl', section='s', through=['h', 'tip'], elements=4, order=2)],
             joint=[dict(kind='revolute', at='h', beams=['arm', 'bl'], axis=list_of(R @ axis))], support=[dict(at='hub', fix='all')],
             stage=[dict(kind='static', steps=int(g.choice([1, 4])), frame=dict(spin=list_of(R @ [0, 0, W]), about='hub'))], output=dict(nodes=['tip'], columns=['x']))
    def check(run): return np.abs(R.T @ [run.col(f'tip.{c}')[-1] for c in 'xyz'] - np.array([R0, 0, 0])).max() / R0 / 5e-3
    return d, 'blade on a hinge', check

REST = [chain, cable, lambda g: hung(g, 'hinge'), cable, lambda g: hung(g, 'ball'), chain, blade, lambda g: hung(g, 'bent, on a ball'), cable, lambda g: hung(g, 'slide')]
