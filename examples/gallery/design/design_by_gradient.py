"""A design by gradients
=====================

For whoever looks for friction and radius: the least base shear of a triple pendulum that stays within 200 mm under two
earthquakes. Every run gives its derivatives too, so that SciPy needs few of them. docs/gradients.md explains the design
and confirms the result by a scan.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import minimize

from msfp_gen import changed_scene, simulate

LIMIT = 0.200  # displacement [m]
RECORDS = {"ridgecrest-ccc": 1.0, "ridgecrest-clc": 2.0}  # presets and factors: ground velocities near 0.9 m/s
OUTER = 0, 3  # surfaces that are designed; the inner ones stay as they are
PATHS = [f"bearing.surfaces[{surface}].{field}" for field in ("friction", "radius") for surface in OUTER]
UNIT = np.array([0.1, 1.0, 0.1])  # of friction, radius [m], bound of the shear: unknowns of the order of one


def scene(preset, factor):
    """A record times a factor, under a rigid mass with constant friction; the same model in every run."""
    changes = {"motion.components": ["E1", "E2"], "motion.duration": 30.0, "motion.scale": factor}
    made = changed_scene(preset, changes | {"bearing": "prototype-tfp", "effects": {"bouc_wen": "report"}})
    rigid = replace(made.top, vertical_stiffness=None, vertical_damping=0.0)
    return replace(made, top=rigid, effects=made.modelled, output_step=0.1)


def changed(scene, friction, radius):
    """The scene with another friction coefficient and radius [m] of the outer surfaces."""
    surfaces = scene.bearing.surfaces
    mu = [friction if i in OUTER else surface.friction for i, surface in enumerate(surfaces)]
    r = [radius if i in OUTER else surface.radius for i, surface in enumerate(surfaces)]
    return replace(scene, bearing=scene.bearing.replace(friction=mu, radius=r))


# %%
# A run and its derivatives. A value that both outer surfaces share has the sum of their two derivatives.


def response(scene):
    """Largest displacement [m] and shear of a run, shape (2,), and their derivatives, shape (2, 2)."""
    run = simulate(scene, gradients=PATHS)
    values = run.summary["peak_displacement"]["radial"], run.summary["peak_force_ratio"]
    found = [run.gradient_summary[path] for path in PATHS]
    slopes = np.array([[each["peak_displacement"]["radial"], each["peak_force_ratio"]] for each in found])
    return np.array(values), slopes.reshape(2, 2, 2).sum(axis=1).T


scenes = [scene(*record) for record in RECORDS.items()]


@cache
def responses(friction, radius):
    """The same of all records, which run at the same time: one more dimension, the first."""
    with ThreadPoolExecutor() as pool:
        found = list(pool.map(response, [changed(each, friction, radius) for each in scenes]))
    return tuple(np.array(parts) for parts in zip(*found, strict=True))


# %%
# The larger of two shears has a kink. A third unknown, an upper bound of both, is minimised in its place.

path = []


def at(x):
    """Responses at the unknowns."""
    return responses(*(x * UNIT)[:2].tolist())


def margins(x):
    """Of displacement and shear: not negative in a permissible design."""
    displacement, shear = at(x)[0].T
    return np.concatenate([1 - displacement / LIMIT, x[2] - shear / UNIT[2]])


def margin_slopes(x):
    """Derivatives of the margins by the unknowns."""
    _, slopes = at(x)
    displacement = np.column_stack([-slopes[:, 0] * UNIT[:2] / LIMIT, np.zeros(len(scenes))])
    shear = np.column_stack([-slopes[:, 1] * UNIT[:2] / UNIT[2], np.ones(len(scenes))])
    return np.vstack([displacement, shear])


def design(friction, radius):
    """The search from a start."""
    path.append([friction, radius])
    return minimize(
        lambda x: x[2],
        np.array([friction, radius, 0.2]) / UNIT,
        jac=lambda x: np.array([0.0, 0.0, 1.0]),
        constraints={"type": "ineq", "fun": margins, "jac": margin_slopes},
        bounds=[(0.5, 1.2), (0.6, 1.8), (0.0, 5.0)],
        method="SLSQP",
        options={"ftol": 1e-6},
        callback=lambda x: path.append((x * UNIT)[:2].tolist()),
    )


found = design(0.08, 0.946)
friction, radius, shear = found.x * UNIT
print(f"friction {friction:.4f}, radius {radius:.3f} m, shear {shear:.4f}, {found.nit} iterations: {found.message}")

# %%
# From the start to the optimum, where both displacements are at their limit.

steps = np.array([responses(*each)[0] for each in path])
figure, axes = plt.subplots()
for record, name in enumerate(RECORDS):
    axes.plot(1e3 * steps[:, record, 0], steps[:, record, 1], "o-", markersize=9, label=name[-3:].upper())
axes.axvline(1e3 * LIMIT, color="black", linestyle="--", label="limit")
axes.set(xlabel="displacement [mm]", ylabel="shear / weight")
axes.legend()
