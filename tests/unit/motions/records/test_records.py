"""Recorded ground motions: formats, traps, damage, baseline correction."""

from __future__ import annotations

import gzip
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from msfp_gen.common.errors import InputError
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.records import (
    BUNDLED,
    Record,
    baseline_corrected,
    bundled,
    read_peer,
    read_record,
    read_table,
    strong_window,
)

G = 9.80665


def channel(number, label, values, unit="g", start="7/06/19, 03:19:37.0 UTC"):
    """One channel of a volume 1 file, as the real ones are laid out."""
    rows = ["".join(f"{v:9.6f}" for v in values[i : i + 8]) for i in range(0, len(values), 8)]
    return "\r\n".join(
        [
            "Uncorrected Accelerogram Data             Processed: 07/06/19, CGS",
            f"38457511.CI.CCC.--.HN                Start time:  {start}",
            "Station Id. CCC     35.525N, 117.365W    Q330",
            f"Chan  {number}: {label:<30}",
            f"No. of Points ={len(values):7d}  Record Length =354.300 sec   at 100 Samples/sec",
            f" {len(values)} Accelerogram points at 100 pts/sec in units of {unit}.       Format: (8f9.6)",
            *rows,
            f"/&  ----------  End of Data for Station Channel   {number}  ----------",
            "",
        ]
    )


WAVES = [0.1 * np.sin(np.arange(n) + phase) for n, phase in ((30, 0.0), (32, 1.0), (35, 2.0))]
V1 = channel(1, "90 Deg", WAVES[0]) + channel(2, "360 Deg", WAVES[1]) + channel(3, "Up", WAVES[2])
AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
 IMPERIAL VALLEY 10/15/79 2316, EL CENTRO ARRAY #9, 180
 ACCELERATION TIME HISTORY IN UNITS OF G
 NPTS=     9, DT=   .01000 SEC
  .1000E-02  .2000E-02 -.3000E-02  .4000E-02
  .5000E-02-.6000E-02-.7000E-02  .8000E-02
  .9000E-02
"""
CSV = "# made by hand\ntime [s], a1 [g], a3 [cm/s^2]\n" + "".join(f"{0.01 * i:.2f}, {0.1 * i}, {i}\n" for i in range(9))


@pytest.fixture
def write(tmp_path):
    def _write(content, name="record.txt"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
        return path

    return _write


def test_volume_1(write):
    record = read_record(write(V1, "abc.v1"))
    expected = G * np.round(np.stack([w[:30] for w in WAVES], axis=1), 6)
    np.testing.assert_allclose(record.acceleration, expected, atol=1e-12)
    assert record.time_step == 0.01 and record.duration == pytest.approx(0.29)
    assert record.channels == ("90 Deg", "360 Deg", "Up")
    assert (record.name, record.station, record.units) == ("abc", "CCC", "g")
    assert record.start_time == "7/06/19, 03:19:37.0 UTC"
    assert record.notes == ("channels cut to their common window of 30 points (were 30, 32, 35)",)


@pytest.mark.parametrize(
    ("labels", "order"),
    [
        (("Up", "0 Deg", "90 Deg"), (2, 1, 0)),
        (("20 Deg", "290 Deg", "Up"), (0, 1, 2)),
        (("20 Deg", "110 Deg", "Up"), (1, 0, 2)),  # the right-handed pair with Up
    ],
)
def test_components_are_right_handed(write, labels, order):
    text = "".join(channel(i + 1, label, WAVES[i]) for i, label in enumerate(labels))
    record = read_record(write(text))
    assert record.channels == tuple(labels[i] for i in order)
    np.testing.assert_allclose(record.acceleration[:, 0], G * WAVES[order[0]][:30], atol=1e-5)


def test_gzip_and_other_line_ends_read_alike(write):
    plain = read_record(write(V1))
    packed = read_record(write(gzip.compress(V1.replace("\r\n", "\n").encode())))
    np.testing.assert_array_equal(plain.acceleration, packed.acceleration)


@pytest.mark.parametrize(
    "counts",
    ["NPTS=     9, DT=   .01000 SEC", "    9    0.0100    NPTS, DT", "NPTS=9, DT= 1e-2 SEC,", "NPTS:  9 DT: 0.01"],
)
def test_at2_with_stuck_negatives_and_a_short_last_row(write, counts):
    path = write(AT2.replace("NPTS=     9, DT=   .01000 SEC", counts), "RSN6_180.AT2")
    record = read_record(path)
    np.testing.assert_allclose(record.acceleration[:, 0], G * 1e-3 * np.array([1, 2, -3, 4, 5, -6, -7, 8, 9]))
    assert record.time_step == 0.01 and record.notes == ("no channel for E2, E3: taken as zero",)
    assert "EL CENTRO" in record.station


def test_at2_components_of_different_length(write):
    shorter = AT2.replace("NPTS=     9", "NPTS=     8").replace("  .9000E-02\n", "")
    record = read_peer(write(AT2, "a.at2"), write(shorter, "b.at2"), write(AT2, "c.at2"))
    assert record.acceleration.shape == (8, 3)
    assert record.notes == ("channels cut to their common window of 8 points (were 9, 8, 9)",)
    with pytest.raises(InputError, match=r"d\.at2, line 3: time step 0\.02 s differs from the first channel's 0\.01 s"):
        read_peer(write(AT2, "a.at2"), write(AT2.replace(".01000", ".02000"), "d.at2"))


def test_tables_of_accelerations_and_displacements(write):
    record = read_record(write(CSV))
    np.testing.assert_allclose(record.acceleration[3], [0.3 * G, 0, 0.03])
    assert record.notes == ("no channel for E2: taken as zero",)
    table = read_table(write("time [ms], u2 [mm]\n0, 0\n10, 1\n20, 1\n30, 5\n"))
    assert table.quantity == "displacement"
    np.testing.assert_allclose(table.time, [0, 0.01, 0.02, 0.03])
    np.testing.assert_allclose(table.values[3], [0, 5e-3, 0])
    assert Motion.from_csv(write(CSV)).acceleration(0.03)[0] == pytest.approx(0.3 * G)


V1_FAULTS = {
    "truncated": (V1[: len(V1) // 2], "truncated|columns of width"),
    "no end mark": (V1.replace("/&", "  "), "end mark"),
    "count too great": (V1.replace(" 30 Acc", " 31 Acc"), "31 points here, but the header says 30"),
    "counts too great": (V1.replace(" 30 ", " 38 "), r"line 10: 8 columns of width 9 expected after 24 of 38"),
    "counts too small": (V1.replace(" 30 ", " 22 "), r"line 9: 6 columns of width 9"),
    "whole rows too many": (V1.replace(" 30 ", " 24 "), "more data than the 24 points"),
    "nan": (V1.replace(" 0.084147", "      nan"), r"record\.txt, line 7: 'nan' is not a finite number"),
    "overflow": (V1.replace(" 0.084147", "*********"), "is not a finite number"),
    "blank field": (V1.replace(" 0.084147", "         "), "'' is not a finite number"),
    "unknown unit": (V1.replace("units of g.", "units of furlongs."), "unknown unit 'furlongs'"),
    "no vertical": (V1[: V1.index("Uncorrected", 900)], "two horizontal ones and one Up"),
    "not square": (V1.replace("360 Deg", "330 Deg"), "not 90 degrees apart"),
    "no azimuth": (V1.replace("Chan  2: 360 Deg", "Chan  2: North "), "no 'Chan n"),
    "downwards": (V1.replace("Up", "Dn"), "no 'Chan n"),
    "no rate": (V1.replace("at 100 pts", "at 0 pts"), "sampling rate is 0"),
    "other start": (V1.replace("03:19:37.0", "03:19:38.0", 1), "start .* differs"),
    "no data line": (V1.replace("Accelerogram points", "points"), "a channel ends without"),
    "no columns": (V1.replace("(8f9.6)", "(0f9.6)"), "nothing to read"),
    "rubbish between": (
        V1.replace("Uncorrected", "Something", 3).replace("Something", "Uncorrected", 1),
        "should begin",
    ),
}
AT2_FAULTS = {
    "count mismatch": (AT2.replace("NPTS=     9", "NPTS=    10"), "line 4: NPTS promises 10 values, the file holds 9"),
    "velocity in g": (AT2.replace("ACCELERATION", "VELOCITY"), "line 3: 'G' is no unit of velocity"),
    "centimetres": (AT2.replace("UNITS OF G", "UNITS OF CM/S"), "line 3: 'CM/S' is no unit of acceleration"),
    "furlongs": (AT2.replace("UNITS OF G", "UNITS OF FURLONGS"), "line 3: unknown unit 'FURLONGS'; known: g, "),
    "no unit": (AT2.replace("UNITS OF G", ""), "no line before this one"),
    "endless count": (AT2.replace("NPTS=     9", "NPTS=" + "9" * 5000), "does not give NPTS and DT"),
    "no step": (AT2.replace("DT=   .01000 SEC", ""), "does not give NPTS and DT"),
    "zero step": (AT2.replace(".01000", "0.0000"), "DT is 0.0000"),
    "text": (AT2.replace(".2000E-02", "  missing"), "line 5: 'missing'"),
    "two points": (AT2.replace(".2000E-02", ".2.00E-02"), "line 5: '.2.00E-02'"),
    "infinite": (AT2.replace(".2000E-02", ".2000E+999"), "not a finite number"),
    "underscore": (AT2.replace(".2000E-02", "1_000"), "not a finite number"),
}
CSV_FAULTS = {
    "no units": (CSV.replace(" [g]", ""), "unknown format"),
    "unknown unit": (CSV.replace("[g]", "[furlong]"), "column a1"),
    "wrong dimension": (CSV.replace("[g]", "[mm]"), "column a1.*not a unit"),
    "gallon": (CSV.replace("[g]", "[gallon]"), "column a1"),
    "no time": (CSV.replace("time [s]", "a2 [g]"), "give time and at least one"),
    "time alone": ("time [s]\n0\n1\n2\n3\n", "give time and at least one"),
    "mixed": (CSV.replace("a3 [cm/s^2]", "u3 [cm]"), "give a1, a2, a3 or v1, v2, v3 or u1, u2, u3"),
    "twice": (CSV.replace("a3", "a1"), "each once"),
    "short row": (CSV + "0.09, 1\n", "line 12: 2 columns, the header names 3"),
    "decimal commas": (CSV.replace("0.1", "0,1"), "columns, the header names 3"),
    "text": (CSV + "0.09, x, 1\n", "line 12: 'x'"),
    "uneven": (CSV + "0.10, 1, 1\n", "line 12: times are not evenly spaced"),
    "repeated": (CSV + "0.08, 1, 1\n", "not evenly spaced"),
    "no rows": ("time [s], a1 [g]\n", "no rows of numbers"),
    "gram": (CSV.replace("[g]", "[gram]"), "column a1: the unit 'gram' is not a unit"),
    "nan": (CSV + "0.09, nan, 1\n", "line 12: 'nan' is not a finite number"),
}
OTHER_FAULTS = {
    "empty": (b"", "the file is empty"),
    "blank": (b" \r\n\n", "the file is empty"),
    "binary": (b"\x7fELF\0\1\2", "a binary file"),
    "damaged gzip": (gzip.compress(V1.encode())[:-200], "damaged gzip"),
    "gzip of nothing": (gzip.compress(b""), "the file is empty"),
    "prose": (b"Dear Sir,\nplease find enclosed\n", "unknown format"),
    "comments": (b"# time [s]\n#\n", "no header"),
    "silence": (AT2[: AT2.index("  .1000")].replace("9, DT", "4, DT").encode() + b"0 0 0 0\n", "are zero"),
}
FAULTS = V1_FAULTS | {f"at2 {k}": v for k, v in AT2_FAULTS.items()}
FAULTS |= {f"csv {k}": v for k, v in CSV_FAULTS.items()} | OTHER_FAULTS


@pytest.mark.parametrize("fault", FAULTS)
def test_damaged_files_are_refused_in_one_line_that_names_the_file(write, fault):
    content, message = FAULTS[fault]
    with pytest.raises(InputError, match=message) as caught:
        read_record(write(content))
    assert "\n" not in str(caught.value) and "record" in str(caught.value)


@settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    text=st.sampled_from([V1, AT2, CSV]),
    edits=st.lists(
        st.tuples(
            st.floats(0, 1), st.integers(0, 40), st.sampled_from(["", "9", "-", ".", "E", "nan", "\n", ",", "é", " "])
        ),
        min_size=1,
        max_size=4,
    ),
)
def test_a_mutated_record_reads_as_finite_data_or_is_refused(tmp_path, text, edits):
    for where, length, insert in edits:
        i = math.floor(where * len(text))
        text = text[:i] + insert + text[i + length :]
    path = tmp_path / "mutant"
    path.write_bytes(text.encode("utf-8"))
    try:
        record = read_record(path)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert isinstance(record, Record) and np.all(np.isfinite(record.acceleration)) and record.time_step > 0


# Peaks found by an independent integration of the same files (band 0.05-40 Hz): acceleration [g], displacement [m].
PEAKS = {
    "ridgecrest-2019-ci-ccc": ((0.56, 0.47, 0.36), (0.26, 0.29, 0.04)),
    "ridgecrest-2019-ci-clc": ((0.35, 0.51, 0.34), (0.25, 0.28, 0.14)),
}


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_records_have_their_known_peaks(name):
    record = bundled(name)
    corrected = baseline_corrected(record)
    np.testing.assert_allclose(np.max(np.abs(corrected.acceleration), axis=0) / G, PEAKS[name][0], atol=0.011)
    np.testing.assert_allclose(np.max(np.abs(corrected.displacement), axis=0), PEAKS[name][1], atol=0.008)
    assert corrected.metadata["end_offset"] < 3e-3
    assert "permanent offset" in corrected.metadata["correction"]
    assert "common window" in record.notes[0]


def test_bundled_refuses_other_names():
    with pytest.raises(InputError, match="choose from ridgecrest"):
        bundled("../../secret")


def test_the_window_is_the_strong_part_and_starts_from_rest():
    record = bundled("ridgecrest-2019-ci-clc")
    assert 220 < strong_window(record, 60.0) < 230
    motion = Motion.from_record(record, duration=60.0)
    ends = [0.0, motion.duration]
    for d in (1, 2):
        np.testing.assert_allclose(motion.evaluate(ends, d), 0, atol=1e-12)
    assert not motion.displacement(0.0).any() and np.linalg.norm(motion.displacement(60.0)) < 0.05
    # The tapers touch nothing but the ends: between them the accelerations are the filtered record's.
    whole = baseline_corrected(record)
    t = np.arange(2.0, 58.0, 0.01)
    samples = np.round((t + motion.metadata["window_start"]) / 0.01).astype(int)
    np.testing.assert_allclose(motion.acceleration(t), whole.acceleration[samples], atol=1e-6)


def test_correction_keeps_a_slow_pulse_and_removes_an_offset():
    t = np.arange(0, 120, 0.01)
    pulse = np.exp(-(((t - 60) / 2) ** 2)) * np.sin(2 * np.pi * 0.5 * (t - 60))
    still = Record("pulse", 0.01, np.outer(pulse, [1, 0, 0]))
    drifting = Record("pulse", 0.01, np.outer(pulse + 0.02, [1, 0, 0]))
    a, b = (baseline_corrected(r).acceleration[500:-500, 0] for r in (still, drifting))
    np.testing.assert_allclose(a, pulse[500:-500], atol=2e-3)
    np.testing.assert_allclose(a, b, atol=2e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"start": -1.0}, r"window \[-1, .*leaves the record"),
        ({"start": 300.0, "duration": 60.0}, "leaves the record"),
        ({"start": 400.0}, "duration"),
        ({"duration": 1e4}, "leaves the record"),
        ({"duration": 3.0}, "too short for tapers"),
        ({"corner": 60.0}, "corner of 60 Hz"),
        ({"taper": 0.0}, "taper"),
        ({"start": math.nan}, "start"),
    ],
)
def test_bad_windows_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        baseline_corrected(bundled("ridgecrest-2019-ci-clc"), **options)


@pytest.mark.parametrize(
    ("step", "values", "message"),
    [
        (0.0, np.ones((9, 3)), "time_step"),
        (0.01, np.ones((9, 2)), r"acceleration: shape \(9, 2\)"),
        (0.01, np.full((9, 3), np.nan), "not finite"),
        (0.01, np.zeros((9, 3)), "zero"),
    ],
)
def test_records_are_validated(step, values, message):
    with pytest.raises(InputError, match=message):
        Record("r", step, values)
