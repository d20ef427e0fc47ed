"""`msfp-gen record`: what it prints, what it writes, what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from support import record_writers as w

from msfp_gen.cli import main
from msfp_gen.motions.records import Record, baseline_corrected, bundled, read_record, response_spectrum, write_csv

NAME = "ridgecrest-2019-ci-clc"


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """20 s of an earthquake as CSV: quick to read."""
    ready = baseline_corrected(bundled(NAME), duration=20.0)
    return write_csv(ready.as_record(bundled(NAME)), tmp_path_factory.mktemp("records") / "short.csv")


def run(capsys, *arguments):
    code = main(["record", *map(str, arguments)])
    streams = capsys.readouterr()
    return code, streams.out, streams.err


def test_it_says_what_is_in_a_file(capsys, short):
    code, out, _ = run(capsys, short)
    assert code == 0
    for part in ("short.csv", "acceleration in", "PGA [g]", "D5-95 [s]", "rotd100", "2001 every 0.01 s"):
        assert part in out
    row = next(line.split() for line in out.splitlines() if line.strip().startswith("E2 "))
    peak = np.abs(read_record(short).acceleration[:, 1]).max() / w.G
    assert float(row[1]) == pytest.approx(peak, abs=1e-3) and row[2] == row[3] == "-"


def test_correction_scaling_and_files(capsys, short, tmp_path):
    plot, spectrum, output = (tmp_path / name for name in ("c.png", "s.csv", "o.csv"))
    target = "sa=0.5 g, period=1.5, component=rotd50"
    code, out, err = run(capsys, short, "--plot", plot, "--spectrum", spectrum, "-o", output, "--scale-to", target)
    assert code == 0 and err.count("wrote") == 3 and plot.stat().st_size > 10_000
    assert "scaled to" in out and "PGV" in out and "high-pass at 0.05 Hz" in out
    written = read_record(output)
    assert response_spectrum(written, [1.5]).psa[0, 4] == pytest.approx(0.5 * w.G, rel=1e-3)
    rows = np.loadtxt(spectrum, delimiter=",", skiprows=2)
    assert rows.shape == (100, 19)
    assert np.interp(1.5, rows[:, 0], rows[:, 5]) == pytest.approx(0.5 * w.G, rel=0.02)


def test_spectrum_as_a_figure_with_its_target(capsys, short, tmp_path):
    figure = tmp_path / "s.svg"
    assert run(capsys, short, "--spectrum", figure, "--scale-to", "sds=1 g, sd1=0.6 g, between=0.5:3")[0] == 0
    assert figure.read_text().count("<path") > 10


def test_components_in_files_of_their_own(capsys, short, tmp_path):
    files = []
    for values, last in zip(read_record(short).acceleration.T, ("090", "000", "UP"), strict=True):
        files.append(tmp_path / f"r{last}.AT2")
        files[-1].write_text(w.peer(values, last=last))
    code, out, _ = run(capsys, *files, "--as-is")
    assert code == 0 and "r090.AT2, r000.AT2, rUP.AT2" in out and "none: taken as it is" in out


def test_a_bundled_record_by_its_name(capsys):
    code, out, _ = run(capsys, NAME, "--duration", "20")
    assert code == 0 and "window" in out and "CLC" in out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--plot", "a.txt"], "--plot = 'a.txt': give a name that ends in .png"),
        (["--spectrum", "nowhere/s.csv"], "--spectrum: folder"),
        (["-o", "a.mat"], "--output = 'a.mat': give a name that ends in .csv"),
        (["--scale-to", "pga=1 gram"], "scale_to.pga = '1 gram'"),
        (["--scale-to", "nonsense"], "scale_to: 'nonsense'; give name=value"),
        (["--duration", "1e6"], "leaves the record"),
        (["--corner", "x"], "'x' is not a number"),
        (["--as-is", "--corner", "0.1"], "--as-is: excludes correction"),
    ],
)
def test_bad_options_are_one_line_and_write_nothing(options, message, capsys, short, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, short, *options)
    assert code == 2 and err.startswith("error: ") and err.count("\n") == 1 and message in err and not out
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_not_there(capsys):
    code, _, err = run(capsys, "gone.v1")
    assert code == 2 and err == "error: gone.v1: cannot be read (No such file or directory); check the path\n"


def test_a_record_that_drifts_is_not_taken_as_it_is(capsys, tmp_path):
    drifting = Record("drift", 0.01, np.random.default_rng(2).normal(size=(3000, 3)) + 0.5)
    code, _, err = run(capsys, write_csv(drifting, tmp_path / "d.csv"), "--as-is")
    assert code == 2 and "it drifts; correct it" in err
