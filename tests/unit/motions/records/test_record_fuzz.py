"""Damaged records: whatever is done to a file of any known format, it is a record of finite numbers or one clear line.

The readers come from the registry of `msfp_gen.motions.records`: a format that is added there needs a sample here.
"""

from __future__ import annotations

import gzip
import os
import random
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import record_writers as w
from support.damaged_records import (
    CSV,
    MUTATIONS,
    WAVES,
)

from msfp_gen.common.errors import InputError
from msfp_gen.motions import records
from msfp_gen.motions.records import csv_table, text
from msfp_gen.motions.records.record import Record

LABELS = ("90 Deg", "360 Deg", "Up")
SERIES = dict.fromkeys(("acceleration", "velocity", "displacement"), 0.1 * WAVES[0])
SAMPLES: dict[str, tuple[str, ...]] = {
    "CSMIP V1, V2": (
        w.csmip_v1(list(zip(LABELS, WAVES, strict=True))),
        w.csmip_v2([(label, SERIES) for label in LABELS]),
    ),
    "COSMOS V1, V2": ("".join(w.cosmos("acceleration", *each, 0.05) for each in zip(LABELS, WAVES, strict=True)),),
    "K-NET": (w.knet("E-W", WAVES[0]),),
    "PEER AT2, VT2, DT2": tuple(w.peer(WAVES[0], quantity=q) for q in SERIES),
    "CSV": (CSV, "time [s],u1 [mm]\n0,1\n1,2\n2,3\n3,1\n"),
}
ALL = [(form, number) for form, samples in SAMPLES.items() for number in range(len(samples))]


def outcome(path: Path, content: bytes) -> Record | str:
    """The record, checked, or the line; anything else fails the test."""
    path.write_bytes(content)
    begin = time.perf_counter()
    try:
        record = records.read_record(path)
    except InputError as error:
        message = str(error)
        assert message and message.isprintable() and len(message) <= 500, message
        assert path.name in message or message.startswith(("acceleration", "time_step")), message
        return message
    finally:
        assert time.perf_counter() - begin < 5.0
    assert np.isfinite(record.acceleration).all() and record.acceleration.shape[1:] == (3,)
    assert 0 < record.time_step < np.inf and len(record.acceleration) >= 4
    return record


def test_every_reader_has_a_sample_that_is_fine(tmp_path: Path) -> None:
    assert {form.name for form in records._FORMATS} | {"CSV"} == set(SAMPLES)
    for form, samples in SAMPLES.items():
        path = tmp_path / "record.txt"
        assert isinstance(outcome(path, samples[0].encode()), Record), (form, outcome(path, samples[0].encode()))
        for sample in samples:
            path.write_text(sample)
            lines = text.read_lines(path)
            owners = [each.name for each in records._FORMATS if each.matches(lines)]
            assert owners + ["CSV"] * csv_table.matches(lines) == [form], "one reader knows it, the others do not"


@pytest.mark.parametrize(("form", "number"), ALL)
def test_mutations(form: str, number: int, tmp_path: Path) -> None:
    """Seeded, so that a failure comes again: one to three changes to a good file, many times."""
    sample, path = SAMPLES[form][number].encode(), tmp_path / "record.txt"
    dice = random.Random(f"{form} {number}")
    refused = 0
    for _ in range(250):
        content = sample
        for _ in range(dice.randrange(1, 4)):
            content = dice.choice(MUTATIONS)(content, dice) or b"\n"
        refused += isinstance(outcome(path, content), str)
    assert refused > 60, "most damage is seen"


@pytest.mark.parametrize(("form", "number"), ALL)
def test_every_word_of_a_header_in_turn(form: str, number: int, tmp_path: Path) -> None:
    """Counts, steps, units, formats: each word of the header replaced by what it cannot be."""
    path = tmp_path / "record.txt"
    lines = SAMPLES[form][number].split("\n")
    refused = tried = 0
    for where in range(min(len(lines), 20)):
        for word in dict.fromkeys(lines[where].replace("=", " ").replace(",", " ").split()):
            for hostile in ("nan", "-1", "0", "99999999999", "1e999", ""):
                changed = lines[where].replace(word, hostile, 1)
                found = outcome(path, "\n".join([*lines[:where], changed, *lines[where + 1 :]]).encode())
                refused += isinstance(found, str)
                tried += 1
    assert 0 < refused < tried


@given(content=st.binary(max_size=300), form=st.sampled_from(ALL), keep=st.integers(0, 25))
@settings(max_examples=200, derandomize=True, deadline=None, suppress_health_check=list(HealthCheck))
def test_anything_after_a_good_beginning(content: bytes, form: tuple[str, int], keep: int, tmp_path: Path) -> None:
    head = "\n".join(SAMPLES[form[0]][form[1]].split("\n")[:keep]).encode()
    outcome(tmp_path / "record.txt", head + content)


# --- files that are no files


def test_a_bomb_of_gzip_is_refused_before_it_fills_the_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text, "_MAX_BYTES", 1 << 20)
    path = tmp_path / "bomb.gz"
    path.write_bytes(gzip.compress(b"0" * (8 << 20)))
    with pytest.raises(InputError, match=r"bomb\.gz: more than 1 MiB of text"):
        records.read_record(path)
    path.write_bytes(b"0" * (2 << 20))
    with pytest.raises(InputError, match="more than 1 MiB of text"):
        records.read_record(path)


def test_pipes_devices_and_folders_are_not_opened(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero"), tmp_path):
        with pytest.raises(InputError, match="no file but a folder, pipe or device"):
            records.read_record(path)
    for name in ("gone.at2", "a" * 300, "nul\0byte"):
        with pytest.raises(InputError, match="cannot be read"):
            records.read_record(tmp_path / name)
