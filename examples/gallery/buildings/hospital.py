"""A hospital from the data sheet of its bearings
==============================================

For whoever designs a building: three storeys on twelve triple pendulums, given by the sheet of the manufacturer, under
the M7.1 Ridgecrest earthquake of 2019. Horizontally the floors accelerate by a third of what the ground does;
vertically nothing isolates them.
"""

import matplotlib.pyplot as plt
import numpy as np

from msfp_gen import BaseSlab, Bearing, Building, BuildingBearing, BuildingScene, Motion, Solver, Storey, Top, simulate
from msfp_gen.motions.records import bundled

isolator = Bearing.from_sheet(
    device="triple", radius=["2235 mm", "406 mm"], height=["178 mm", "45 mm"], friction=[0.06, 0.02, 0.02, 0.06],
    slider_diameter=["508 mm", "200 mm"], dish_diameter=["1220 mm", "356 mm"], plate_height="70 mm",
    axial_load="1250 kN",
)  # fmt: skip
storey = Storey(
    height="4 m", mass="380 t", inertia=(7.1e6, 16e6, 23.1e6), mass_centre=("1.1 m", "0.75 m"),
    stiffness=("360 kN/mm", "300 kN/mm"), torsional_stiffness=3.5e10, vertical_stiffness="31 MN/mm",
    rocking_stiffness=(1.15e12, 2.15e12),
)  # fmt: skip
base = BaseSlab(mass="450 t", inertia=(8.4e6, 19e6, 27.4e6))
building = Building.shear(base, [storey] * 3, damping_ratio=0.05).reduced(30.0)
print("frequencies on a fixed base [Hz]:", np.round(building.frequencies[:3], 2))

# %%
# The joint between each bearing and the frame, springs and dampers, stands for steel, liner, pedestal and ground.

between = Top.node(1e9, 2e9, 5e7, damping=1e6, vertical_damping=6e6, rotational_damping=1e5)
grid = [(x, y) for x in (-11.25, -3.75, 3.75, 11.25) for y in (-7.5, 0.0, 7.5)]
motion = Motion.from_record(bundled("ridgecrest-2019-ci-ccc"), duration="20 s")
scene = BuildingScene(
    building, [BuildingBearing(isolator, between, place) for place in grid], motion, Solver(rtol=1e-3)
)
result = simulate(scene)

summary = result.summary
print(f"peak displacement of a bearing {1e3 * summary['peak_displacement']['radial']:.0f} mm")
print(f"base shear {summary['peak_force_ratio']:.3f} of the weight")
print(f"axial forces {summary['minimum_load_ratio']:.2f} to {summary['maximum_load_ratio']:.2f} times those at rest")

# %%
# Bearings isolate horizontally. Vertically they are stiff, and columns amplify what the ground does.

ground = np.abs(motion.acceleration(np.arange(0, motion.duration, 0.005))).max(axis=0)
names = ["ground", *(floor["name"] for floor in result.floors)]
figure, axes = plt.subplots()
for axis, label in (("E2", "horizontal"), ("E3", "vertical")):
    peaks = [ground[{"E2": 1, "E3": 2}[axis]], *(floor["peak_acceleration"][axis] for floor in result.floors)]
    axes.plot(peaks, names, "o-", markersize=9, label=label)
axes.set(xlabel="peak acceleration [m/s²]", xlim=(0, None))
axes.legend()
