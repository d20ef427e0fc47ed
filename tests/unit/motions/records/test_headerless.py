"""Files of numbers without a header: unit and time step are stated by the user, in Python, scenes and commands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from msfp_gen import InputError, Motion
from msfp_gen.cli import main
from msfp_gen.common.fields import G
from msfp_gen.motions.records import read_record
from msfp_gen.scene.file.motion_tables import RecordMotion

STEP = 0.01
VALUES = np.round(np.random.default_rng(3).normal(size=(400, 3)) * np.hanning(400)[:, None], 4)
TIMES = STEP * np.arange(len(VALUES))


def columns(*parts: Any, between: str = " ") -> str:
    rows = np.column_stack(parts)
    return "\n".join(between.join(f"{value:.4f}" for value in row) for row in rows) + "\n"


def sequence(values: Any, across: int) -> str:
    return "".join(" ".join(f"{v:.4f}" for v in values[i : i + across]) + "\n" for i in range(0, len(values), across))


@pytest.mark.parametrize(
    ("texts", "options", "shown"),
    [
        ([columns(TIMES, VALUES)], {"unit": "g"}, (0, 1, 2)),
        ([columns(TIMES, VALUES, between=", ")], {"unit": "g"}, (0, 1, 2)),
        (["# a comment\n" + columns(VALUES[:, :2])], {"unit": "G", "time_step": STEP}, (0, 1)),
        ([columns(VALUES[:, 0])], {"unit": "g", "time_step": STEP}, (0,)),
        ([columns(VALUES[:, i]) for i in range(3)], {"unit": "g", "time_step": STEP}, (0, 1, 2)),
        ([columns(TIMES, VALUES[:, i]) for i in range(2)], {"unit": "g"}, (0, 1)),
        ([sequence(VALUES[:, i], 7) for i in range(3)], {"unit": "g", "time_step": STEP}, (0, 1, 2)),
    ],
)
def test_numbers_become_the_record(
    tmp_path: Path, texts: list[str], options: dict[str, Any], shown: tuple[int, ...]
) -> None:
    paths = [tmp_path / f"{i}.txt" for i in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text, encoding="utf-8")
    record = read_record(*paths, **options)
    wanted = np.zeros_like(VALUES)
    wanted[:, shown] = G * VALUES[:, shown]
    np.testing.assert_allclose(record.acceleration, wanted, atol=1e-12)
    assert record.time_step == pytest.approx(STEP, rel=1e-12) and record.quantity == "acceleration"
    # The same by a scene, where both are texts with units.
    table = {key: value if key == "unit" else float(value) for key, value in options.items()}
    motion = RecordMotion(file=tuple(map(str, paths)), taper=0.5, **table).build()
    assert motion == Motion.from_record(record, taper=0.5)


def test_velocities_have_their_unit(tmp_path: Path) -> None:
    (tmp_path / "v.txt").write_text(columns(TIMES, VALUES), encoding="utf-8")
    record = read_record(tmp_path / "v.txt", unit="cm/s")
    assert record.quantity == "velocity" and record.velocity is not None
    np.testing.assert_allclose(record.velocity, 0.01 * VALUES)


CSV = "time [s], a1 [g]\n" + columns(TIMES, VALUES[:, 0], between=", ")
PEER = "PEER\nX\nACCELERATION TIME HISTORY IN UNITS OF G\nNPTS= 8, DT= .01 SEC\n" + 8 * " .1"


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        (columns(TIMES, VALUES), {}, ("unit: r.txt has no header",)),
        (columns(TIMES, VALUES), {"time_step": STEP}, ("unit: r.txt has no header",)),
        (columns(TIMES, VALUES), {"unit": "ft"}, ("unit = 'ft'", "cm/s2")),
        (columns(VALUES[:, 0]), {"unit": "g"}, ("r.txt, line 1", "give the time_step")),
        (columns(VALUES[:, :2]), {"unit": "g"}, ("r.txt, line 1", "no time", "give the time_step")),
        (columns(TIMES, VALUES), {"unit": "g", "time_step": STEP}, ("leave out time_step",)),
        (columns(TIMES, VALUES[:, 0]), {"unit": "g", "time_step": STEP}, ("leave out time_step",)),
        (columns(TIMES, VALUES[:, 0], VALUES), {"unit": "g"}, ("more than 3 columns",)),
        (columns(TIMES, VALUES) + "4.0 0.1\n", {"unit": "g"}, ("line 401: 2 columns, line 1 has 4",)),
        (columns(TIMES, VALUES) + "4.0 0.1 0.1 x\n", {"unit": "g"}, ("line 401", "'x' is not a finite number")),
        (columns(np.delete(TIMES, 9), np.delete(VALUES, 9, 0)), {"unit": "g"}, ("line 10", "fill the gap")),
        (columns(TIMES, VALUES), {"unit": "g", "time_step": -1.0}, ("time_step",)),
        (CSV, {"unit": "g"}, ("unit = 'g': r.txt is CSV, whose header states it; leave it out",)),
        (CSV, {"time_step": STEP}, ("time_step = 0.01: r.txt is CSV",)),
        (PEER, {"unit": "g"}, ("unit = 'g': r.txt is PEER",)),
    ],
)
def test_what_is_missing_or_does_not_fit_is_named(
    tmp_path: Path, text: str, options: dict[str, Any], words: tuple[str, ...]
) -> None:
    path = tmp_path / "r.txt"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_record(path, **options)
    assert all(word in str(raised.value) for word in words), str(raised.value)
    assert "\n" not in str(raised.value)


def test_scene_and_command_name_the_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "r.txt"
    path.write_text(columns(VALUES[:, 0]), encoding="utf-8")
    with pytest.raises(InputError, match=r"^motion\.unit: r\.txt has no header"):
        RecordMotion(file=str(path)).build()
    with pytest.raises(InputError, match=r"^motion\.unit and motion\.time_step are of files"):
        RecordMotion(bundled="ridgecrest-2019-ci-ccc", unit="g").build()
    assert main(["record", str(path)]) == 2
    assert "unit: r.txt has no header" in capsys.readouterr().err
    assert main(["record", str(path), "--unit", "cm/s2", "--time-step", "0.01"]) == 0
    assert "400 every 0.01 s" in capsys.readouterr().out


@given(
    text=st.text(alphabet="0123456789.-+e, \n\t;#%x", max_size=120),
    unit=st.sampled_from([None, "g", "cm", "x"]),
    step=st.sampled_from([None, 0.01, 1e300]),
)
@settings(max_examples=200, derandomize=True, deadline=None, suppress_health_check=list(HealthCheck))
def test_anything_is_read_or_refused_in_one_line(
    text: str, unit: str | None, step: float | None, tmp_path: Path
) -> None:
    path = tmp_path / "r.txt"
    path.write_text(columns(TIMES[:5], VALUES[:5]) + text if unit else text, encoding="utf-8")
    try:
        record = read_record(path, unit=unit, time_step=step)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(record.acceleration).all() and record.time_step > 0
