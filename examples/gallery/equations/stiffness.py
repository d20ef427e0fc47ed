"""Stiffness and natural frequencies of a triple pendulum at rest
==============================================================

What is the stiffness of a triple friction pendulum below a mass, before it slides and without friction, and how fast do
its light sliders vibrate? The equations of motion of PEER Report 2017/07 answer this in symbols: they are linearised at
rest, and positions and sizes of the normal forces are eliminated.
"""

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from scipy.linalg import eigvalsh

from msfp_gen import Effects, Layout, Top, presets, symbolic

# %%
# The equations of the plane, without rims. At rest every tilt, rate, acceleration and friction state is zero. Dampers
# and the horizontal springs of a rig are left out too.

model = symbolic(Layout.tfp(), Effects(dimension="planar", rims=False))
bodies = model.spec.layout.surfaces
rest = dict.fromkeys((*model.state, *model.unknowns[:-bodies], *model.inputs), 0)
rest |= {s: 0 for s in model.parameters if s.name[:2] in ("T_", "c_", "u_") or s.name == "k_T"}
print([row for row in model.residual.subs(rest).expanded() if row != 0])

# %%
# These rows are zero if each normal force is the weight above it. The rest is linear algebra: with the unknowns
# (a, c), accelerations and contacts, and the state (q, v, h), the balances are J (a, c) + S (q, v, h) = 0. The linear
# balances give c, and what is left of the angular ones is M a + K q + F h = 0. Tilts of bodies against the vertical,
# instead of against the body below, make the matrices symmetric.


def at_rest(expressions):
    """A Jacobian at rest, over symbols alone."""
    return sp.Matrix(expressions.subs(rest).expanded())


J, S = at_rest(model.jacobian("unknowns")), at_rest(model.jacobian("state"))
forces, moments = ([i for i, name in enumerate(model.residual.names) if name[0] == letter] for letter in "Et")
relative = sp.Matrix(bodies, bodies, lambda i, j: 1 if i == j else -1 if i == j + 1 else 0)
contacts = J[:, bodies:]
given = sp.Matrix.hstack(J[:, :bodies], S) * sp.diag(relative, relative, relative, sp.eye(bodies))
reduced = given[moments, :] - contacts[moments, :] * contacts[forces, :].LUsolve(given[forces, :])
M, K, D, F = (reduced[:, i * bodies : (i + 1) * bodies].applyfunc(sp.factor) for i in range(4))
assert D.is_zero_matrix
print("stiffness of the lowest slider:", K[0, 0])

# %%
# A slider hangs between its sphere centres and so has a stiffness; the top plate stands, and k_R holds it. K is
# diagonal: the weights couple no two bodies. Before a surface slides friction is a spring, since dY/dt is the slip
# velocity over the yield displacement, and Y = B q. It adds the stiffness F B.

B = at_rest(model.friction_rates.jacobian(model.state))[:, bodies : 2 * bodies] * relative
stuck = (F * B).applyfunc(sp.factor)
print("friction at the lowest slider:", stuck[0, 0])

# %%
# Numbers: the bearing of PEER Report 2017/07 below 11.4 t, whose columns keep the plate level.

bearing = presets.bearing("fenz-tfp")
top = Top.mass(112e3 / bearing.gravity, inertia=1e4, height=0.5, rotational_stiffness=1e8)
above = np.cumsum([top.mass, *(body.mass for body in reversed(bearing.bodies))])[:0:-1]  # mass on each surface
symbols = (*model.parameters, *model.unknowns[-bodies:])
numbers = dict(zip(symbols, (*model.values(bearing, top), *(bearing.gravity * above)), strict=True))
mass, hanging, friction = (np.array(matrix.subs(numbers), dtype=float) for matrix in (M, K, stuck))
found, free = (np.sqrt(eigvalsh(stiffness, mass)) / (2 * np.pi) for stiffness in (hanging + friction, hanging))
print("stuck [Hz]:", found.round(2))
print("without friction [Hz]:", free.round(3))

# %%
# Without friction the lowest mode is a pendulum as long as the links of the sliders between their sphere centres,
# R_1 + R_4 less the heights of the three sliders: the length that the published formulas have for outer surfaces.

length = bearing.surfaces[0].radius + bearing.surfaces[-1].radius - sum(body.height for body in bearing.bodies[:-1])
print("pendulum [Hz]:", round(np.sqrt(bearing.gravity / length) / (2 * np.pi), 3))

# %%
# Friction that sticks raises every frequency; the sliders alone vibrate at more than a kilohertz.

figure, axes = plt.subplots()
axes.semilogy(range(1, bodies + 1), found, "o", markersize=12, label="stuck")
axes.semilogy(range(1, bodies + 1), free, "s", markersize=12, label="without friction")
axes.set(xlabel="mode", ylabel="frequency [Hz]", xticks=range(1, bodies + 1))
axes.legend()
