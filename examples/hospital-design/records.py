"""Nine artificial records for suite.toml: three components each, made to the shape of the target spectrum.

Two recorded motions with a vertical component come with the program. Where a project has records of its site, name them
in suite.toml in their place. An artificial record is noise below an envelope, whose Fourier amplitudes are multiplied
by target over response spectrum until both agree; a smooth random factor leaves each record a spectrum of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from msfp_gen.motions.records import Record, ScaleTo, response_spectrum

STEP, DURATION = 0.01, 20.0  # [s]
PERIODS = np.geomspace(0.04, 6.0, 60)  # at which spectra are compared [s]
LONGEST = 7.0  # period beyond which there is no motion [s]
G = 9.80665
TARGET = ScaleTo(sds=1.0 * G, sd1=0.5 * G, between=(1.5, 4.5))  # as in suite.toml
SCATTER, ROUNDS = 0.25, 8  # standard deviation of the logarithm of a spectrum [-]; rounds of adjustment


def envelope(time: np.ndarray) -> np.ndarray:
    """Rise of 3 s, strong motion of 7 s, decay; shape of time [-]."""
    rise, decay = np.clip(time / 3.0, 0.0, 1.0) ** 2, np.exp(-0.3 * np.clip(time - 10.0, 0.0, None))
    return rise * decay * np.clip((DURATION - time) / 2.0, 0.0, 1.0)


def target(vertical: bool) -> np.ndarray:
    """Pseudo-acceleration of a component at PERIODS [m/s^2]; of the vertical one at three times the period."""
    period, values = TARGET.curve(PERIODS)
    if not vertical:
        return np.interp(PERIODS, period, values)
    return 0.6 * np.interp(np.minimum(3.0 * PERIODS, PERIODS[-1]), PERIODS, np.interp(PERIODS, period, values))


def wanted_spectra(random: np.random.Generator) -> np.ndarray:
    """What one record is made to: the target of each component times a smooth random factor, shape (periods, 3)."""
    knots = np.linspace(0.0, 1.0, 9)
    at = np.linspace(0.0, 1.0, len(PERIODS))  # both even in the logarithm of the period
    factors = [np.exp(np.interp(at, knots, random.normal(0.0, SCATTER, len(knots)))) for _ in range(3)]
    return np.column_stack([target(axis == 2) * factor for axis, factor in enumerate(factors)])


def artificial(seed: int) -> np.ndarray:
    """Accelerations along E1, E2, E3 at multiples of STEP, shape (k, 3) [m/s^2]."""
    random = np.random.default_rng(seed)
    count = round(DURATION / STEP) + 1
    time, length = STEP * np.arange(count), 4 * count
    frequency = np.fft.rfftfreq(length, STEP)
    at = 1.0 / np.maximum(frequency, 1e-9)  # periods
    passes = np.clip(4.0 * (frequency * LONGEST - 1.0), 0.0, 1.0)
    wanted = wanted_spectra(random)
    noise = random.normal(size=(count, 3)) * envelope(time)[:, None]
    shape = np.fft.rfft(noise, length, axis=0) * passes[:, None]
    for _ in range(ROUNDS):
        motion = np.fft.irfft(shape, length, axis=0)[:count] * envelope(time)[:, None] ** 0.1
        record = Record(name="", time_step=STEP, acceleration=motion)
        ratio = wanted / response_spectrum(record, PERIODS).psa[:, :3]
        for axis in range(3):
            factor = np.interp(np.log(at[::-1]), np.log(PERIODS), ratio[:, axis])[::-1]
            shape[:, axis] = np.fft.rfft(motion[:, axis], length) * factor * passes
    return motion


def write_records(folder: Path, numbers: Sequence[int] = range(1, 10)) -> list[Path]:
    """Write artificial-1.csv to artificial-9.csv in a folder; those that are there stay."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"artificial-{number}.csv" for number in numbers]
    for number, path in zip(numbers, paths, strict=True):
        if not path.is_file():
            motion = artificial(seed=number)
            rows = np.column_stack([STEP * np.arange(len(motion)), motion])
            header = "time [s], a1 [m/s^2], a2 [m/s^2], a3 [m/s^2]"
            np.savetxt(path, rows, fmt=["%.2f", "%.4f", "%.4f", "%.4f"], delimiter=", ", header=header, comments="")
    return paths


if __name__ == "__main__":
    write_records(Path(__file__).parent / "records")
