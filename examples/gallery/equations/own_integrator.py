"""An integrator of your own
=========================

For whoever has a method to try: the implicit midpoint rule in ten lines, on the right-hand side and the exact Jacobian
of a double pendulum below a mass. A step of half the length divides the error by four on average.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

from msfp_gen import Effects, Layout, Motion, Top, build_model, presets

model = build_model(Layout.dfp(), Effects(dimension="planar"))
motion = Motion.harmonic(amplitude="30 mm", frequency="0.5 Hz")
top = Top.mass("30 t", inertia="5000 kg m^2", height="0.2 m", rotational_stiffness=1e8, rotational_damping=1e5)
fun, jac, y0 = model.as_ode(presets.bearing("double-fp"), motion, top)  # y: angles, their rates, friction


def midpoint(end, step):
    """States at the ends of all steps."""
    states = [y0]
    for t in np.arange(step / 2, end, step):
        y = states[-1]
        middle = y
        for _ in range(20):
            miss = middle - y - step / 2 * fun(t, middle)
            change = np.linalg.solve(np.eye(len(y)) - step / 2 * jac(t, middle), miss)
            middle = middle - change
            if np.abs(change).max() < 1e-12:
                break
        states.append(2 * middle - y)
    return np.array(states)


# %%
# SciPy takes the same functions, and is the reference.

END = 0.5  # [s]
reference = solve_ivp(fun, (0, END), y0, method="Radau", jac=jac, rtol=1e-10, atol=1e-12).y[:6, -1]
steps = END / np.array([64, 128, 256, 512])
errors = [np.abs(midpoint(END, step)[-1, :6] - reference).max() for step in steps]
for step, error in zip(steps, errors, strict=True):
    print(f"step {1e3 * step:.1f} ms: error of the angles {error:.1e} rad")

# %%
# The errors are of second order in the step: halving it three times divides them by 57, nearly 4 x 4 x 4.

figure, axes = plt.subplots()
axes.loglog(1e3 * steps, errors, "o-", markersize=9, label="midpoint rule")
axes.loglog(1e3 * steps, errors[-1] * (steps / steps[-1]) ** 2, "--", label="order 2")
axes.minorticks_off()
axes.set_xticks([1, 2, 4, 8], ["1", "2", "4", "8"])
axes.set(xlabel="step [ms]", ylabel="error [rad]")
axes.legend()
