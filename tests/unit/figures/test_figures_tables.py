"""Figures drawn from tables and arrays: work-precision, baseline correction, response spectra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support import thinned

from msfp_gen.common.errors import InputError
from msfp_gen.figures import plot_correction, plot_response_spectrum, plot_work_precision
from msfp_gen.motions.records import Record, baseline_corrected, uncorrected

TABLE = {
    "implicit": {"seconds": [0.01, 0.1], "newton": [100, 1000], "force_max": [1e-2, 1e-4], "slide_max": [1e-3, 1e-5]},
    "Radau": {
        "seconds": [0.5, 5, 50],
        "force_max": [1e-2, 1e-3, np.nan],
        "slide_max": [1e-3, 1e-4, np.nan],
        "failed": [0, 0, 1],
        "wrong": [1, 0, 0],
    },
}


def test_a_row_for_every_error_and_a_column_for_every_cost():
    figure = plot_work_precision(TABLE, floors={"references differ": {"force_max": 1e-6}})
    axes = figure.get_axes()
    assert len(axes) == 4 and all(a.get_xscale() == a.get_yscale() == "log" for a in axes)
    force_seconds, force_newton, slide_seconds, _ = axes
    assert force_seconds.get_ylabel() == "force max, relative"
    curves = {line.get_label(): line for line in force_seconds.get_lines()}
    np.testing.assert_allclose(curves["implicit"].get_xydata(), [[0.01, 1e-2], [0.1, 1e-4]])
    np.testing.assert_allclose(curves["Radau"].get_xydata(), [[0.5, 1e-2], [5, 1e-3]])  # the failed run has no error
    assert "Radau" not in {line.get_label() for line in force_newton.get_lines()}  # it counts no iterations
    assert [text.get_text() for text in force_seconds.texts] == ["references differ"] and not slide_seconds.texts
    figure.draw_without_rendering()


def test_failures_and_wrong_successes_are_marked():
    figure = plot_work_precision(TABLE)
    lines = figure.get_axes()[0].get_lines()
    crosses = [line.get_xdata() for line in lines if line.get_marker() == "x" and len(line.get_xdata())]
    rings = [line.get_xydata() for line in lines if line.get_markersize() == 13 and len(line.get_xdata())]
    np.testing.assert_allclose(crosses, [[50.0]])
    np.testing.assert_allclose(rings, [[[0.5, 1e-2]]])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["implicit", "Radau", "failed", "wrong success"]


def test_a_wrong_success_that_failed_too_is_no_success():
    table = {"a": {"seconds": [1.0], "force": [1e-2], "failed": [1], "wrong": [1]}}
    lines = plot_work_precision(table).get_axes()[0].get_lines()
    assert not [line for line in lines if line.get_markersize() == 13 and len(line.get_xdata())]


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ({}, "table is empty"),
        ({"a": {"seconds": [1, 2], "force": [1]}}, r"table\['a'\]: columns of one length .* seconds 2, force 1"),
        ({"a": {"seconds": [1.0]}}, "table has no error: give a column such as force_max"),
        ({"a": {"force": [1.0]}}, "table has no cost: give a column such as seconds"),
    ],
)
def test_tables_that_cannot_be_drawn(table, reason, tmp_path):
    with pytest.raises(InputError, match=reason):
        plot_work_precision(table, tmp_path / "wp.png")
    assert not list(tmp_path.iterdir())


def drifting() -> Record:
    """A burst on a constant offset, along E1 and E3: integrated as it is, it drifts by half the offset times t^2."""
    time = np.arange(4001) * 0.01
    burst = np.exp(-(((time - 20) / 4) ** 2)) * np.sin(2 * np.pi * time)
    return Record("made-up", 0.01, np.stack([burst + 0.05, 0 * burst, 0.5 * burst], axis=1))


def test_correction_shows_raw_and_corrected(tmp_path):
    record = drifting()
    corrected = baseline_corrected(record)
    figure = plot_correction(record, corrected, tmp_path / "c.png")
    axes = np.array(figure.get_axes()).reshape(3, 2)  # nothing is recorded along E2
    raw, after = axes[2, 0].get_lines()
    scale = 1e3 if "[mm]" in axes[2, 0].get_ylabel() else 1.0
    np.testing.assert_allclose(after.get_ydata(), scale * corrected.displacement[:, 0])
    assert raw.get_ydata()[-1] / scale == pytest.approx(0.05 * 40**2 / 2, rel=0.01)
    assert axes[2, 0].get_ylim()[1] < raw.get_ydata()[-1]  # it leaves the panel, and says where it ends
    assert [text.get_text() for text in axes[2, 0].texts] == ["as recorded: ends at 40 m"]
    assert [a.get_title(loc="left").split()[0] for a in axes[0]] == ["E₁", "E₃"]


def test_a_scaled_motion_is_compared_with_the_record_at_the_same_scale():
    record = drifting()
    corrected = baseline_corrected(record)
    plain, scaled = plot_correction(record, corrected), plot_correction(record, corrected.scaled(2.5))
    assert "times" not in plain.get_suptitle()
    assert scaled.get_suptitle() == "made-up: as recorded (grey) and corrected, both scaled by 2.5"
    for one, other in zip(plain.get_axes()[0].get_lines(), scaled.get_axes()[0].get_lines(), strict=True):
        np.testing.assert_allclose(other.get_ydata(), 2.5 * one.get_ydata())


def test_a_record_taken_as_it_is_is_not_called_corrected():
    record = drifting()
    calm = replace(record, acceleration=record.acceleration - [0.05, 0, 0])
    assert plot_correction(calm, uncorrected(calm)).get_suptitle().endswith("and not corrected")


NAMES = [r"$\frac$", "a $ b", r"50 $ and \$5", "$x$", "{}_^\\", "地震"]


@pytest.mark.parametrize("name", thinned(NAMES, lambda name: name in (NAMES[0], NAMES[2], NAMES[-1])))
def test_a_name_is_drawn_as_it_is_whatever_it_holds(name):
    record = replace(drifting(), name=name, channels=(name, "", name))
    corrected = baseline_corrected(record)
    figure = plot_correction(record, corrected)
    figure.draw_without_rendering()  # TeX in a name must not be read
    shown = "??" if name == "地震" else name  # the font has none of these letters
    assert figure.get_suptitle().replace(r"\$", "$").startswith(shown)
    spectrum = plot_response_spectrum([1.0, 2.0], {"E1": [1.0, 2.0]}, title=name)
    spectrum.draw_without_rendering()


def test_correction_takes_the_window_that_was_kept():
    record = drifting()
    corrected = baseline_corrected(record, start=10.0, duration=20.0)
    raw = plot_correction(record, corrected).get_axes()[0].get_lines()[0]
    np.testing.assert_allclose(raw.get_ydata(), record.acceleration[1000:3001, 0])


def test_spectrum_draws_arrays_with_g_to_the_right(tmp_path):
    periods = np.array([0.1, 1.0, 10.0])
    curves, target = {"E1": [9.80665, 4.0, 1.0], "E2": [1.0, 2.0, 3.0]}, ([0.2, 2.0], [5.0, 5.0])
    figure = plot_response_spectrum(periods, curves, tmp_path / "s.svg", target=target)
    (axes,) = figure.get_axes()
    lines = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
    np.testing.assert_allclose(lines["E1"], np.transpose([periods, curves["E1"]]))
    np.testing.assert_allclose(lines["target"], np.transpose(target))
    (right,) = axes.child_axes
    figure.draw_without_rendering()
    assert right.get_ylim()[1] == pytest.approx(axes.get_ylim()[1] / 9.80665)


@pytest.mark.parametrize(
    ("periods", "spectra", "reason"),
    [([], {}, "periods"), ([0.0, 1.0], {"a": [1, 2]}, "above zero"), ([1.0, 2.0], {"a": [1.0]}, r"spectra\['a'\]")],
)
def test_spectra_that_cannot_be_drawn(periods, spectra, reason):
    with pytest.raises(InputError, match=reason):
        plot_response_spectrum(periods, spectra)
