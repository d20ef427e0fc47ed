"""Fit the heat kernel 1/sqrt(t) by a sum of exponentials: `python benchmarks/heat_kernel.py`.

Prints the table of `msfp_gen/specification/friction_laws.py` and draws `docs/figures/heat-kernel.png`: the error of the sum, and a
temperature computed by the sum and by the exact convolution.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from drawing import COLOURS, drawn, panels
from numpy.typing import NDArray
from quick import docs_folder, parser

from msfp_gen.specification.friction_laws import HEAT_ERROR, HEAT_KERNEL, LONGEST, SHORTEST

Array = NDArray[np.float64]
FASTEST, SLOWEST = 6.0, 0.4  # rates of the first and last term, over 1/SHORTEST and 1/LONGEST


def fit(count: int) -> tuple[Array, Array, float]:
    """Rates in geometric progression [1/s], weights >= 0 with the least relative error, and that error.

    The weights solve a linear programme; the integral of the sum over [0, SHORTEST] is exact.
    """
    from scipy.optimize import linprog

    rates = np.geomspace(FASTEST / SHORTEST, SLOWEST / LONGEST, count)
    times = np.geomspace(SHORTEST, LONGEST, 600)
    scale = np.sqrt(rates)  # scales the weights so that the columns have similar size
    terms = scale * np.exp(-np.outer(times, rates)) * np.sqrt(times)[:, None]
    bound = -np.ones((len(times), 1))
    first = scale * (1 - np.exp(-rates * SHORTEST)) / rates / (2 * np.sqrt(SHORTEST))
    found = linprog(
        np.r_[np.zeros(count), 1.0],
        A_ub=np.vstack([np.hstack([terms, bound]), np.hstack([-terms, bound])]),
        b_ub=np.r_[np.ones(len(times)), -np.ones(len(times))],
        A_eq=np.r_[first, 0.0][None],
        b_eq=[1.0],
        method="highs",
    )
    return rates, scale * found.x[:-1], float(found.x[-1])


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
    """Print the fit and draw the figure."""
    parser(__doc__).parse_args()
    rates, weights, error = fit(len(HEAT_KERNEL))
    print(f"{len(rates)} terms, relative error {error:.3e} (table: {HEAT_ERROR:.1e})")
    for rate, weight in zip(rates, weights, strict=True):
        print(f"    ({rate:.10e}, {weight:.10e}),")
    draw()


if __name__ == "__main__":
    main()
