"""Tables of a ground motion: origin, peaks and intensities, and pseudo-acceleration at several periods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.fields import G
from msfp_gen.common.tables import Table
from msfp_gen.motions.records.correction import Corrected
from msfp_gen.motions.records.record import COMPONENTS, Record
from msfp_gen.motions.records.spectrum import MEASURES, response_spectrum

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.motions.records.scaling import ScaledSuite

_PERIODS = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0)  # [s]


def record_tables(record: Record, motion: Record | Corrected) -> list[Table]:
    """Tables of the origin of `record`, and of intensities and spectrum of `motion`: the record or its correction."""
    corrected = motion if isinstance(motion, Corrected) else None
    return [_origin(record, corrected), _intensities(record, motion), _ordinates(motion)]


def suite_tables(names: Sequence[str], motions: Sequence[Motion], scaled: ScaledSuite | None) -> list[Table]:
    """Tables of the motions of a suite: factor and peaks of each; of a scaled suite also the mean and its target."""
    rows = []
    for name, motion in zip(names, motions, strict=True):
        peaks = np.abs(motion.acceleration(motion.knots)).max(axis=0) / G
        row = (f"{float(motion.metadata['scale']):.4g}", f"{motion.duration:.4g}", *(f"{peak:.4f}" for peak in peaks))
        rows.append((name, *row))
    columns = ("record", "factor", "duration [s]", *(f"PGA {axis} [g]" for axis in COMPONENTS))
    tables = [Table(f"suite of {len(rows)} record{'s' * (len(rows) > 1)}", columns, rows)]
    if scaled is None:
        return tables
    ratio, at = scaled.mean / scaled.target, np.linspace(0, len(scaled.period) - 1, min(9, len(scaled.period)))
    shown = [
        (
            f"{scaled.period[i]:.3g}",
            *(f"{values[i] / G:.4f}" for values in (scaled.mean, scaled.target)),
            f"{ratio[i]:.3f}",
        )
        for i in np.unique(at.round().astype(int))
    ]
    title = f"mean spectrum; its least share of the target is {scaled.least_share:.3f}"
    return [*tables, Table(title, ("period [s]", "mean [g]", "target [g]", "mean/target"), shown)]


def arias_intensity(time: Array, acceleration: Array) -> Array:
    """Arias intensity (1970) up to each time: pi/(2 g) times the integral of the squared acceleration.

    Args:
        time: shape (k,), [s].
        acceleration: shape (k, c), [m/s^2].

    Returns:
        ndarray, shape (k, c), [m/s].
    """
    from scipy.integrate import cumulative_trapezoid

    intensity: Array = np.pi / (2 * G) * cumulative_trapezoid(acceleration**2, time, axis=0, initial=0)
    return intensity


def significant_duration(time: Array, acceleration: Array) -> Array:
    """Time between 5 % and 95 % of the Arias intensity of each column: ndarray, shape (c,), [s]; 0 for a zero column.

    Arguments as in `arias_intensity`.
    """
    intensity = arias_intensity(time, acceleration)
    return np.array(
        [
            float(np.diff(np.interp([0.05 * total[-1], 0.95 * total[-1]], total, time))[0]) if total[-1] else 0.0
            for total in intensity.T
        ]
    )


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
    """Peaks and intensities of each component; velocity and displacement only where the motion gives them."""
    acceleration = motion.acceleration - (record.acceleration.mean(axis=0) if motion is record else 0.0)
    rates = [(motion.velocity, 1e2), (motion.displacement, 1e2)]
    peaks = np.abs(acceleration).max(axis=0) / G
    arias = arias_intensity(motion.time, acceleration)[-1]
    durations = significant_duration(motion.time, acceleration)
    rows = [
        (
            axis,
            f"{peaks[i]:.4f}",
            *("-" if v is None else f"{f * np.abs(v[:, i]).max():.2f}" for v, f in rates),
            f"{arias[i]:.3f}",
            f"{durations[i]:.2f}",
        )
        for i, axis in enumerate(COMPONENTS)
    ]
    columns = ("component", "PGA [g]", "PGV [cm/s]", "PGD [cm]", "Arias [m/s]", "D5-95 [s]")
    title = "as recorded, less its mean" if motion is record else "the motion of the base"
    return Table(title, columns, rows)


def _ordinates(motion: Record | Corrected) -> Table:
    psa = response_spectrum(motion, _PERIODS).psa / G
    rows = [(f"{period:g}", *(f"{value:.4f}" for value in row)) for period, row in zip(_PERIODS, psa, strict=True)]
    return Table("pseudo-acceleration [g], 5 % damping", ("period [s]", *MEASURES), rows)
