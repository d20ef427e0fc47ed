"""Movies: frames, what they show, and what is refused before anything is written."""

from __future__ import annotations

import shutil
from itertools import pairwise

import numpy as np
import pytest
from support import preset_run

from msfp_gen.errors import InputError
from msfp_gen.figures import animate

SHORT = {"seconds": 0.5, "frames_per_second": 6}


def test_gif_has_its_frames_and_they_move(tmp_path):
    from PIL import Image

    path, told = tmp_path / "m.gif", []
    animate(preset_run("fenz-test5"), path, **SHORT, start=40.0, end=80.0, progress=lambda *at: told.append(at))
    with Image.open(path) as movie:
        assert movie.n_frames == 3
        frames = []
        for index in range(3):
            movie.seek(index)
            frames.append(np.asarray(movie.convert("RGB"), dtype=int))
    assert frames[0].shape == (400, 800, 3)
    assert all(np.abs(one - other).max() > 100 for one, other in pairwise(frames))
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_mp4_by_ffmpeg(tmp_path):
    path = tmp_path / "m.mp4"
    animate(preset_run("becker-circle-125"), path, **SHORT)
    assert path.read_bytes()[4:8] == b"ftyp"
    assert list(tmp_path.iterdir()) == [path]


def test_mp4_without_ffmpeg_names_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"m\.mp4'?: \.mp4 needs ffmpeg, .*; install it or give \.gif"):
        animate(preset_run("fenz-test5"), tmp_path / "m.mp4", **SHORT)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"end": 999.0}, "time = 999 s"),
        ({"start": 50.0, "end": 40.0}, "start = 50 s: give a time before the end"),
        ({"seconds": 0.0}, "seconds"),
        ({"frames_per_second": 0}, "frames_per_second = 0"),
    ],
    ids=str,
)
def test_bad_options_leave_no_file(options, reason, tmp_path):
    with pytest.raises(InputError, match=reason):
        animate(preset_run("fenz-test5"), tmp_path / "m.gif", **SHORT | options)
    assert not list(tmp_path.iterdir())


def test_other_suffixes_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"give a name that ends in \.gif or \.mp4"):
        animate(preset_run("fenz-test5"), tmp_path / "m.avi")
