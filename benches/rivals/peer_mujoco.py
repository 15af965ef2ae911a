"""MuJoCo: a chain of rigid links, ball joints with springs EI/l (2 EI/l at the clamp), Runge-Kutta of order 4; in S6
capsules on a plane without friction, joints damped, and the integrator `implicitfast`.

The chain is inextensible and unshearable and bends and twists with one stiffness. Explicit: an iteration is a step.
"""

import math
import sys

import mujoco
import numpy as np

import scenes

sys.setrecursionlimit(10**6)
job = scenes.job()
scene, n, h = job["scene"], job["elements"], job["step"]
data = scenes.SECTIONS[scene]
places = scenes.nodes(scene, n)
half = n // 2
length = math.dist(places[0], places[1])
axial, across = data["rhoJ"][0] * length, data["rhoJ"][1] * length


DAMPING_TIME = 2.0  # of joints in S6, over their stiffness


def quaternion(angle):
    """A turn about z."""
    return [math.cos(angle / 2), 0, 0, math.sin(angle / 2)]


def chain():
    """The model; body `b0` carries the start, site `end` is the last node."""
    spec = mujoco.MjSpec()
    spec.option.gravity = [0, 0, 0]
    spec.option.timestep = h
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    if scene == "S6":
        spec.option.gravity = [0, 0, -scenes.FLOOR_WEIGHT / data["rhoA"]]
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], condim=1, contype=0, conaffinity=1,
                                pos=[0, 0, -scenes.FLOOR_GAP - scenes.FLOOR_RADIUS])
    else:
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    mass = data["rhoA"] * length
    turned = across + mass * length**2 / 12
    body = spec.worldbody
    for i in range(n):
        body = body.add_body(name=f"b{i}", mass=mass, inertia=[axial, turned, turned], ipos=[length / 2, 0, 0],
                             explicitinertial=True, pos=[length if i else 0, 0, 0])
        if i == 0 and scene == "S5":
            (x, y, z), (u, v, _) = scenes.FLYING_START, scenes.FLYING_END
            body.pos, body.quat = [x, y, z], quaternion(math.atan2(v - y, u - x))
            body.add_freejoint()
            continue
        if scene == "S3" and i == half:
            body.quat = quaternion(math.pi / 2)
        joint = body.add_joint(type=mujoco.mjtJoint.mjJNT_BALL)
        stiffness = data["EI"] / length * (1 if i else 2)
        joint.stiffness = [stiffness] + [0] * (len(joint.stiffness) - 1)
        if scene == "S6":
            joint.damping = [DAMPING_TIME * stiffness] + [0] * (len(joint.damping) - 1)
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0, 0, 0, length, 0, 0], condim=1, contype=1,
                          size=[scenes.FLOOR_RADIUS, 0, 0], conaffinity=0)
    body.add_site(name="end", pos=[length, 0, 0])
    return spec.compile()


model = chain()
state = mujoco.MjData(model)
loaded = model.body("b0" if scene == "S5" else f"b{half}").id
end = model.site("end").id


def push(t):
    """The loads act at the origin of the loaded body, MuJoCo wants them at its centre."""
    if scene == "S6":
        return
    if scene == "S3":
        force, moment = np.array([0, 0, scenes.right_angle_force(t)]), np.zeros(3)
    else:
        pulse = scenes.flying_pulse(t)
        force, moment = np.array([pulse / 10, 0, 0]), np.array([0, -pulse / 2, -pulse])
    state.xfrc_applied[loaded, :3] = force
    state.xfrc_applied[loaded, 3:] = moment + np.cross(state.xpos[loaded] - state.xipos[loaded], force)


steps = round(scenes.END_TIME[scene] / h)
rows = [(0.0, 0.0, 0.0)]
mujoco.mj_forward(model, state)
with scenes.Clock() as clock:
    for _ in range(steps):
        push(state.time + h / 2)
        mujoco.mj_step(model, state)
        # Places are those of the last evaluation, at the start of the step.
        if scene == "S3":
            rows.append((state.time, state.xpos[loaded, 2], state.site_xpos[end, 2]))
mujoco.mj_forward(model, state)
ok = np.isfinite(state.qpos).all() and not any(warning.number for warning in state.warning)
scenes.report(mujoco.__version__, ok, steps, clock.cpu,
              {"start": state.xpos[loaded], "middle": state.xpos[model.body(f"b{half}").id], "end": state.site_xpos[end]},
              rows if scene == "S3" else None)
