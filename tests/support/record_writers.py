"""Ground motions written the way the agencies write them, for round trips: text of each format from arrays."""

from __future__ import annotations

import numpy as np

G = 9.80665
WORDS = {"acceleration": ("accel", "cm/sec2"), "velocity": ("veloc", "cm/sec"), "displacement": ("displ", "cm")}


def fixed(values, per_line, width, form):
    """Fixed-width rows, neighbours touching."""
    cells = [f"{value:{width}.{form}}" for value in values]
    assert all(len(cell) == width for cell in cells)
    return ["".join(cells[i : i + per_line]) for i in range(0, len(cells), per_line)]


def csmip_v1(channels, rate=100, station="CCC"):
    """Volume 1 of (label, values [m/s^2]) channels, in g."""
    lines = []
    for number, (label, values) in enumerate(channels, start=1):
        lines += [
            "Uncorrected Accelerogram Data             Processed: 07/06/19, CGS",
            "38457511.CI.CCC.--.HN                Start time:  7/06/19, 03:19:37.0 UTC (GPS)",
            f"Station Id. {station}     35.525N, 117.365W    Q330",
            f"Chan  {number}: {label:<30}",
            f"No. of Points ={len(values):7d}  Record Length =354.300 sec   at {rate} Samples/sec",
            f" {len(values)} Accelerogram points at {rate} pts/sec in units of g .      Format: (8f9.6)",
            *fixed(values / G, 8, 9, "6f"),
            f"/&  ----------  End of Data for Channel   {number}  ----------",
        ]
    return "\r\n".join(lines) + "\r\n"


def csmip_v2(channels, step=0.01, form="(8f10.5)"):
    """Volume 2 of (label, {quantity: values in SI}) channels."""
    lines = []
    for number, (label, series) in enumerate(channels, start=1):
        lines += [
            f"Corrected accelerogram   38457511.CI.CCC.--.HN      Chan  {number}: {label}     from   ",
            "Uncorrected Accelerogram Data             Processed: 07/06/19, CGS",
            "38457511.CI.CCC.--.HN                Start time:  7/06/19, 03:19:37.0 UTC (GPS)",
            "Station Id. CCC     35.525N, 117.365W    Q330",
            f"Chan  {number}: {label:<30}",
            f" {len(series['acceleration'])} points of instrument- and baseline-corrected accel, veloc and displ data ",
        ]
        for quantity, values in series.items():
            word, unit = WORDS[quantity]
            head = f" {len(values)} points of {word} data equally spaced at  {step:.3f} sec, in {unit}. {form}"
            lines += [head, *fixed(100 * values, 8, 10, "5f")]
        lines.append(f"/&  ----------  End of data for channel  {number}  ----------")
    return "\n".join(lines) + "\n"


def cosmos(quantity, label, values, step=0.01, volume="Corrected", code="HNE", interval=None):
    """One block of the COSMOS format 1.20, in cm and seconds."""
    reals = np.full(100, -999.0)
    reals[33], reals[61], reals[62] = 0.005, 1000 * (step if interval is None else interval), len(values) * step
    unit, number = {"acceleration": ("cm/sec2", 4), "velocity": ("cm/sec", 5), "displacement": ("cm", 6)}[quantity]
    lines = [
        f"{volume} {quantity:<14}(Format v01.20 with 13 text lines) Src: made",
        "Record of Ridgecrest Earthquake of Fri Jul  5, 2019 20:19 PDT",
        "Hypocenter: To be determined    H=   km       ML=     Mw=",
        "Origin: To be determined",
        "Statn No: 01-    0  Code:CI-CCC  SCSN  China Lake",
        "Coords: 35.525  -117.365   Site geology:",
        "Recorder: Q330   s/n 4114 ( 3 Chns of   3 at Sta) Sensor:",
        "Rcrd start time: 7/06/2019, 03:19:37.0 UTC (Q=5) RcrdId: (see comment)",
        f"Sta Chan  1: {label:<8}(Rcrdr Chan  1) Location:",
        "Raw record length = 354.300 sec, Uncor max =",
        "Processed:",
        "Record not filtered.",
        "Values used when parameter or data value is unknown/unspecified:   -999, -999.0",
        " 100 Integer-header values follow on  10 lines, Format= (10I8)",
        *["    -999" * 10] * 10,
        " 100 Real-header values follow on  17 lines, Format= (6F13.6)",
        *fixed(reals, 6, 13, "6f"),
        '   1 Comment line(s) follow, each starting with a "|":',
        f"|<SCNL>CCC.{code}.CI.--   <AUTH> 2019/07/06",
        f"   {len(values)} {quantity} pts, approx {len(values) * step:4.0f} secs, units={unit} ({number:02d}),"
        "Format=(6E13.6)",
        *fixed(100 * values, 6, 13, "6E"),
        f"End-of-data for Chan  1 {quantity}",
    ]
    return "\n".join(lines) + "\n"


def knet(direction, values, rate=100, offset=-12085, maximum=None, divisor=6182761, record_time="2018/01/24 19:51:43"):
    """A K-NET file of accelerations [m/s^2] as counts about an arbitrary zero."""
    counts = np.round(100 * values / (3920 / divisor)).astype(int) + offset
    gal = (counts - counts.mean()) * 3920 / divisor
    peak = np.abs(gal).max() if maximum is None else maximum
    head = {
        "Origin Time": "2018/01/24 19:51:00",
        "Lat.": "41.0",
        "Long.": "142.5",
        "Depth. (km)": "30",
        "Mag.": "6.2",
        "Station Code": "AOM001",
        "Station Lat.": "41.5267",
        "Station Long.": "140.9244",
        "Station Height(m)": "39",
        "Record Time": record_time,
        "Sampling Freq(Hz)": f"{rate}Hz",
        "Duration Time(s)": f"{len(values) / rate:g}",
        "Dir.": direction,
        "Scale Factor": f"3920(gal)/{divisor}",
        "Max. Acc. (gal)": f"{peak:.3f}",
        "Last Correction": record_time,
        "Memo.": "",
    }
    rows = ["".join(f"{c:8d} " for c in counts[i : i + 8]) for i in range(0, len(counts), 8)]
    return "\n".join([*(f"{key:<17} {value}" for key, value in head.items()), *rows]) + "\n"


def peer(values, step=0.01, last="180", quantity="acceleration", title="IMPERIAL VALLEY 10/15/79 2316, EL CENTRO #9"):
    """A PEER file of values in SI: AT2 in g, VT2 in cm/s, DT2 in cm."""
    unit, factor = {"acceleration": ("G", G), "velocity": ("CM/S", 0.01), "displacement": ("CM", 0.01)}[quantity]
    head = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        f"{title}, {last}",
        f"{quantity.upper()} TIME HISTORY IN UNITS OF {unit}",
        f"NPTS= {len(values):6d}, DT=   {step:.5f} SEC,",
    ]
    return "\n".join([*head, *fixed(values / factor, 5, 15, "7E")]) + "\n"
