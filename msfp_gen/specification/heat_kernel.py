"""Frictional heating: the kernel 1/sqrt(t) of a half-space as a sum of exponentials, each one state of a surface.

The temperature is T = T_0 + sqrt(D/pi)/k times the integral of q(t - tau)/sqrt(tau) over tau (Carslaw and Jaeger; Kumar
et al. 2015). With 1/sqrt(tau) approximated by the sum of w_i exp(-lambda_i tau) it becomes T = T_0 + sum of h_i, where
dh_i/dt = -lambda_i h_i + w_i flux.

The rates lambda_i form a geometric progression. The weights w_i minimise the largest relative error over [SHORTEST,
LONGEST] under two conditions: none is negative, and the integral over [0, SHORTEST] is exact. They are fitted by
`benchmarks/heat_kernel.py`.
"""

from __future__ import annotations

SHORTEST, LONGEST = 1e-3, 1e3
"""Range of times over which the sum approximates the kernel [s]; heat older than LONGEST is neglected."""
HEAT_ERROR = 1.8e-3
"""Bound of the relative error of the kernel in that range [-]."""
HEAT_ONSET = 6e-3
"""Bound of half the integral of |error| over [0, SHORTEST] [s^1/2]: temperature error per unit change of a flux that
changes within that time (docs/friction.md)."""

HEAT_KERNEL: tuple[tuple[float, float], ...] = (
    (6.0000000000e03, 1.2078817073e02),
    (1.6832329748e03, 2.8458871434e01),
    (4.7221220791e02, 1.5622216602e01),
    (1.3247385991e02, 8.3021979222e00),
    (3.7164061550e01, 4.3187491334e00),
    (1.0425962313e01, 2.3486816271e00),
    (2.9248872599e00, 1.2081621465e00),
    (8.2054444726e-01, 6.5997556553e-01),
    (2.3019457849e-01, 3.3852067045e-01),
    (6.4578517522e-02, 1.8581755062e-01),
    (1.8116781693e-02, 9.3342760085e-02),
    (5.0824607238e-03, 5.7161762604e-02),
    (1.4258275806e-03, 1.0537004578e-02),
    (4.0000000000e-04, 4.2786061899e-02),
)
"""(lambda_i [1/s], w_i [s^-1/2])."""
