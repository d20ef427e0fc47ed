"""A ground motion as tables: where it came from, its peaks and intensities, its spectrum at a few periods."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from msfp_gen.piecewise import Array
from msfp_gen.records.correction import Corrected
from msfp_gen.records.record import COMPONENTS, G, Record
from msfp_gen.records.spectrum import MEASURES, response_spectrum
from msfp_gen.tables import Table

_PERIODS = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0)  # [s]


def record_tables(record: Record, motion: Record | Corrected) -> list[Table]:
    """What a person wants to know: of the file, and of `motion`, the record itself or what correction made of it."""
    corrected = motion if isinstance(motion, Corrected) else None
    return [_origin(record, corrected), _intensities(record, motion), _ordinates(motion)]


def arias_intensity(time: Array, acceleration: Array) -> Array:
    """pi/(2 g) times the integral of acceleration squared (Arias, 1970), up to each time: ndarray, shape (k, c), [m/s].

    Args:
        time: shape (k,), [s].
        acceleration: shape (k, c), [m/s^2].
    """
    squares = acceleration**2
    steps = np.diff(time)[:, None] * (squares[1:] + squares[:-1]) / 2
    return np.pi / (2 * G) * np.concatenate([np.zeros((1, squares.shape[1])), np.cumsum(steps, axis=0)])


def significant_duration(time: Array, acceleration: Array) -> Array:
    """Time from 5 % to 95 % of the Arias intensity of each column: ndarray, shape (c,), [s]; 0 where there is none."""
    growing = arias_intensity(time, acceleration)
    return np.array([
        float(np.diff(np.interp([0.05 * total[-1], 0.95 * total[-1]], total, time))[0]) if total[-1] else 0.0
        for total in growing.T
    ])  # fmt: skip


def _origin(record: Record, corrected: Corrected | None) -> Table:
    about: Mapping[str, object] = {
        "format": record.metadata.get("format", ""),
        "file": record.metadata.get("file", ""),
        "station": record.station,
        "start": record.start_time,
        "samples": f"{len(record.acceleration)} every {record.time_step:g} s, {record.duration:g} s",
        "in the file": f"{record.quantity} in {record.units}",
        "channels": ", ".join(f"{e}: {c or '-'}" for e, c in zip(COMPONENTS, record.channels, strict=True)),
        "notes": "; ".join(record.notes),
    }
    if corrected is not None:
        start = float(corrected.metadata["window_start"])
        end = start + corrected.time[-1]
        about = {**about, "window": f"{start:g} to {end:g} s", "correction": corrected.metadata["correction"]}
        about = {**about, **{name: corrected.metadata.get(name, "") for name in ("scaled_to", "scale")}}
    rows = [(name.replace("_", " "), f"{v:.6g}" if isinstance(v, float) else str(v)) for name, v in about.items() if v]
    return Table(record.name or "record", (), rows)


def _intensities(record: Record, motion: Record | Corrected) -> Table:
    """Peaks and intensities of each component; velocity and displacement only where they mean something."""
    acceleration = motion.acceleration - (record.acceleration.mean(axis=0) if motion is record else 0.0)
    rates = [(motion.velocity, 1e2), (motion.displacement, 1e2)]
    peaks = np.abs(acceleration).max(axis=0) / G
    arias = arias_intensity(motion.time, acceleration)[-1]
    lasting = significant_duration(motion.time, acceleration)
    rows = [
        (axis, f"{peaks[i]:.4f}", *("-" if v is None else f"{f * np.abs(v[:, i]).max():.2f}" for v, f in rates),
         f"{arias[i]:.3f}", f"{lasting[i]:.2f}")
        for i, axis in enumerate(COMPONENTS)
    ]  # fmt: skip
    columns = ("component", "PGA [g]", "PGV [cm/s]", "PGD [cm]", "Arias [m/s]", "D5-95 [s]")
    title = "as recorded, less its mean" if motion is record else "the motion of the base"
    return Table(title, columns, rows)


def _ordinates(motion: Record | Corrected) -> Table:
    psa = response_spectrum(motion, _PERIODS).psa / G
    rows = [(f"{period:g}", *(f"{value:.4f}" for value in row)) for period, row in zip(_PERIODS, psa, strict=True)]
    return Table("pseudo-acceleration [g], 5 % damping", ("period [s]", *MEASURES), rows)
