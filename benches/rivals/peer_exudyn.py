"""Exudyn: geometrically exact beams in space (ObjectBeamGeometricallyExact) or in the plane (...2D).

Settings: element "3d" or "2d", rotations "euler" or "vector", modified (Newton), tolerance. Time integration is the
generalised-alpha method with spectral radius 0.98: it does not finish S3 with 1.
"""

import os

os.environ["EXUDYN_MODULE"] = "fast"

import math
import warnings

import numpy as np

warnings.simplefilter("ignore")

import exudyn as exu
from exudyn.utilities import *

import scenes

job = scenes.job()
scene, n = job["scene"], job["elements"]
data = scenes.SECTIONS[scene]
places = scenes.nodes(scene, n)
mbs = exu.SystemContainer().AddSystem()


def frame(tangent):
    """Rotation from global axes to a section with this tangent in the plane x, y."""
    return np.array([tangent, np.cross([0, 0, 1], tangent), [0, 0, 1]]).T


def turn_z(angle):
    return frame([math.cos(angle), math.sin(angle), 0.0])


def node(place, rotation):
    if job.get("rotations") == "vector":
        return mbs.AddNode(NodeRigidBodyRotVecLG(
            referenceCoordinates=list(place) + list(RotationMatrix2RotationVector(rotation))))
    return mbs.AddNode(NodeRigidBodyEP(
        referenceCoordinates=list(place) + list(RotationMatrix2EulerParameters(rotation))))


def chain(places, rotations, length):
    """Nodes and beams in space; returns node numbers."""
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag([data[k] for k in ("EA", "GA", "GA", "GJ", "EI", "EI")])
    section.massPerLength = data["rhoA"]
    section.inertia = np.diag(data["rhoJ"])
    numbers = [node(p, r) for p, r in zip(places, rotations)]
    for pair in zip(numbers, numbers[1:]):
        mbs.AddObject(ObjectBeamGeometricallyExact(nodeNumbers=list(pair), length=length, sectionData=section))
    return numbers


def chain_2d(places, length):
    """Nodes and beams in the plane with the first node clamped."""
    numbers = [mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[x, y, 0])) for x, y, _ in places]
    for pair in zip(numbers, numbers[1:]):
        mbs.AddObject(ObjectBeamGeometricallyExact2D(
            nodeNumbers=list(pair), length=length, massPerLength=1, crossSectionInertia=1,
            bendingStiffness=data["EI"], axialStiffness=data["EA"], shearStiffness=data["GA"]))
    ground = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    for k in range(3):
        held = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=numbers[0], coordinate=k))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[ground, held]))
    return numbers


def marker(number):
    return mbs.AddMarker(MarkerNodeRigid(nodeNumber=number))


def weld(a, b, rotation):
    """All directions of marker b held to marker a; `rotation` is that of b seen from a."""
    mbs.AddObject(GenericJoint(markerNumbers=[a, b], rotationMarker1=rotation.T, constrainedAxes=[1] * 6))


def clamp(number, rotation):
    ground = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.AddObject(ObjectGround()), localPosition=list(places[0])))
    weld(ground, marker(number), rotation)


def place(number):
    return mbs.GetNodeOutput(number, exu.OutputVariableType.Position)


def settings():
    sim = exu.SimulationSettings()
    sim.parallel.numberOfThreads = 1
    sim.linearSolverType = exu.LinearSolverType.EigenSparse
    sim.solutionSettings.writeSolutionToFile = False
    sim.solutionSettings.sensorsWritePeriod = 1e-9
    sim.staticSolver.numberOfLoadSteps = job.get("levels", 1)
    sim.staticSolver.verboseMode = 0
    sim.timeIntegration.verboseMode = 0
    sim.timeIntegration.generalizedAlpha.spectralRadius = 0.98
    sim.timeIntegration.newton.useModifiedNewton = job.get("modified", False)
    sim.staticSolver.newton.useModifiedNewton = False
    if "tolerance" in job:
        for solver in (sim.staticSolver, sim.timeIntegration):
            solver.newton.relativeTolerance = job["tolerance"]
    if "step" in job:
        sim.timeIntegration.endTime = scenes.END_TIME[scene]
        sim.timeIntegration.numberOfSteps = round(scenes.END_TIME[scene] / job["step"])
    return sim


def solve():
    """Runs the scene; returns whether it was solved, Newton iterations and CPU seconds."""
    mbs.Assemble()
    sim = settings()
    solver = exu.MainSolverImplicitSecondOrder() if "step" in job else exu.MainSolverStatic()
    with scenes.Clock() as clock:
        ok = solver.SolveSystem(mbs, sim)
    return ok, solver.it.newtonStepsCount, clock.cpu


def roll_up():
    length = scenes.LENGTH / n
    if job["element"] == "2d":
        numbers = chain_2d(places, length)
    else:
        numbers = chain(places, [np.eye(3)] * (n + 1), length)
        clamp(numbers[0], np.eye(3))
    mbs.AddLoad(Torque(markerNumber=marker(numbers[-1]), loadVector=[0, 0, scenes.roll_up_moment(scene)]))
    return solve(), {"middle": place(numbers[n // 2]), "tip": place(numbers[-1])}, None


def bend():
    rotations = [turn_z(math.pi / 2 - scenes.BEND_ANGLE * i / n) for i in range(n + 1)]
    numbers = chain(places, rotations, scenes.BEND_RADIUS * scenes.BEND_ANGLE / n)
    clamp(numbers[0], rotations[0])
    mbs.AddLoad(Force(markerNumber=marker(numbers[-1]), loadVector=[0, 0, scenes.BEND_FORCE]))
    return solve(), {"tip": place(numbers[-1])}, None


def right_angle():
    length, half, quarter = 2 * scenes.LENGTH / n, n // 2, turn_z(math.pi / 2)
    lower = chain(places[:half + 1], [np.eye(3)] * (half + 1), length)
    upper = chain(places[half:], [quarter] * (half + 1), length)
    clamp(lower[0], np.eye(3))
    elbow = marker(lower[-1])
    weld(elbow, marker(upper[0]), quarter)
    mbs.AddLoad(Force(markerNumber=elbow, loadVector=[0, 0, 1],
                      loadVectorUserFunction=lambda mbs, t, v: [0, 0, scenes.right_angle_force(t)]))
    sensors = [mbs.AddSensor(SensorNode(nodeNumber=number, storeInternal=True,
                                        outputVariableType=exu.OutputVariableType.Displacement))
               for number in (lower[-1], upper[-1])]
    outcome = solve()
    elbow, tip = (mbs.GetSensorStoredData(sensor) for sensor in sensors)
    return outcome, {}, np.c_[elbow[:, 0], elbow[:, 3], tip[:, 3]].tolist()


def flying():
    tangent = (np.array(places[-1]) - np.array(places[0])) / scenes.LENGTH
    numbers = chain(places, [frame(tangent)] * (n + 1), scenes.LENGTH / n)
    start = marker(numbers[0])
    pulse = scenes.flying_pulse
    mbs.AddLoad(Force(markerNumber=start, loadVector=[1, 0, 0],
                      loadVectorUserFunction=lambda mbs, t, v: [pulse(t) / 10, 0, 0]))
    mbs.AddLoad(Torque(markerNumber=start, loadVector=[0, 0, 1],
                       loadVectorUserFunction=lambda mbs, t, v: [0, -pulse(t) / 2, -pulse(t)]))
    return solve(), {"start": place(numbers[0]), "end": place(numbers[-1])}, None


(ok, iterations, cpu), ends, history = {
    "S1": roll_up, "S2": bend, "S3": right_angle, "S4": roll_up, "S5": flying}[scene]()
scenes.report(exu.GetVersionString(), ok, iterations, cpu, ends, history)
