"""Fit the heat kernels of half-space and plate by sums of exponentials: `python benchmarks/heat_kernel.py`.

Prints the tables of `msfp_gen/specification/friction_laws.py` and draws `docs/figures/heat-kernel.png`: the error of the sum, and a
temperature computed by the sum and by the exact convolution.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from drawing import COLOURS, drawn, panels
from numpy.typing import NDArray
from quick import docs_folder, parser

from msfp_gen.specification.friction_laws import HEAT_ERROR, HEAT_KERNEL, LONGEST, PLATE_KERNEL, SHORTEST, THICK

Array = NDArray[np.float64]
FASTEST, SLOWEST = 6.0, 0.4  # rates of the first and last term, over 1/SHORTEST and 1/LONGEST
NEXT = 4.32  # slowest fitted rate of a plate over that of its slowest mode; the second mode has 4


def fit(rates: Array, kernel: Callable[[Array], Array], times: Array, known: Array) -> tuple[Array, float]:
    """Weights >= 0 of rates [1/s] with the least relative error of a kernel over `times`, and that error.

    They solve a linear programme; the integral of the sum over [0, times[0]], where the kernel is 1/sqrt(t), is exact.
    known: weights of the first rates.
    """
    from scipy.optimize import linprog

    count, values, shortest = len(rates) - len(known), kernel(times), times[0]
    scale = np.sqrt(rates[len(known) :])  # scales the weights so that the columns have similar size
    terms, before = np.split(np.exp(-np.outer(times, rates)) / values[:, None], [len(known)], axis=1)[::-1]
    left, terms = 1 - before @ known, scale * terms
    bound = -np.ones((len(times), 1))
    with np.errstate(invalid="ignore"):
        whole = np.where(rates > 0, (1 - np.exp(-rates * shortest)) / rates, shortest) / (2 * np.sqrt(shortest))
    found = linprog(
        np.r_[np.zeros(count), 1.0],
        A_ub=np.vstack([np.hstack([terms, bound]), np.hstack([-terms, bound])]),
        b_ub=np.r_[left, -left],
        A_eq=np.r_[scale * whole[len(known) :], 0.0][None],
        b_eq=[1.0 - whole[: len(known)] @ known],
        method="highs",
    )
    return np.r_[known, scale * found.x[:-1]], float(found.x[-1])


def half_space(count: int) -> tuple[Array, Array, float]:
    """Rates in geometric progression [1/s], weights, and the error."""
    rates = np.geomspace(FASTEST / SHORTEST, SLOWEST / LONGEST, count)
    return rates, *fit(rates, lambda t: 1 / np.sqrt(t), np.geomspace(SHORTEST, LONGEST, 600), np.array([]))


def plate(count: int) -> tuple[Array, Array, float]:
    """The same of a plate, in the time tau D/d^2: two exact terms, then a geometric progression."""
    shortest = SHORTEST / (THICK * LONGEST)
    rates = np.r_[0.0, np.pi**2, np.geomspace(NEXT * np.pi**2, FASTEST / shortest, count - 2)]
    known = np.sqrt(np.pi) * np.array([1.0, 2.0])
    return rates, *fit(rates, images, np.geomspace(shortest, 1.0, 900), known)


def images(tau: Array) -> Array:
    """The kernel of a plate with an insulated back face, by images [-]."""
    n = np.arange(1, 20)
    return np.asarray((1 + 2 * np.exp(-np.divide.outer(n**2, tau)).sum(0)) / np.sqrt(tau))


def summed(times: Array) -> Array:
    """The sum of exponentials of HEAT_KERNEL at `times` [s]."""
    return sum(weight * np.exp(-rate * times) for rate, weight in HEAT_KERNEL)  # type: ignore[return-value]


def draw() -> None:
    """The figure of docs/friction.md."""
    t = np.geomspace(SHORTEST / 30, LONGEST * 30, 2000)
    strokes = np.linspace(0, 60, 60001)
    flux = np.abs(np.sin(2 * np.pi * 0.25 * strokes)) * (np.abs(np.cos(2 * np.pi * 0.25 * strokes)) < 0.7)
    with drawn(docs_folder() / "figures" / "heat-kernel.png", 9.0, 3.2) as figure:
        error, rise = panels(figure, "relative error of the sum", "rise under strokes of a patch")
        error.semilogx(t, 100 * (summed(t) * np.sqrt(t) - 1), color=COLOURS[0])
        error.axvspan(SHORTEST, LONGEST, color=COLOURS[1], alpha=0.12, lw=0)
        for bound in (-HEAT_ERROR, HEAT_ERROR):
            error.axhline(100 * bound, color=COLOURS[1], lw=0.8, ls="--", label=f"bound ±{100 * HEAT_ERROR:g} %")
        error.legend(*[each[:1] for each in error.get_legend_handles_labels()])
        error.set(xlabel="time since the heat input [s]", ylabel="[%]", ylim=(-1, 1))
        exact, found = convolved(strokes, flux), marched(strokes, flux)
        rise.plot(strokes, exact, color=COLOURS[0], label="exact convolution")
        rise.plot(strokes, found, color=COLOURS[1], ls="--", label=f"{len(HEAT_KERNEL)} exponential states")
        rise.set(xlabel="time [s]", ylabel="rise over flux √(D/π)/k [√s]")
        rise.legend()
    print(f"largest difference on the right: {np.abs(found - exact).max() / exact.max():.2e} of the peak")


def convolved(t: Array, flux: Array) -> Array:
    """Duhamel's integral, exact for a flux that is constant over each interval."""
    step, mean = t[1] - t[0], (flux[1:] + flux[:-1]) / 2
    gain = 2 * (np.sqrt(np.arange(1, len(t)) * step) - np.sqrt(np.arange(len(t) - 1) * step))
    from scipy.signal import fftconvolve

    return np.r_[0.0, fftconvolve(mean, gain)[: len(mean)]]


def marched(t: Array, flux: Array) -> Array:
    """The same integral by the exponential states, whose update is exact for such a flux."""
    step, mean = t[1] - t[0], (flux[1:] + flux[:-1]) / 2
    rate, weight = np.array(HEAT_KERNEL).T
    decay = np.exp(-rate * step)
    state, out = np.zeros(len(rate)), [0.0]
    for q in mean:
        state = decay * state + weight * (1 - decay) / rate * q
        out.append(state.sum())
    return np.array(out)


def main() -> Any:
    """Print the fits and draw the figure."""
    parser(__doc__).parse_args()
    for name, table, found in (("half-space", HEAT_KERNEL, half_space), ("plate", PLATE_KERNEL, plate)):
        rates, weights, error = found(len(table))
        apart = np.abs(np.column_stack([rates, weights]) / np.where(np.array(table) == 0, 1, table) - 1)[1:].max()
        print(f"{name}: {len(rates)} terms, relative error {error:.3e} (table: {HEAT_ERROR:.1e}, apart {apart:.1e})")
        for rate, weight in zip(rates, weights, strict=True):
            print(f"    ({rate:.10e}, {weight:.10e}),")
    draw()


if __name__ == "__main__":
    main()
