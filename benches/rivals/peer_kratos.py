"""Kratos Multiphysics, CrBeamElement3D2N (co-rotational) with shear areas and the skyline solver.

The element has no rotary inertia of sections: S3 has its mass only, with the trapezoidal rule.
"""

import importlib.metadata

import KratosMultiphysics as KM
import KratosMultiphysics.LinearSolversApplication
import KratosMultiphysics.StructuralMechanicsApplication as SMA
from KratosMultiphysics.python_linear_solver_factory import ConstructSolver

import scenes

KM.Logger.GetDefaultOutput().SetSeverity(KM.Logger.Severity.WARNING)
KM.ParallelUtilities.SetNumThreads(1)
job = scenes.job()
scene, n = job["scene"], job["elements"]
places = scenes.nodes(scene, n)
DIRECTIONS = [(getattr(KM, f"{motion}_{axis}"), getattr(KM, f"{reaction}_{axis}"))
              for motion, reaction in (("DISPLACEMENT", "REACTION"), ("ROTATION", "REACTION_MOMENT")) for axis in "XYZ"]


def properties(part):
    data = scenes.SECTIONS[scene]
    E, G, A = data["EA"], data["GA"], 1.0
    values = part.CreateNewProperties(1)
    for key, value in (
            (KM.YOUNG_MODULUS, E), (KM.POISSON_RATIO, E / (2 * G) - 1), (KM.DENSITY, data["rhoA"]), (SMA.CROSS_AREA, A),
            (SMA.AREA_EFFECTIVE_Y, A), (SMA.AREA_EFFECTIVE_Z, A), (SMA.I22, data["EI"] / E), (SMA.I33, data["EI"] / E),
            (SMA.TORSIONAL_INERTIA, data["GJ"] / G)):
        values.SetValue(key, value)
    values.SetValue(KM.CONSTITUTIVE_LAW, KM.KratosGlobals.GetConstitutiveLaw("BeamConstitutiveLaw").Clone())
    return values


def build(model):
    """Nodes, elements, the clamp and the condition that carries the load; returns the part and the loaded node."""
    part = model.CreateModelPart("beam", 3)
    for name in ("DISPLACEMENT", "ROTATION", "REACTION", "REACTION_MOMENT", "VELOCITY", "ACCELERATION",
                 "ANGULAR_VELOCITY", "ANGULAR_ACCELERATION", "VOLUME_ACCELERATION"):
        part.AddNodalSolutionStepVariable(getattr(KM, name))
    part.AddNodalSolutionStepVariable(SMA.POINT_LOAD)
    part.AddNodalSolutionStepVariable(SMA.POINT_MOMENT)
    part.ProcessInfo.SetValue(KM.DOMAIN_SIZE, 3)
    part.SetBufferSize(3)
    values = properties(part)
    for i, place in enumerate(places):
        part.CreateNewNode(i + 1, *place)
    for i in range(n):
        part.CreateNewElement("CrBeamElement3D2N", i + 1, [i + 1, i + 2], values)
    for node in part.Nodes:
        for motion, reaction in DIRECTIONS:
            node.AddDof(motion, reaction)
    for motion, _ in DIRECTIONS:
        part.Nodes[1].Fix(motion)
    loaded = n // 2 + 1 if scene == "S3" else n + 1
    kind = "PointMomentCondition3D1N" if scene in scenes.CIRCLES else "PointLoadCondition3D1N"
    part.CreateNewCondition(kind, 1, [loaded], values)
    return part, part.Nodes[loaded]


def newton(part, scheme):
    linear = ConstructSolver(KM.Parameters('{"solver_type": "LinearSolversApplication.skyline_lu_factorization"}'))
    strategy = KM.ResidualBasedNewtonRaphsonStrategy(
        part, scheme, KM.ResidualCriteria(1e-8, 1e-9), KM.ResidualBasedBlockBuilderAndSolver(linear), 60,
        False, False, True)
    strategy.SetEchoLevel(0)
    strategy.Initialize()
    return strategy


def advance(part, strategy):
    """One level or step; returns whether it converged and the iterations."""
    strategy.InitializeSolutionStep()
    strategy.Predict()
    converged = strategy.SolveSolutionStep()
    strategy.FinalizeSolutionStep()
    return converged, part.ProcessInfo[KM.NL_ITERATION_NUMBER]


def displacement(node):
    return list(node.GetSolutionStepValue(KM.DISPLACEMENT))


def static(part, loaded):
    strategy = newton(part, KM.ResidualBasedIncrementalUpdateStaticScheme())
    variable, size = SMA.POINT_LOAD, scenes.BEND_FORCE
    if scene in scenes.CIRCLES:
        variable, size = SMA.POINT_MOMENT, scenes.roll_up_moment(scene)
    ok, iterations = True, 0
    with scenes.Clock() as clock:
        for level in range(1, job["levels"] + 1):
            part.CloneTimeStep(float(level))
            loaded.SetSolutionStepValue(variable, [0, 0, size * level / job["levels"]])
            ok, count = advance(part, strategy)
            iterations += count
            if not ok:
                break
    return ok, iterations, clock.cpu, None


def dynamic(part, loaded):
    h, ok, iterations, rows = job["step"], True, 0, [(0.0, 0.0, 0.0)]
    strategy = newton(part, KM.ResidualBasedBossakDisplacementScheme(0.0))
    with scenes.Clock() as clock:
        for k in range(1, round(scenes.END_TIME[scene] / h) + 1):
            part.CloneTimeStep(k * h)
            loaded.SetSolutionStepValue(SMA.POINT_LOAD, [0, 0, scenes.right_angle_force(k * h)])
            ok, count = advance(part, strategy)
            iterations += count
            if not ok:
                break
            rows.append((k * h, displacement(loaded)[2], displacement(part.Nodes[n + 1])[2]))
    return ok, iterations, clock.cpu, rows


model = KM.Model()
part, loaded = build(model)
ok, iterations, cpu, history = (dynamic if scene == "S3" else static)(part, loaded)
ends = {name: [p + u for p, u in zip(places[k], displacement(part.Nodes[k + 1]))]
        for name, k in (("middle", n // 2), ("tip", n))}
scenes.report(importlib.metadata.version("KratosMultiphysics"), ok, iterations, cpu, ends, history)
