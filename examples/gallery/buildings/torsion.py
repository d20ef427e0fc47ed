"""Torsion of an eccentric building
================================

For whoever adds 5 % of accidental eccentricity: strength and stiffness of a pendulum grow with the load on it, so that
bearings below the heavy side resist more. A building whose masses are off the centre hardly twists, while the formula
of codes predicts amplification.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import BaseSlab, Building, BuildingBearing, BuildingScene, Motion, Solver, Storey, Top, presets, simulate
from msfp_gen.motions.records import bundled

B, D = 24.0, 16.0  # plan [m]
motion = Motion.from_record(bundled("ridgecrest-2019-ci-ccc"), duration="20 s")
between = Top.node(1e9, 2e9, 5e7, damping=1e6, vertical_damping=6e6, rotational_damping=1e5)
grid = [(x, y) for x in (-10.0, 10.0) for y in (-7.0, 7.0)]


def amplification(share):
    """Largest displacement at a bearing over the displacement at the centre, with masses off the centre."""
    base = BaseSlab("150 t", inertia=(3.2e6, 7.2e6, 10.4e6), mass_centre=(share * B, 0.0))
    storey = Storey(
        "3.5 m", "150 t", inertia=(3.2e6, 7.2e6, 10.4e6), mass_centre=(share * B, 0.0), stiffness="200 kN/mm",
        torsional_stiffness=2e10, vertical_stiffness="10 MN/mm", rocking_stiffness=(5e11, 1e12),
    )  # fmt: skip
    building = Building.shear(base, [storey] * 2, damping_ratio=0.05).reduced(30.0)
    bearings = [BuildingBearing(presets.bearing("building-tfp"), between, place) for place in grid]
    result = simulate(BuildingScene(building, bearings, motion, Solver(rtol=1e-3)))
    u = result.bearing_displacement[..., :2]
    return np.linalg.norm(u, axis=-1).max() / np.linalg.norm(u.mean(axis=1), axis=-1).max()


# %%
# The formula of ASCE 7 is 1 + y 12 e/(b^2 + d^2), with y the distance of the outermost bearing.

shares = np.array([0.0, 0.05, 0.10])
code = 1 + 10.0 * 12 * shares * B / (B**2 + D**2)
run = np.array([amplification(share) for share in shares])
for share, one, other in zip(shares, code, run, strict=True):
    print(f"eccentricity {share:.0%}: {one:.3f} by the formula, {other:.3f} by the run")

figure, axes = plt.subplots()
axes.plot(100 * shares, code, "o--", markersize=9, label="formula")
axes.plot(100 * shares, run, "o-", markersize=9, label="run")
axes.set(xlabel="eccentricity [% of plan]", ylabel="corner / centre", ylim=(0.9, 1.4))
axes.legend(loc="upper left")
