"""A bearing of your own
=====================

For whoever has the drawings of a device: every surface and every body of a double pendulum, one cycle in a test
machine, and its hysteresis loop.
"""

from msfp_gen import Bearing, Body, Effects, Layout, Motion, Scene, Surface, Top, plot_section, simulate

dish = Surface(radius="2.2 m", capacity="200 mm", friction="6 %", yield_displacement="0.5 mm", rim_stiffness="1e8 N/m")
bearing = Bearing(
    layout=Layout.dfp(),  # three bodies: base, slider, top plate; one surface concave up, one concave down
    base_height="60 mm",
    surfaces=[dish, dish],
    bodies=[
        Body(height="200 mm", centroid="100 mm", mass="71 kg", inertia=(0.49, 0.51), rim_radius="120 mm"),
        Body(height="60 mm", centroid="30 mm", mass="181 kg", inertia=(5.6, 11.1)),
    ],
)

# %%
# A test machine holds the top plate level under 2 MN while the base moves by 300 mm. The motion stays in a plane.

machine = Top.rig(axial_load="2 MN", stiffness="1e10 N/m", rotational_stiffness="1e10 N m/rad", damping=1e6)
motion = Motion.harmonic(amplitude="300 mm", frequency="0.1 Hz", cycles=2)
result = simulate(Scene(bearing, motion, machine, effects=Effects(dimension="planar"), name="double pendulum"))

loop = result.characterise().cycles[0].loop
print(f"effective stiffness {loop.effective_stiffness / 1e6:.2f} kN/mm, damping {loop.effective_damping:.1%}")

# %%
# The stack at its largest displacement, to scale.

figure = plot_section(result)
figure.set_size_inches(6.0, 3.4)
