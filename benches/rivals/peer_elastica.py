"""PyElastica: a Cosserat rod on staggered grids with the explicit position Verlet scheme; an iteration is a step.

S3 is one rod with a right angle in its rest curvature. The clamp holds the first node and the first element, half an
element more than a clamp should, which is an error of first order in the length of elements. In S6 a linear damper
brings the rod to rest on a plane.
"""

import importlib.metadata

import elastica
import numpy as np
from elastica._rotations import _inv_rotate

import scenes

job = scenes.job()
scene, n, h = job["scene"], job["elements"], job["step"]
data = scenes.SECTIONS[scene]
elbow = n // 2


class Simulator(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping,
                elastica.Contact):
    pass


class Push(elastica.NoForces):
    """The hat of S3 at the elbow."""

    def apply_forces(self, system, time=0.0):
        system.external_forces[2, elbow] += scenes.right_angle_force(time)


class Pulse(elastica.NoForces):
    """The pulse of S5 at the start."""

    def apply_forces(self, system, time=0.0):
        system.external_forces[0, 0] += scenes.flying_pulse(time) / 10

    def apply_torques(self, system, time=0.0):
        pulse = scenes.flying_pulse(time)
        system.external_torques[..., 0] += system.director_collection[..., 0] @ np.array([0, -pulse / 2, -pulse])


class Weight(elastica.NoForces):
    """The weight per length of S6."""

    def apply_forces(self, system, time=0.0):
        system.external_forces[2] -= scenes.FLOOR_WEIGHT * system.mass / data["rhoA"]


def lay_on_floor(simulator, rod):
    """Adds weight, damping and a plane without friction."""
    rod.radius[:] = scenes.FLOOR_RADIUS
    height = -scenes.FLOOR_GAP - scenes.FLOOR_RADIUS
    floor = elastica.Plane(plane_origin=np.array([0.0, 0.0, height]), plane_normal=np.array([0.0, 0.0, 1.0]))
    simulator.append(floor)
    simulator.add_forcing_to(rod).using(Weight)
    simulator.dampen(rod).using(elastica.AnalyticalLinearDamper, damping_constant=1.0, time_step=h)
    simulator.detect_contact_between(rod, floor).using(elastica.RodPlaneContact, k=300.0, nu=0.1)


def make_rod():
    """A rod with the resultants of the section: PyElastica's own follow from a round shape."""
    places = np.array(scenes.nodes(scene, n)).T
    tangents = np.diff(places)
    lengths = np.linalg.norm(tangents, axis=0)
    tangents /= lengths
    up = np.array([0.0, 0.0, 1.0])
    directors = np.array([np.tile(up[:, None], n), np.cross(tangents.T, up).T, tangents])
    rod = elastica.CosseratRod.straight_rod(
        n, places[:, 0].copy(), tangents[:, 0].copy(), up, lengths.sum(), 0.1, 1.0,
        youngs_modulus=1.0, shear_modulus=1.0, position=places.copy(), directors=directors.copy())
    mass = data["rhoA"] * lengths / 2
    rod.mass[:] = np.append(mass, 0) + np.append(0, mass)
    rod.rest_lengths[:] = rod.lengths[:] = lengths
    rod.rest_voronoi_lengths[:] = (lengths[1:] + lengths[:-1]) / 2
    axial, second, third = data["rhoJ"]
    rod.mass_second_moment_of_inertia[:] = 0.0
    rod.inv_mass_second_moment_of_inertia[:] = 0.0
    for k, inertia in enumerate((second, third, axial)):
        rod.mass_second_moment_of_inertia[k, k] = inertia * lengths
        rod.inv_mass_second_moment_of_inertia[k, k] = 1 / (inertia * lengths)
    for k, (force, moment) in enumerate((("GA", "EI"), ("GA", "EI"), ("EA", "GJ"))):
        rod.shear_matrix[k, k] = data[force]
        rod.bend_matrix[k, k] = data[moment]
    rod.rest_kappa[:] = _inv_rotate(rod.director_collection) / rod.rest_voronoi_lengths
    rod.rest_sigma[:] = 0.0
    return rod


simulator = Simulator()
rod = make_rod()
simulator.append(rod)
if scene in ("S3", "S6"):
    simulator.constrain(rod).using(
        elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
if scene == "S6":
    lay_on_floor(simulator, rod)
else:
    simulator.add_forcing_to(rod).using(Push if scene == "S3" else Pulse)
simulator.finalize()
stepper = elastica.PositionVerlet()
time = np.float64(0.0)
for _ in range(3):  # compiles
    stepper.step(simulator, time, np.float64(1e-12))
steps = round(scenes.END_TIME[scene] / h)
rows = [(0.0, 0.0, 0.0)]
with scenes.Clock() as clock:
    for k in range(1, steps + 1):
        time = stepper.step(simulator, time, np.float64(h))
        if scene == "S3" and k % 20 == 0:
            rows.append((time, rod.position_collection[2, elbow], rod.position_collection[2, -1]))
places = rod.position_collection
scenes.report(importlib.metadata.version("pyelastica"), np.isfinite(places).all(), steps, clock.cpu,
              {"start": places[:, 0], "middle": places[:, elbow], "end": places[:, -1]}, rows if scene == "S3" else None)
