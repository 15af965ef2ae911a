"""OpenSees in space: the geometrically exact ExactFrame of package xara, or elasticBeamColumn of package openseespy.

Settings: library "xara" or "openseespy", system (linear solver). S3 has lumped masses with a rotary inertia that does
not turn with the section, which is another physics. openseespy needs libblas.so.3 of the system.
"""

import importlib.metadata

import scenes

job = scenes.job()
scene, n = job["scene"], job["elements"]
exact = job["library"] == "xara"
if exact:
    import opensees.openseespy

    model = opensees.openseespy.Model(ndm=3, ndf=6)
    version = importlib.metadata.version("xara")
else:
    import openseespy.opensees as model

    model.model("basic", "-ndm", 3, "-ndf", 6)
    version = importlib.metadata.version("openseespy")

data = scenes.SECTIONS[scene]
A, E, G = 1.0, data["EA"], data["GA"]
I, J = data["EI"] / E, data["GJ"] / G
places = scenes.nodes(scene, n)


def build():
    """Nodes, the clamp and the elements."""
    for i, place in enumerate(places):
        model.node(i, *([place] if exact else place))
    model.fix(0, 1, 1, 1, 1, 1, 1)
    model.geomTransf("Linear" if exact else "Corotational", 1, 0, 0, 1)
    if exact:
        model.section("FrameElastic", 1, E=E, G=G, A=A, Ay=A, Az=A, Iy=I, Iz=I, J=J)
    for i in range(n):
        if exact:
            model.element("ExactFrame", i + 1, (i, i + 1), section=1, transform=1)
        else:
            model.element("elasticBeamColumn", i + 1, i, i + 1, A, E, G, J, I, I, 1)


def load(number, *components, hat=False):
    """A load at a node that grows with the load factor, or follows the hat of S3."""
    times, values = [0.0, 1.0, 2.0, 1e9], [0.0, 50.0, 0.0, 0.0]
    if exact:
        if hat:
            model.timeSeries("Path", 1, time=times, values=values)
        model.pattern("Plain", 1, 1 if hat else "Linear")
        model.load(number, components, pattern=1)
    else:
        if hat:
            model.timeSeries("Path", 1, "-time", *times, "-values", *values)
        else:
            model.timeSeries("Linear", 1)
        model.pattern("Plain", 1, 1)
        model.load(number, *components)


def masses():
    """Lumps mass and rotary inertia of S3 to the nodes."""
    lumped = [[0.0] * 6 for _ in places]
    axial, across, _ = data["rhoJ"]
    half = scenes.LENGTH / n  # half of the length of an element
    for i in range(n):
        inertia = (axial, across, across) if i < n // 2 else (across, axial, across)
        for entry in (lumped[i], lumped[i + 1]):
            for k in range(3):
                entry[k] += data["rhoA"] * half
                entry[3 + k] += inertia[k] * half
    for i, entry in enumerate(lumped):
        model.mass(i, *([tuple(entry)] if exact else entry))


def analysis(kind, *integrator):
    model.constraints("Plain")
    model.numberer("RCM")
    model.system(job.get("system", "BandGeneral"))
    model.test("NormDispIncr", 1e-8, 60, 0)
    model.algorithm("Newton")
    model.integrator(*integrator)
    model.analysis(kind)


def displaced(number):
    return [p + model.nodeDisp(number, k + 1) for k, p in enumerate(places[number])]


def static():
    levels, ok, iterations = job["levels"], True, 0
    analysis("Static", "LoadControl", 1.0 / levels)
    with scenes.Clock() as clock:
        for _ in range(levels):
            ok = model.analyze(1) == 0
            iterations += model.testIter()
            if not ok:
                break
    return ok, iterations, clock.cpu


def dynamic(elbow, tip):
    """Trapezoidal rule; returns the history of uz too."""
    h, ok, iterations, rows = job["step"], True, 0, [(0.0, 0.0, 0.0)]
    analysis("Transient", "Newmark", 0.5, 0.25)
    with scenes.Clock() as clock:
        for k in range(1, round(scenes.END_TIME[scene] / h) + 1):
            ok = model.analyze(1, h) == 0
            iterations += model.testIter()
            if not ok:
                break
            rows.append((k * h, model.nodeDisp(elbow, 3), model.nodeDisp(tip, 3)))
    return ok, iterations, clock.cpu, rows


build()
history = None
if scene == "S3":
    masses()
    load(n // 2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, hat=True)
    ok, iterations, cpu, history = dynamic(n // 2, n)
else:
    force = scenes.BEND_FORCE if scene == "S2" else 0.0
    moment = 0.0 if scene == "S2" else scenes.roll_up_moment(scene)
    load(n, 0.0, 0.0, force, 0.0, 0.0, moment)
    ok, iterations, cpu = static()
scenes.report(version, ok, iterations, cpu, {"middle": displaced(n // 2), "tip": displaced(n)}, history)
