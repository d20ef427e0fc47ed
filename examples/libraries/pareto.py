"""A Pareto front with pymoo
=========================

Friction and radii of a triple pendulum, between 0.5 and 2 times those of PEER 2017/07, for the least displacement and
the least base shear under a record. NSGA-II of pymoo proposes designs; each generation is a batch of scenes.
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
scene = replace(scene, duration=25.0, solver=replace(scene.solver, rtol=1e-2))
friction = np.array([surface.friction for surface in scene.bearing.surfaces])
radii = np.array([surface.radius for surface in scene.bearing.surfaces])


class Design(Problem):
    """Shares of friction and radii, and two objectives; a run that fails is the worst of all."""

    def __init__(self):
        super().__init__(n_var=2, n_obj=2, xl=0.5, xu=2.0)

    def _evaluate(self, x, out, *_, **__):
        bearings = [scene.bearing.replace(friction=a * friction, radius=b * radii) for a, b in x]
        results = simulate_batch([replace(scene, bearing=bearing) for bearing in bearings])
        out["F"] = np.array([objectives(result) for result in results])


def objectives(result):
    """Peak displacement [m] and peak force [N]."""
    if result.status != "ok":
        return 1e9, 1e9
    return result.summary["peak_displacement"]["radial"], result.summary["peak_force"]["radial"]


found = minimize(Design(), NSGA2(pop_size=DESIGNS), ("n_gen", GENERATIONS), seed=1)
for x, (displacement, force) in sorted(zip(found.X.tolist(), found.F.tolist(), strict=True), key=lambda row: row[1]):
    print(f"friction x {x[0]:.2f}, radii x {x[1]:.2f}: {1e3 * displacement:5.0f} mm, {1e-3 * force:5.1f} kN")

figure, axes = plt.subplots()
axes.plot(1e3 * found.F[:, 0], 1e-3 * found.F[:, 1], "o")
axes.set(xlabel="peak displacement [mm]", ylabel="peak force [kN]")
