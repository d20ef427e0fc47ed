"""Baseline correction of a record to a motion that starts and ends at rest, and selection of a time window."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.motions.checks import finite, positive
from msfp_gen.motions.piecewise import Pieces, evaluate, from_rates
from msfp_gen.motions.records.record import COMPONENTS, Record, sample_times
from msfp_gen.motions.sources import product, resolving_step, smoothstep

_ORDER = 4  # of the Butterworth filter
_MAX_PAD = 1e7  # samples of rest before and after a record, in which the filter settles
_DRIFT = 0.1  # permitted velocity at the end of an uncorrected record, as a share of its peak velocity


@dataclass(frozen=True, eq=False)
class Corrected:
    """Consistent displacement, velocity and acceleration of a processed record, on one time axis.

    It starts and ends at rest, except where it is the result of `uncorrected`.

    Attributes:
        time: ndarray, shape (k,), [s], from zero.
        acceleration: ndarray, shape (k, 3), [m/s^2].
        velocity: ndarray, shape (k, 3), [m/s]; between samples the cubic Hermite interpolant of velocity and
            acceleration.
        displacement: ndarray, shape (k, 3), [m]; the exact integral of this interpolant, from zero.
        metadata: description of the processing.
    """

    time: Array
    acceleration: Array
    velocity: Array
    displacement: Array
    metadata: Mapping[str, str | float]

    def scaled(self, factor: float) -> Corrected:
        """The motion times `factor`, which is added to the metadata. Raises InputError unless it is positive."""
        offset = factor * float(self.metadata["end_offset"])
        metadata = {**self.metadata, "end_offset": offset, "scale": positive("scale", factor)}
        return Corrected(
            self.time, factor * self.acceleration, factor * self.velocity, factor * self.displacement, metadata
        )

    def pieces(self, scale: float) -> Pieces:
        """The piecewise polynomials of a `Motion`, times `scale`. Raises InputError unless it is positive."""
        rates = np.zeros((2, len(self.time), 6))
        factor = positive("scale", scale)
        rates[:, :, :3] = factor * np.array([self.velocity, self.acceleration])
        coefficients = from_rates(self.time, rates[0], rates[1])
        return Pieces(self.time, coefficients, resolving_step(self.time), {**self.metadata, "scale": factor})

    def as_record(self, source: Record) -> Record:
        """The processed motion as a record, with names and notes of `source`, for `write_csv`."""
        notes = {"notes": ""}  # `Record.notes` holds the notes, so they are not repeated in the metadata
        return replace(
            source,
            acceleration=self.acceleration,
            velocity=self.velocity,
            displacement=self.displacement,
            quantity="acceleration",
            units="m/s^2",
            metadata={**source.metadata, **self.metadata, **notes},
        )


def strong_window(record: Record, duration: float, *, lead: float = 2.0) -> float:
    """Start [s] of the window of `duration` [s] with the largest Arias intensity, summed over the three components.

    The start is moved `lead` [s] earlier where the record permits, so that the taper ends before the strong shaking.
    Raises InputError if the record is shorter than the window.
    """
    length = round(_window(record, 0.0, duration) / record.time_step)
    energy = np.sum((record.acceleration - record.acceleration.mean(axis=0)) ** 2, axis=1)
    total = np.concatenate([[0.0], np.cumsum(energy)])
    best = int(np.argmax(total[length + 1 :] - total[: -length - 1]))
    return max(0.0, best * record.time_step - lead)


def baseline_corrected(
    record: Record,
    *,
    start: float | None = None,
    duration: float | None = None,
    corner: float = 0.05,
    taper: float = 1.0,
) -> Corrected:
    """Remove the mean, taper, high-pass filter and integrate the whole record, then extract a window.

    A fourth-order Butterworth high-pass filter is applied forwards and backwards (without phase shift) to the record
    padded with zeros. In the window the velocity, not the acceleration, is tapered at each end. Acceleration and
    displacement follow from the tapered velocity, so that the three are consistent, start at zero and end at rest. The
    filter also removes permanent offset (fling), as the metadata state.

    Args:
        record: as read.
        start: start of the window [s]; None: the window of `strong_window` if `duration` is given, else zero.
        duration: length of the window [s]; None: to the end of the record.
        corner: corner frequency of the filter [Hz].
        taper: duration of the smooth start and end [s].

    Raises:
        InputError: the window leaves the record or is too short for the tapers, or the corner frequency is too high.
    """
    positive("corner", corner)
    positive("taper", taper)
    start = _start(record, start, duration)
    window, length = _samples(record, start, duration)
    if length < 4 * taper or corner * record.time_step >= 0.5:
        raise InputError(
            f"duration: {length:g} s at {record.time_step:g} s a sample is too short for tapers of {taper:g} s and "
            f"a corner of {corner:g} Hz; keep a longer window"
        )
    velocity, acceleration = _integrated(record, corner, taper)
    time = sample_times(window.stop - window.start, record.time_step)
    weight, slope, _ = (w[:, None] for w in _taper_window(time, taper))
    acceleration = weight * acceleration[window] + slope * velocity[window]
    velocity = weight * velocity[window]
    displacement = evaluate(time, from_rates(time, velocity, acceleration), time)
    done = (
        f"mean removed, {_ORDER}th-order Butterworth high-pass at {corner:g} Hz forwards and backwards, "
        f"velocity tapered over {taper:g} s at both ends; permanent offset is removed with it"
    )
    return Corrected(time, acceleration, velocity, displacement, _metadata(record, start, done, displacement))


def uncorrected(record: Record, *, start: float | None = None, duration: float | None = None) -> Corrected:
    """Integrate a record without correction: for one that its agency has corrected, or an artificial one.

    Velocity and displacement of the file are used where it gives them; otherwise the acceleration is integrated from
    rest at the start of the window. The arguments define the window as in `baseline_corrected`.

    Raises:
        InputError: the window leaves the record, or the velocity at its end exceeds a tenth of the peak velocity: the
            record drifts.
    """
    start = _start(record, start, duration)
    window, _ = _samples(record, start, duration)
    acceleration = record.acceleration[window]
    time = sample_times(len(acceleration), record.time_step)
    velocity = _integral(acceleration, record.time_step) if record.velocity is None else record.velocity[window]
    last, peak = np.linalg.norm(velocity[-1]), np.linalg.norm(velocity, axis=1).max()
    if last > _DRIFT * peak:
        raise InputError(
            f"correct: without it the record ends at {last:.3g} m/s, of {peak:.3g} m/s at most: it drifts; "
            "correct it, or keep a longer window"
        )
    displacement = evaluate(time, from_rates(time, velocity, acceleration), time)
    done = "none: taken as it is in the file"
    return Corrected(time, acceleration, velocity, displacement, _metadata(record, start, done, displacement))


def _integrated(record: Record, corner: float, taper: float) -> tuple[Array, Array]:
    """Velocity [m/s] and acceleration [m/s^2] of the whole record after the filter, each ndarray, shape (k, 3)."""
    from scipy.signal import butter, sosfilt

    raw = record.acceleration - record.acceleration.mean(axis=0)
    raw = raw * _taper_window(record.time, min(taper, record.duration / 4))[0][:, None]
    samples = 1.5 * _ORDER / corner / record.time_step
    if samples > _MAX_PAD:
        raise InputError(
            f"corner: {corner:g} Hz needs {samples:.1e} samples of rest before the record; give a higher one"
        )
    pad = int(np.ceil(samples))
    padded = np.pad(raw, ((pad, pad), (0, 0)))
    filters = butter(_ORDER, corner, "highpass", fs=1 / record.time_step, output="sos")
    forwards = sosfilt(filters, padded, axis=0)
    # Backwards from where a constant leaves a section. `sosfiltfilt` solves for it with LAPACK, whose last digits
    # depend on the processor. A high-pass filter passes no constant on: the first section settles, the others rest.
    at_rest = np.zeros((len(filters), 2, 3))
    at_rest[0] = np.outer([-filters[0, 0], filters[0, 2]], forwards[-1])
    filtered = sosfilt(filters, forwards[::-1], axis=0, zi=at_rest)[0][::-1]
    return _integral(filtered, record.time_step)[pad:-pad], filtered[pad:-pad]


def _integral(acceleration: Array, time_step: float) -> Array:
    """Velocity from rest by the trapezoidal rule, which is exact for a piecewise linear acceleration."""
    from scipy.integrate import cumulative_trapezoid

    velocity: Array = cumulative_trapezoid(acceleration, dx=time_step, axis=0, initial=0)
    return velocity


def _taper_window(time: Array, taper: float) -> tuple[Array, Array, Array]:
    """Weights that increase smoothly from 0 to 1, and decrease to 0 at the end, over `taper` [s]; two derivatives."""
    rise, fall = smoothstep(time, taper), smoothstep(time[-1] - time, taper)
    return product(rise, (fall[0], -fall[1], fall[2]))


def _start(record: Record, start: float | None, duration: float | None) -> float:
    """Start of the window [s]: as given, else by `strong_window` for a given duration, else zero."""
    if start is not None:
        return start
    return 0.0 if duration is None else strong_window(record, duration)


def _samples(record: Record, start: float, duration: float | None) -> tuple[slice, float]:
    """Indices of the samples of a window, and its length [s]."""
    length = _window(record, start, record.duration - start if duration is None else duration)
    first = round(start / record.time_step)
    return slice(first, min(first + round(length / record.time_step) + 1, len(record.acceleration))), length


def _window(record: Record, start: float, duration: float) -> float:
    """`duration` [s]. Raises InputError unless the window lies within the record."""
    finite("start", start)
    positive("duration", duration)
    if start < 0 or start + duration > record.duration * (1 + 1e-12):
        raise InputError(
            f"duration: the window [{start:g}, {start + duration:g}] s leaves the record, which has "
            f"[0, {record.duration:g}] s; move or shorten it"
        )
    return duration


def _metadata(record: Record, start: float, done: str, displacement: Array) -> dict[str, str | float]:
    return {
        "source": f"record {record.name}",
        "station": record.station,
        "record_start": record.start_time,
        "channels": ", ".join(f"{e}: {c or '-'}" for e, c in zip(COMPONENTS, record.channels, strict=True)),
        "notes": "; ".join(record.notes),
        "window_start": start,
        "correction": done,
        "end_offset": float(np.linalg.norm(displacement[-1])),
        **record.metadata,
    }
