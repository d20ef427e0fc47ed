"""From a raw record to a motion that starts and ends at rest: baseline correction and the choice of a window."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.motion_checks import finite, positive
from msfp_gen.piecewise import Array, evaluate, from_rates
from msfp_gen.records.record import Record, sample_times
from msfp_gen.waveforms import product, smoothstep

_ORDER = 4
_DRIFT = 0.1  # share of the peak velocity that an uncorrected record may end with


@dataclass(frozen=True, eq=False)
class Corrected:
    """Consistent displacement, velocity and acceleration; from rest to rest unless `uncorrected` made it.

    Attributes:
        time: ndarray, shape (k,), [s], from zero.
        acceleration: ndarray, shape (k, 3), [m/s^2].
        velocity: ndarray, shape (k, 3), [m/s]; between samples the cubic Hermite of both.
        displacement: ndarray, shape (k, 3), [m]; the exact integral, from zero.
        metadata: what was done.
    """

    time: Array
    acceleration: Array
    velocity: Array
    displacement: Array
    metadata: Mapping[str, str | float]

    def scaled(self, factor: float) -> Corrected:
        """All of it times `factor`, which joins the metadata."""
        offset = factor * float(self.metadata["end_offset"])
        metadata = {**self.metadata, "end_offset": offset, "scale": positive("scale", factor)}
        return Corrected(
            self.time, factor * self.acceleration, factor * self.velocity, factor * self.displacement, metadata
        )

    def as_record(self, source: Record) -> Record:
        """A record of what `source` became, as `write_csv` takes it."""
        notes = {"notes": ""}  # they go along as notes
        return replace(
            source, acceleration=self.acceleration, velocity=self.velocity, displacement=self.displacement,
            quantity="acceleration", units="m/s^2", metadata={**source.metadata, **self.metadata, **notes},
        )  # fmt: skip


def strong_window(record: Record, duration: float, *, lead: float = 2.0) -> float:
    """Start [s] of the window of `duration` [s] with the greatest Arias intensity, of all three components.

    The window opens `lead` seconds early where the record allows, so that its smooth start is over before the shaking.
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
    """Remove the mean, taper, high-pass and integrate the whole record, then cut the window out of it.

    A fourth-order Butterworth high-pass at `corner` runs forwards and backwards (no phase shift) over the record
    padded with zeros. In the window the velocity, not the acceleration, is tapered over `taper` seconds at each end;
    acceleration and displacement follow from it, so that all three agree, start at zero and end at rest. Filtering
    removes permanent offset (fling); the metadata says so.

    Args:
        record: as read.
        start: first time kept [s]; None: the strongest window if `duration` is given, else the first sample.
        duration: length kept [s]; None: to the end of the record.
        corner: of the high-pass filter [Hz].
        taper: length of the smooth start and end [s].
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
    fade, slope, _ = (w[:, None] for w in _ends(time, taper))
    acceleration = fade * acceleration[window] + slope * velocity[window]
    velocity = fade * velocity[window]
    displacement = evaluate(time, from_rates(time, velocity, acceleration), time)
    done = (
        f"mean removed, {_ORDER}th-order Butterworth high-pass at {corner:g} Hz forwards and backwards, "
        f"velocity tapered over {taper:g} s at both ends; permanent offset is removed with it"
    )
    return Corrected(time, acceleration, velocity, displacement, _metadata(record, start, done, displacement))


def uncorrected(record: Record, *, start: float | None = None, duration: float | None = None) -> Corrected:
    """The record as it is, integrated: for one that its agency has corrected, or that was made.

    Where the file gives velocity or displacement, that is kept; else the acceleration is integrated from rest at the
    start of the window. The window is chosen as in `baseline_corrected`.

    Raises:
        InputError: the ground still moves at the end with a tenth of its peak velocity: the record drifts.
    """
    start = _start(record, start, duration)
    window, _ = _samples(record, start, duration)
    acceleration = record.acceleration[window]
    time = sample_times(len(acceleration), record.time_step)
    velocity = _summed(acceleration, record.time_step) if record.velocity is None else record.velocity[window]
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
    """Velocity and acceleration of the whole record after the high-pass, each ndarray, shape (k, 3)."""
    from scipy.signal import butter, sosfiltfilt

    raw = record.acceleration - record.acceleration.mean(axis=0)
    raw = raw * _ends(record.time, min(taper, record.duration / 4))[0][:, None]
    pad = int(np.ceil(1.5 * _ORDER / corner / record.time_step))
    padded = np.pad(raw, ((pad, pad), (0, 0)))
    filters = butter(_ORDER, corner, "highpass", fs=1 / record.time_step, output="sos")
    filtered = sosfiltfilt(filters, padded, axis=0, padtype=None)
    return _summed(filtered, record.time_step)[pad:-pad], filtered[pad:-pad]


def _summed(acceleration: Array, time_step: float) -> Array:
    """Velocity from rest, by the trapezoidal rule, which is exact for linear pieces."""
    steps = time_step * (acceleration[1:] + acceleration[:-1]) / 2
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def _ends(time: Array, taper: float) -> tuple[Array, Array, Array]:
    """A window that rises smoothly from zero, stays at one and falls back, with two derivatives."""
    rise, fall = smoothstep(time, taper), smoothstep(time[-1] - time, taper)
    return product(rise, (fall[0], -fall[1], fall[2]))


def _start(record: Record, start: float | None, duration: float | None) -> float:
    """The start given, or that of the strongest window of the duration given, or zero."""
    if start is not None:
        return start
    return 0.0 if duration is None else strong_window(record, duration)


def _samples(record: Record, start: float, duration: float | None) -> tuple[slice, float]:
    """The samples of a window and its length [s]."""
    length = _window(record, start, record.duration - start if duration is None else duration)
    first = round(start / record.time_step)
    return slice(first, min(first + round(length / record.time_step) + 1, len(record.acceleration))), length


def _window(record: Record, start: float, duration: float) -> float:
    """`duration` if the window lies in the record, else InputError."""
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
        "channels": ", ".join(record.channels),
        "notes": "; ".join(record.notes),
        "window_start": start,
        "correction": done,
        "end_offset": float(np.linalg.norm(displacement[-1])),
        **record.metadata,
    }
