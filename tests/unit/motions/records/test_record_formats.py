"""A real record in every format of the agencies and back; each format's traps; a malformed file of each kind."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support import record_writers as w

from msfp_gen import Motion
from msfp_gen.common.errors import InputError
from msfp_gen.motions.records import baseline_corrected, bundled, read_peer, read_record, uncorrected, write_csv

LABELS = ("90 Deg", "360 Deg", "Up")
QUANTITIES = ("acceleration", "velocity", "displacement")


@cache
def real():
    """Three components of an earthquake, corrected: acceleration, velocity, displacement that belong together."""
    return baseline_corrected(bundled("ridgecrest-2019-ci-ccc"), duration=20.0)


def series(quantity):
    return getattr(real(), quantity).T


@pytest.fixture
def put(tmp_path):
    def _put(content, name):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("ascii"))
        return path

    return _put


def three(quantity="acceleration"):
    return list(zip(LABELS, series(quantity), strict=True))


def v2(order=(0, 1, 2), **options):
    return w.csmip_v2([(LABELS[i], {q: series(q)[i] for q in QUANTITIES}) for i in order], **options)


def cosmos_files(put, quantities=QUANTITIES):
    names = ("90 deg", "360 deg", "Up")
    return [put("".join(w.cosmos(q, names[i], series(q)[i]) for i in range(3)), f"{q}.v2c") for q in quantities]


def peer_files(put, quantity="acceleration", lasts=("090", "000", "UP")):
    return [
        put(w.peer(x, last=last, quantity=quantity), f"R_{last}.AT2")
        for x, last in zip(series(quantity), lasts, strict=True)
    ]


def knet_files(put, directions=("E-W", "N-S", "U-D")):
    pairs = zip(directions, series("acceleration"), strict=True)
    return [put(w.knet(direction, x), f"AOM001.{i}") for i, (direction, x) in enumerate(pairs)]


FORMATS = {
    "CSMIP V1": (lambda put: [put(w.csmip_v1(three()), "a.v1")], 1e-6 * w.G),
    "CSMIP V2": (lambda put: [put(v2(), "a.v2")], 1e-7),
    "COSMOS": (cosmos_files, 1e-6),
    "K-NET": (knet_files, 1e-5),
    "KiK-net": (lambda put: knet_files(put, ("5", "4", "6")), 1e-5),
    "PEER": (peer_files, 1e-6),
}


@pytest.mark.parametrize("name", FORMATS)
def test_a_real_record_comes_back_from_every_format(name, put):
    files, precision = FORMATS[name]
    record = read_record(*files(put))
    expected = series("acceleration").T
    if "net" in name.lower():
        expected = expected - expected.mean(axis=0)
    np.testing.assert_allclose(record.acceleration, expected, atol=precision, rtol=0)
    assert record.time_step == pytest.approx(0.01, rel=1e-12) and record.quantity == "acceleration"
    assert not any("zero" in note for note in record.notes)


@pytest.mark.parametrize("name", FORMATS)
def test_files_in_any_order_make_the_same_record(name, put):
    files, _ = FORMATS[name]
    paths = files(put)
    np.testing.assert_array_equal(read_record(*paths[::-1]).acceleration, read_record(*paths).acceleration)


def test_csv_comes_back_to_the_last_digit(tmp_path):
    record = real().as_record(bundled("ridgecrest-2019-ci-ccc"))
    back = read_record(write_csv(record, tmp_path / "a.csv"))
    np.testing.assert_array_equal(back.acceleration, record.acceleration)
    assert back.time_step == pytest.approx(record.time_step, rel=1e-12)
    head = (tmp_path / "a.csv").read_text().split("time [s]")[0]
    assert "# correction: mean removed" in head and "# note: channels cut" in head


@pytest.mark.parametrize("name", ["ridgecrest-2019-ci-ccc", "ridgecrest-2019-ci-clc"])
def test_whole_raw_records_come_back_through_volume_1(name, put):
    record = bundled(name)
    back = read_record(put(w.csmip_v1(zip(record.channels, record.acceleration.T, strict=True)), "a.v1"))
    np.testing.assert_allclose(back.acceleration, record.acceleration, atol=1e-9)


@pytest.mark.parametrize("quantity", ["velocity", "displacement"])
def test_velocity_and_displacement_files_become_accelerations_that_integrate_back(quantity, put):
    record = read_record(*peer_files(put, quantity))
    assert record.quantity == quantity and f"derivative of the {quantity}" in record.notes[-1]
    given = series(quantity).T
    np.testing.assert_allclose(getattr(record, quantity), given, atol=1e-6 * np.abs(given).max())
    ready = uncorrected(record)
    shift = ready.displacement - series("displacement").T
    np.testing.assert_allclose(shift, shift[:1] * np.ones_like(shift), atol=2e-4)
    rms = np.sqrt(np.mean((record.acceleration - series("acceleration").T) ** 2))
    assert rms < 0.1 * np.sqrt(np.mean(series("acceleration") ** 2))  # a spline through samples of a jagged curve


def test_volume_2_keeps_what_the_agency_integrated(put):
    record = read_record(put(v2(), "a.v2"))
    np.testing.assert_allclose(record.velocity, series("velocity").T, atol=1e-7)
    np.testing.assert_allclose(uncorrected(record).displacement, series("displacement").T, atol=2e-4)
    old = v2().replace("(8f10.5)", "").replace("in cm/sec2.", "(UNITS: CM/SEC/SEC)").upper() + "\x1a" * 80
    np.testing.assert_array_equal(read_record(put(old, "old.v2")).acceleration, record.acceleration)


def test_unequal_channels_are_cut_to_their_common_window(put):
    parts = [(label, x[: len(x) - 10 * i]) for i, (label, x) in enumerate(three())]
    record = read_record(put(w.csmip_v1(parts), "a.v1"))
    assert len(record.acceleration) == 1981
    assert record.notes == ("channels cut to their common window of 1981 points (were 2001, 1991, 1981)",)


def test_knet_time_and_unit(put):
    record = read_record(*knet_files(put))
    assert record.start_time == "2018/01/24 19:51:28 JST"  # Record Time less 15 s
    assert record.units == "gal" and "mean of each channel removed" in record.notes[0]
    assert np.abs(record.acceleration[:, 0]).max() == pytest.approx(np.abs(series("acceleration")[0]).max(), rel=1e-4)
    early = put(w.knet("E-W", series("acceleration")[0], record_time="2018/01/01 00:00:05"), "b.EW")
    assert read_record(early).start_time == "2017/12/31 23:59:50 JST"


@pytest.mark.parametrize(
    ("last", "name", "axis", "sign"),
    [
        ("UP", "a.AT2", 2, 1),
        ("DWN", "a.AT2", 2, -1),
        ("BHZ00", "a.AT2", 2, 1),
        ("V", "a.AT2", 2, 1),
        ("180", "a.AT2", 0, 1),
        ("N", "a.AT2", 0, 1),
        ("045 (USGS STATION 5056)", "a.AT2", 0, 1),
        ("Array No 9", "RSN6_IMPVALL.I_I-ELC-UP.AT2", 2, 1),
        ("Array No 9", "RSN6_IMPVALL.I_I-ELC180.AT2", 0, 1),
    ],
)
def test_peer_finds_the_vertical(last, name, axis, sign, put):
    values = series("acceleration")[0]
    record = read_record(put(w.peer(values, last=last), name))
    np.testing.assert_allclose(record.acceleration[:, axis], sign * values, atol=1e-6)
    assert not np.delete(record.acceleration, axis, axis=1).any()


def test_peer_with_seven_header_lines_counts_the_new_points(put):
    head = [
        "TIME-DOMAIN CORRECTION USING BASE.FOR",
        "********OLD HEADERS FOLLOW:*********************",
        "SPECTRAL MATCHING OF A PEER RECORD",
        "OUTPUT ACCELERATION TIME HISTORY (G'S): NIT = 2",
        " 16384     DT =      .0050 SEC  ,  AMAX =  .9094E-01 G",
        "********END OF OLD HEADERS*****",
        "NPTS= 9, DT= .01 SEC",
    ]
    body = "1.2-3.4 .1000E-01-.2000E-01\n 1 2 3 4\n5\n"
    record = read_record(put("\n".join(head) + "\n" + body, "nrc.AT2"))
    np.testing.assert_allclose(record.acceleration[:, 0], w.G * np.array([1.2, -3.4, 0.01, -0.02, 1, 2, 3, 4, 5]))
    assert record.time_step == 0.01


def test_read_peer_takes_the_order_it_is_given(put):
    files = peer_files(put)
    swapped = read_peer(files[1], files[0], files[2])
    np.testing.assert_allclose(swapped.acceleration, series("acceleration").T[:, [1, 0, 2]], atol=1e-6)
    velocity = put(w.peer(series("velocity")[1], quantity="velocity"), "b.VT2")
    with pytest.raises(InputError, match="acceleration and velocity; give files of one quantity"):
        read_peer(files[0], velocity)


def test_cosmos_takes_the_interval_of_this_series_not_the_recorders(put):
    values = series("acceleration")[0]
    record = read_record(put(w.cosmos("acceleration", "90 deg", values), "a.v1c"))
    assert record.time_step == 0.01  # 0.005 s stands where the recorder's is
    with pytest.raises(InputError, match=r"2001 points at 0\.005 s are 10\.005 s, but the line says 20 s"):
        read_record(put(w.cosmos("acceleration", "90 deg", values, interval=0.005), "b.v1c"))


def test_cosmos_without_azimuth_reads_the_code_of_the_channel(put):
    record = read_record(put(w.cosmos("acceleration", "Other", series("acceleration")[2], code="BNZ"), "a.v2c"))
    assert record.acceleration[:, 2].any() and not record.acceleration[:, :2].any()


A = np.sin(np.arange(40.0))
V1, V2 = w.csmip_v1([(label, A) for label in LABELS]), w.csmip_v2([(label, {"acceleration": A}) for label in LABELS])
COSMOS, KNET, PEER = w.cosmos("acceleration", "90 deg", A, step=0.05), w.knet("E-W", A), w.peer(A, quantity="velocity")
CSV = "time [s], v1 (cm/s)\n" + "".join(f"{0.01 * i:.2f}, {i}\n" for i in range(9))
KINDS = {"V1": V1, "V2": V2, "COSMOS": COSMOS, "K-NET": KNET, "PEER": PEER, "CSV": CSV}
FAULTS = {
    "V2 truncated": (V2[: len(V2) // 2], "truncated|columns of width"),
    "V2 wrong count": (V2.replace(" 40 points of accel", " 48 points of accel", 1), "8 columns of width 10 expected"),
    "V2 wrong unit": (V2.replace("in cm/sec2.", "in cm/sec.", 1), "line 7: 'cm/sec' is no unit of acceleration"),
    "V2 nan": (V2.replace(f"{100 * A[1]:10.5f}", "       NaN", 1), "line 8: 'NaN' is not a finite number"),
    "V2 overflow": (V2.replace(f"{100 * A[1]:10.5f}", "*" * 10, 1), "line 8: '[*]{10}' is not a finite number"),
    "V2 no end": (V2.replace("/&", "  ", 1), "end mark"),
    "V2 no data": (V2.replace("points of accel data", "of accel data"), "ends without a line"),
    "V2 other station": (V2.replace("Station Id. CCC", "Station Id. CLC", 1), "station 'CCC' differs .*'CLC'"),
    "COSMOS truncated": (COSMOS[: len(COSMOS) - 150], "truncated|columns of width"),
    "COSMOS counts": (COSMOS.replace("units=cm/sec2", "units=counts"), "raw counts, whose scale is not in the file"),
    "COSMOS wrong unit": (COSMOS.replace("units=cm/sec2", "units=cm"), "'cm' is no unit of acceleration"),
    "COSMOS wrong count": (COSMOS.replace(" 40 acc", " 38 acc"), "columns of width|more data"),
    "COSMOS nan": (COSMOS.replace(f"{100 * A[1]:13.6E}", "          NaN"), "'NaN' is not a finite number"),
    "COSMOS no reals": (COSMOS.replace("Real-header", "Other"), "no line '... Real-header values"),
    "COSMOS no interval": (COSMOS.replace("    50.000000", "  -999.000000"), "sample interval in ms, is missing"),
    "COSMOS no data": (COSMOS.replace(" pts,", " values,"), "a channel without a line"),
    "COSMOS rubbish": (COSMOS + "thank you\n", "'thank you' where a channel should begin"),
    "K-NET truncated": (KNET[: len(KNET) - 60], "promise 40 values, the file holds"),
    "K-NET wrong peak": (w.knet("E-W", A, maximum=12.0), r"the data peak at .* gal, the header says 12\.000"),
    "K-NET wrong unit": (KNET.replace("(gal)/", "(g)/"), "scale factor is not of the form"),
    "K-NET no divisor": (KNET.replace("/6182761", "/0"), "divisor of the scale factor is 0; it must be positive"),
    "K-NET direction": (KNET.replace("E-W", "X-Y"), "line 13: unknown direction 'X-Y'; known: N-S"),
    "K-NET time": (w.knet("E-W", A, record_time="24.1.2018 19:51"), "'24.1.2018 19:51' is no time of the form"),
    "K-NET nan": (KNET.replace("-12085", "   nan", 1), "'nan' is not a finite number"),
    "K-NET no header": (KNET.replace("Sampling Freq", "Sampled"), "no line 'Sampling Freq'"),
    "PEER truncated": (PEER[:-40], "NPTS promises 40 values|is not a finite number"),
    "PEER NPTS": (PEER.replace("NPTS=     40", "NPTS=     39"), "NPTS promises 39 values, the file holds 40"),
    "PEER wrong unit": (PEER.replace("UNITS OF CM/S", "UNITS OF CM"), "'CM' is no unit of velocity"),
    "PEER nan": (PEER.replace("E+01", " NaN ", 1), "is not a finite number"),
    "CSV unit": (CSV.replace("(cm/s)", "(gal)"), "column v1: the unit 'gal' is not a unit"),
    "CSV nan": (CSV + "0.09, NaN\n", "line 11: 'NaN' is not a finite number"),
    "CSV truncated": (CSV + "0.09", "line 11: 1 columns, the header names 2"),
}
CUT = "truncated|unknown format|no NPTS|no line|no rows"
FAULTS |= {f"{k} binary": (text.encode()[:40] + b"\0\xff\0", "a binary file") for k, text in KINDS.items()}
FAULTS |= {f"{k} header alone": (text[: text.index("\n") + 1], CUT) for k, text in KINDS.items()}


@pytest.mark.parametrize("fault", FAULTS)
def test_malformed_files_are_refused_in_one_line(fault, put):
    content, message = FAULTS[fault]
    with pytest.raises(InputError, match=message) as caught:
        read_record(put(content, "record.txt"))
    assert "\n" not in str(caught.value) and "record.txt" in str(caught.value)


@pytest.mark.parametrize("kind", KINDS)
def test_the_files_that_are_damaged_above_are_sound(kind, put):
    record = read_record(put(KINDS[kind], "record.txt"))
    assert record.acceleration.any()


def test_files_that_do_not_belong_together_are_refused(put):
    a = series("acceleration")
    with pytest.raises(InputError, match=r"b\.txt: K-NET, but a\.txt is CSMIP V1, V2; give one recording"):
        read_record(put(V1, "a.txt"), put(KNET, "b.txt"))
    with pytest.raises(InputError, match=r"station 'AOM001 surface' differs .*'AOM001 borehole'"):
        read_record(put(w.knet("1", a[0]), "a.NS1"), put(w.knet("5", a[1]), "b.EW2"))
    with pytest.raises(InputError, match="two horizontal ones and one Up are needed"):
        read_record(put(w.knet("U-D", a[0]), "a.UD"), put(w.knet("U-D", a[1]), "b.UD"))
    with pytest.raises(InputError, match="not 90 degrees apart"):
        read_record(put(w.peer(a[0], last="010"), "a.at2"), put(w.peer(a[1], last="060"), "b.at2"))
    with pytest.raises(InputError, match=r"station '.*OTHER' differs"):
        read_record(put(w.peer(a[0], last="000"), "a.at2"), put(w.peer(a[1], last="090", title="M 6, OTHER"), "b.at2"))
    with pytest.raises(InputError, match="1 channels of velocity, 2 of acceleration"):
        read_record(
            put(w.peer(a[0], last="000"), "a.at2"),
            put(w.peer(a[1], last="090"), "b.at2"),
            put(w.peer(a[0], last="000", quantity="velocity"), "a.vt2"),
        )
    with pytest.raises(InputError, match="unknown format"):
        read_record(put(CSV, "a.csv"), put(CSV, "b.csv"))


def test_uncorrected_refuses_a_record_that_drifts(put):
    with pytest.raises(InputError, match=r"correct: without it the record ends at .* it drifts"):
        uncorrected(bundled("ridgecrest-2019-ci-clc"), duration=60.0)


# --- files that end inside their last number

PLAIN = "time [s], a1 [m/s^2]\n" + "".join(
    f"{0.01 * i:.2f}, {x:.6f}\n" for i, x in enumerate(series("acceleration")[0])
)
WHOLE = {**KINDS, "CSV, fixed decimals": PLAIN, "CSV, exponents": PLAIN.split("\n")[0] + "\n"}
WHOLE["CSV, exponents"] += "".join(f"{0.01 * i:.2f}, {x:.5e}\n" for i, x in enumerate(series("acceleration")[0]))


@pytest.mark.parametrize("kind", [kind for kind in WHOLE if kind != "CSV"])
def test_a_file_that_ends_inside_its_last_number_is_refused(kind, put):
    marks = [WHOLE[kind].rfind(mark) for mark in ("/&", "End-of-data")]
    whole = WHOLE[kind][: max(marks)].rstrip()  # of a file without such a mark all but the last line break
    if max(marks) < 0:
        read_record(put(whole, "record.txt"))  # is sound
    size = len(whole) - max(whole.rfind(mark) for mark in (" ", ",", "\n")) - 1
    for missing in range(1, size):
        with pytest.raises(InputError, match=r"record\.txt, line \d+: "):
            read_record(put(whole[:-missing], "record.txt"))


def test_a_last_number_that_may_be_cut_is_noted(put):
    """Numbers of any length: a whole file without a line break at its end, a cut one, a few rows written by hand."""
    rows = [f"{0.01 * i!r}, {x!r}" for i, x in enumerate(series("acceleration")[0][:900].tolist())]
    whole = "\n".join(["time [s], a1 [m/s^2]", *rows])
    assert not any("cut" in note for note in read_record(put(whole, "record.csv")).notes)
    note = next(note for note in read_record(put(whole[:-8], "record.csv")).notes if "cut" in note)
    assert note.startswith("the file ends without a line break after ") and note.endswith("it may be cut")
    assert note in str(Motion.from_csv(put(whole[:-8], "record.csv")).metadata["notes"])
    assert not any("may be cut" in note for note in read_record(put(whole[:-8] + "\n", "record.csv")).notes)
    by_hand = "time [s], u1 [mm]\n0.0, 0.00\n0.1, 0.25\n0.2, 0.50\n0.3, 0.25\n0.4, 0"
    assert any("may be cut" in note for note in read_record(put(by_hand, "record.csv")).notes)
