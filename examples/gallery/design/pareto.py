"""A Pareto front with pymoo
=========================

For whoever has two conflicting aims: least displacement and least base shear of a triple pendulum under a
record. NSGA-II of pymoo proposes friction and radii, and each generation is a batch of runs.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from msfp_gen import load_scene, simulate_batch

DESIGNS, GENERATIONS = 8, 3  # for a real search 32 and 20
scene = load_scene("ridgecrest-clc")
scene = replace(scene, duration=15.0, solver=replace(scene.solver, rtol=1e-2))
friction = np.array([surface.friction for surface in scene.bearing.surfaces])
radii = np.array([surface.radius for surface in scene.bearing.surfaces])


class Design(Problem):
    """Factors of friction and radii, and two objectives; a run that fails is the worst of all."""

    def __init__(self):
        super().__init__(n_var=2, n_obj=2, xl=0.5, xu=2.0)

    def _evaluate(self, x, out, *_, **__):
        bearings = [scene.bearing.replace(friction=a * friction, radius=b * radii) for a, b in x]
        results = simulate_batch([replace(scene, bearing=bearing) for bearing in bearings])
        out["F"] = np.array([objectives(result) for result in results])


def objectives(result):
    """Peak displacement [m] and peak force over load."""
    if not result.succeeded:
        return 1e9, 1e9
    return result.summary["peak_displacement"]["radial"], result.summary["peak_force_ratio"]


# %%
# The designs that no other design beats in both objectives.

found = minimize(Design(), NSGA2(pop_size=DESIGNS), ("n_gen", GENERATIONS), seed=1)
for x, (displacement, force) in sorted(zip(found.X.tolist(), found.F.tolist(), strict=True), key=lambda row: row[1]):
    print(f"friction x {x[0]:.2f}, radii x {x[1]:.2f}: {1e3 * displacement:5.0f} mm, {force:.3f} of the load")

figure, axes = plt.subplots()
axes.scatter(1e3 * found.F[:, 0], found.F[:, 1], 90, found.X[:, 0], cmap="viridis")
figure.colorbar(axes.collections[0], label="factor of friction")
axes.set(xlabel="displacement [mm]", ylabel="force / load")
