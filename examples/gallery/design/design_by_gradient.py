"""A design by gradients
=====================

For whoever looks for friction and radius: the least base shear of a triple pendulum that stays within 200 mm under two
earthquakes. Every run gives its derivatives too, so that SciPy needs few of them. docs/gradients.md explains the design
and confirms the result by a scan.
"""

from dataclasses import replace
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import minimize

from msfp_gen import changed_scene, simulate

# The displacement [m]; and units of friction, radius [m] and shear, in which the unknowns are of the order of one.
LIMIT, UNIT = 0.200, np.array([0.1, 1.0, 0.1])
RECORDS = {"ridgecrest-ccc": 1.0, "ridgecrest-clc": 2.0}  # presets and factors: ground velocities near 0.9 m/s
PATHS = [f"bearing.surfaces[{surface}].{field}" for field in ("friction", "radius") for surface in (0, 3)]
CHANGES = {"motion.components": ["E1", "E2"], "motion.duration": 30.0, "output_step": 0.1}
CHANGES |= {"bearing": "prototype-tfp", "effects": {"bouc_wen": "report"}}  # friction is constant

# Each record under a rigid mass, with the same model in every run.
made = [changed_scene(preset, CHANGES | {"motion.scale": factor}) for preset, factor in RECORDS.items()]
scenes = [replace(s, effects=s.modelled, top=replace(s.top, vertical_stiffness=None, vertical_damping=0)) for s in made]


def changed(scene, mu, r):
    """The scene with another friction coefficient and radius [m] of the outer surfaces; the inner ones stay."""
    return replace(scene, bearing=scene.bearing.replace(friction=[mu, 0.04, 0.04, mu], radius=[r, 0.152, 0.152, r]))


# %%
# Runs and their derivatives, which have the same keys. A value that both outer surfaces share has the sum of their two
# derivatives.

path = []


@cache
def responses(friction, radius):
    """Largest displacement [m] and shear by record, shape (2, 2), and by friction and radius, shape (2, 2, 2)."""
    path.append([friction, radius])
    runs = [simulate(changed(scene, friction, radius), gradients=PATHS) for scene in scenes]
    summaries = [[run.summary, *run.gradient_summary.values()] for run in runs]
    found = np.array([[(s["peak_displacement"]["radial"], s["peak_force_ratio"]) for s in each] for each in summaries])
    return found[:, 0], found[:, 1:].reshape(2, 2, 2, 2).sum(axis=2)


# %%
# The larger of two shears has a kink. A third unknown, an upper bound of both, is minimised in its place.


def margins(x):
    """Of displacement and shear of each record, shape (4,): not negative in a permissible design."""
    return np.ravel([1.0, x[2]] - responses(*(x * UNIT)[:2])[0] / [LIMIT, UNIT[2]])


def margin_slopes(x):
    """Derivatives of the margins by the unknowns, shape (4, 3)."""
    slopes = responses(*(x * UNIT)[:2])[1] * UNIT[:2, np.newaxis] / [LIMIT, UNIT[2]]
    return np.insert(-slopes.swapaxes(1, 2).reshape(4, 2), 2, [0.0, 1.0, 0.0, 1.0], axis=1)


def design(friction, radius):
    """The search from a start."""
    return minimize(
        lambda x: (x[2], [0.0, 0.0, 1.0]), np.array([friction, radius, 0.2]) / UNIT, jac=True, method="SLSQP", tol=1e-6,
        bounds=[(0.5, 1.2), (0.6, 1.8), (0, 5)], constraints={"type": "ineq", "fun": margins, "jac": margin_slopes},
    )  # fmt: skip


found = design(0.08, 0.946)
print("friction, radius [m] and shear:", (found.x * UNIT).round(4), f"in {found.nit} iterations")

# %%
# From the start to the optimum, where both displacements are at their limit.

steps = np.array([responses(*each)[0] for each in path])
figure, axes = plt.subplots(subplot_kw={"xlabel": "displacement [mm]", "ylabel": "shear / weight"})
axes.plot(1e3 * steps[..., 0], steps[..., 1], "o-", markersize=9, label=["CCC", "CLC"])
axes.axvline(1e3 * LIMIT, color="black", linestyle="--", label="limit")
axes.legend()
