"""Components and direction of a record, suites, and the scaling of their mean spectrum."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from msfp_gen import InputError, Motion, load_scene
from msfp_gen.cli import main
from msfp_gen.common.fields import G
from msfp_gen.motions.records import Record, ScaleTo, response_spectrum, scaled_suite, write_csv
from msfp_gen.results.result import load_result
from msfp_gen.scene.file.loader import load_suite
from msfp_gen.studies.sweep import variations, varied_field

STEP = 0.02


def quake(seed: int, size: float = 1.0) -> Record:
    """Three components of filtered noise, 20 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(1000) * STEP
    noise = np.cumsum(rng.standard_normal((1000, 3)), axis=0)
    noise -= np.linspace(0, 1, 1000)[:, None] * noise[-1]
    return Record(f"quake{seed}", STEP, size * noise * np.sin(np.pi * t / t[-1])[:, None] ** 2)


SCENE = """
bearing = "fenz-tfp"
[motion]
kind = "record"
file = "a.csv"
{}
[top]
kind = "rig"
axial_load = "112 kN"
stiffness = 1e8
rotational_stiffness = 1e8
[effects]
dimension = "spatial"
sliders = "inertial"
rims = true
uplift = false
"""
SUITE = '[[records]]\nfile = "a.csv"\n[[records]]\nfile = "b.csv"\nrotated_by = "30 deg"\n'
TARGET = '[scale_to]\nsds = "0.2 g"\nsd1 = "0.1 g"\nbetween = [0.5, 2.0]\ncomponent = "rotd100"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, seed, size in (("a", 1, 0.1), ("b", 2, 0.3)):
        write_csv(quake(seed, size), tmp_path / f"{name}.csv")
    (tmp_path / "scene.toml").write_text(SCENE.format("scale = 0.2"), encoding="utf-8")
    return tmp_path


def test_components_are_kept_and_the_rest_is_zero() -> None:
    record = quake(1)
    kept = record.with_components(["E3", "E1"])
    np.testing.assert_array_equal(kept.acceleration[:, [0, 2]], record.acceleration[:, [0, 2]])
    assert not kept.acceleration[:, 1].any() and kept.channels == ("E1", "", "E3") and "left out: E2" in kept.notes[-1]
    assert record.with_components(["E1", "E2", "E3"]).notes == record.notes
    with pytest.raises(InputError, match="components = \\['E2'\\]: quake1 has nothing along them"):
        kept.with_components(["E2"])
    with pytest.raises(InputError, match="give one or more of E1, E2, E3"):
        record.with_components(["N"])


def test_a_record_rotates_as_a_motion_does(folder: Path) -> None:
    """Through correction and all: the filter and the taper are linear and the same for both components."""
    angle = 0.7
    before, after = (Motion.from_record(record) for record in (quake(1), quake(1).rotated(angle)))
    t = np.linspace(0, before.duration, 300)
    turned = before.rotated(angle)
    for name in ("displacement", "velocity", "acceleration"):
        found, wanted = getattr(after, name)(t), getattr(turned, name)(t)
        assert np.abs(found - wanted).max() < 1e-9 * np.abs(wanted).max()
    (folder / "scene.toml").write_text(SCENE.format('components = ["E1"]\nrotated_by = "90 deg"'), encoding="utf-8")
    motion = load_scene(folder / "scene.toml").motion
    own = Motion.from_record(quake(1, 0.1))
    np.testing.assert_allclose(motion.acceleration(t)[:, 1], own.acceleration(t)[:, 0], rtol=1e-9, atol=1e-12)
    assert np.abs(motion.acceleration(t)[:, [0, 2]]).max() < 1e-12


@pytest.mark.parametrize("share", [None, 1.0, 0.9])
def test_the_mean_spectrum_meets_the_target(share: float | None) -> None:
    motions = [Motion.from_record(quake(seed, size)) for seed, size in ((1, 0.1), (2, 1.0), (3, 7.0))]
    target = ScaleTo(sds=2.0, sd1=1.0, between=(0.5, 2.0), component="rotd50")
    found = scaled_suite(motions, target, share)
    single = [target.factor(motion) for motion in motions]
    np.testing.assert_allclose(found.factors / single, found.factors[0] / single[0], rtol=1e-12)
    curves = [f * response_spectrum(m, found.period).psa[:, 4] for f, m in zip(found.factors, motions, strict=True)]
    ratio = np.mean(curves, axis=0) / found.target
    if share is None:
        assert np.mean(np.log(ratio)) == pytest.approx(0, abs=1e-12)
    else:
        assert ratio.min() == pytest.approx(share, rel=1e-12) and found.least_share == pytest.approx(share)


def test_a_suite_scales_its_records_and_its_motions_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "suite.toml"
    path.write_text(SUITE + TARGET + "least_share = 1\n", encoding="utf-8")
    suite = load_suite(path)
    assert suite.scaled is not None and suite.scaled.least_share == pytest.approx(1)
    for record, factor in zip(suite.records, suite.scaled.factors, strict=True):
        assert record.table["scale"] == factor == record.motion.metadata["scale"]
    found = variations(folder / "scene.toml", [varied_field("duration=1,2")], suite.records)
    assert [list(v.varied.values()) for v in found] == [["a", 1], ["a", 2], ["b", 1], ["b", 2]]
    assert found[2].scene.motion == suite.records[1].motion and found[2].scene.name == "scene, record = b, duration = 1"
    assert main(["suite", str(path), "--spectrum", str(folder / "s.png")]) == 0
    out, _ = capsys.readouterr()
    assert "its least share of the target is 1.000" in out and (folder / "s.png").stat().st_size > 10_000
    words = ["--suite", str(path), "--vary", "duration=0.5", "-o", str(folder / "runs")]
    assert main(["batch", str(folder / "scene.toml"), *words]) == 0
    kept = load_result(folder / "runs" / "2-scene-record-b-duration-0.5.nc")
    assert kept.scene.motion == suite.records[1].motion
    peak = np.abs(suite.records[0].motion.acceleration(suite.records[0].motion.knots)).max(axis=0)[0] / G
    assert f"{peak:.4f}" in out


def test_doubtful_factors_and_targets_of_a_suite_are_printed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By `suite`, and by `batch` before its runs; the target in g, one record too strong, one too weak."""
    path = folder / "suite.toml"
    path.write_text('[[records]]\nfile = "a.csv"\nscale = 4\n[[records]]\nfile = "b.csv"\n', encoding="utf-8")
    (folder / "fine.toml").write_text(SUITE.replace("b.csv", "a.csv"), encoding="utf-8")
    assert main(["suite", str(path)]) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if " = " in line]
    assert len(lines) == 1 and lines[0].startswith("a: motion.scale = 4 changes the record by more than is usual")
    assert main(["batch", str(folder / "scene.toml"), "--suite", str(path), "--vary", "duration=0.1,0.2"]) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "motion.scale" in line]
    assert len(lines) == 1 and "record = a, duration = 0.1: motion.scale = 4 changes" in lines[0]
    assert lines[0].endswith("; likewise scene, record = a, duration = 0.2")
    path.write_text(SUITE + TARGET.replace('"0.2 g"', "0.2").replace('"0.1 g"', "0.1"), encoding="utf-8")
    bare = "scale_to.sds = 0.2 m/s^2 is 0.0204 g; give the unit"
    assert main(["suite", str(path)]) == 0
    assert [line for line in capsys.readouterr().err.splitlines() if line.startswith(bare)]
    assert main(["batch", str(folder / "scene.toml"), "--suite", str(path), "--vary", "duration=0.1"]) == 0
    assert [line for line in capsys.readouterr().err.splitlines() if line.startswith(bare)]
    assert main(["record", str(folder / "a.csv"), "--scale-to", "sa=0.5, period=1"]) == 0
    assert "scale_to.sa = 0.5 m/s^2 is 0.051 g; give the unit" in capsys.readouterr().err
    assert main(["record", str(folder / "a.csv"), "--scale-to", "sa=0.5 g, period=1"]) == 0
    assert "scale_to" not in capsys.readouterr().err


def test_a_suite_without_a_target_keeps_the_factors_of_its_records(folder: Path) -> None:
    path = folder / "suite.toml"
    path.write_text('[[records]]\nfile = "a.csv"\nscale = 2\n[[records]]\nfile = "a.csv"\n', encoding="utf-8")
    suite = load_suite(path)
    assert suite.scaled is None and [record.name for record in suite.records] == ["a-1", "a-2"]
    one, other = (np.abs(record.motion.coefficients).max() for record in suite.records)
    assert one == pytest.approx(2 * other)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("records = []", "records = []: give at least one [[records]]"),
        ("", "records is missing"),
        ('[[records]]\nfile = "c.csv"', "records[0].file = "),
        ('[[records]]\nfile = "../c.csv"', "records[0].file = '../c.csv': outside the folder"),
        ('[[records]]\nfile = "a.csv"\nkind = "record"', "records[0].kind: unknown key"),
        ('[[records]]\nfile = "a.csv"\ncomponents = ["N"]', "records[0].components = ['N']: give a list of E1, E2 and"),
        (SUITE + "[scale_to]\npga = 1", "scale_to.pga: a mean spectrum has no peak"),
        (SUITE + TARGET + "least_share = 0", "scale_to.least_share = 0: give a finite number above 0"),
        ('[[records]]\nfile = "a.csv"\nscale = 2\n' + TARGET, "records[0].scale: [scale_to] scales all records"),
        ("[[records", "no valid TOML"),
    ],
)
def test_bad_suites_are_refused_in_one_line(
    text: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "suite.toml"
    path.write_text(text, encoding="utf-8")
    assert main(["batch", str(folder / "scene.toml"), "--suite", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith(f"error: {path}: ") and err.count("\n") == 1 and words in err


def test_a_suite_and_a_varied_motion_exclude_each_other(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "suite.toml"
    path.write_text(SUITE, encoding="utf-8")
    words = ["batch", str(folder / "scene.toml"), "--suite", str(path), "--vary", "motion.scale=1,2"]
    assert main(words) == 2 and "--vary motion.scale: --suite gives the motion" in capsys.readouterr().err
    assert main(["suite", str(path), "--spectrum", str(folder / "s.png")]) == 2
    assert "has no [scale_to]" in capsys.readouterr().err
    assert main(["suite", str(folder / "none.toml")]) == 2 and "no such file" in capsys.readouterr().err


def test_the_command_record_keeps_and_turns_components(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = folder / "turned.csv"
    words = ["record", str(folder / "a.csv"), "--components", "E1,E3", "--rotated-by", "90", "-o", str(output)]
    assert main(words) == 0 and "rotated by 90 degrees" in capsys.readouterr().out
    rows = np.loadtxt(output, delimiter=",", comments=["#", "t"])
    np.testing.assert_allclose(rows[:, 2], quake(1, 0.1).acceleration[:, 0], atol=1e-9)
    assert main(["record", str(folder / "a.csv"), "--components", "E4"]) == 2
    assert "--components = ['E4']: give one or more of E1, E2, E3" in capsys.readouterr().err
