"""Floor spectra above bearings
============================

For whoever fastens equipment: response spectra of the ground and of the roof of a two-storey building on four triple
pendulums. Up to a period of a second the roof has a fraction of the ground's spectral acceleration; at long periods the
bearings reduce nothing.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import BaseSlab, Building, BuildingBearing, BuildingScene, Motion, Solver, Storey, Top, presets, simulate
from msfp_gen.motions.records import bundled, response_spectrum

storey = Storey(
    "3.5 m", "150 t", inertia=(3.2e6, 7.2e6, 10.4e6), stiffness="200 kN/mm", torsional_stiffness=2e10,
    vertical_stiffness="10 MN/mm", rocking_stiffness=(5e11, 1e12),
)  # fmt: skip
base = BaseSlab("150 t", inertia=(3.2e6, 7.2e6, 10.4e6))
building = Building.shear(base, [storey] * 2, damping_ratio=0.05).reduced(30.0)
between = Top.node(1e9, 2e9, 5e7, damping=1e6, vertical_damping=6e6, rotational_damping=1e5)
corners = [(x, y) for x in (-10.0, 10.0) for y in (-7.0, 7.0)]
bearings = [BuildingBearing(presets.bearing("building-tfp"), between, place) for place in corners]
motion = Motion.from_record(bundled("ridgecrest-2019-ci-ccc"), duration="20 s")
result = simulate(BuildingScene(building, bearings, motion, Solver(rtol=1e-3)))

# %%
# Pseudo-accelerations with 5 % damping along E1.

periods = np.geomspace(0.05, 5.0, 40)
ground = response_spectrum(motion, periods).psa[:, 0]
roof = result.floor_spectra(periods).nodes[-1, :, 0]
for period in (0.2, 0.5, 1.0, 3.0):
    one, other = (np.interp(period, periods, values) for values in (ground, roof))
    print(f"{period:.1f} s: ground {one:5.2f}, roof {other:5.2f} m/s^2")
print("frequencies on a fixed base [Hz]:", building.frequencies[:3].round(2))

figure, axes = plt.subplots()
axes.loglog(periods, ground, label="ground")
axes.loglog(periods, roof, label="roof")
axes.set(xlabel="period [s]", ylabel="spectral acc. [m/s²]")
axes.legend()
