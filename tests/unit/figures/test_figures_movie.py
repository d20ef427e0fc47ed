"""Movies: frames, what they show, and what is refused before anything is written."""

from __future__ import annotations

import shutil
from itertools import pairwise

import numpy as np
import pytest
from support import preset_run
from support.films import drawn_twice

from msfp_gen.common.errors import InputError
from msfp_gen.figures import animate, movie
from msfp_gen.figures.style import COLOURS, FAINT, INK, page

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
    assert frames[0].shape[1] == 800 and frames[0].shape[0] % 2 == 0
    assert all(np.abs(one - other).max() > 100 for one, other in pairwise(frames))
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert list(tmp_path.iterdir()) == [path]


def test_a_gif_keeps_the_colours_of_the_figures(tmp_path):
    """The palette is the first frame's: in no frame a colour of the figures is off by more than 2 of 255."""
    from matplotlib.colors import to_rgb
    from PIL import Image

    shown = movie.stack_film(preset_run("fenz-test5"), np.linspace(40, 100, 3), None)
    with page(10.0, shown.height) as figure:
        drawn = [picture[..., :3].astype(int) for picture in movie.pictures(figure, shown, None)]
    movie._write_gif((picture.astype(np.uint8) for picture in drawn), tmp_path / "m.gif", 6)
    with Image.open(tmp_path / "m.gif") as images:
        for index, picture in enumerate(drawn):
            images.seek(index)
            off = np.abs(np.asarray(images.convert("RGB"), dtype=int) - picture).max(axis=-1)
            for colour in (*COLOURS[:4], INK, FAINT):  # four surfaces
                there = (picture == np.round(255 * np.array(to_rgb(colour)))).all(axis=-1)
                assert there.sum() > 50 and off[there].max() <= 2, (index, colour)


def test_a_frame_is_what_a_complete_drawing_shows():
    """Moving artists over a copy of what stands still gives every pixel that drawing all of them gives."""
    shown = movie.stack_film(preset_run("fenz-test5"), np.array([40.0, 100.0, 150.0]), None)
    drawn = drawn_twice(shown, 10.0, 5.5)
    assert drawn.differs < 2e-3  # curves overlap the frame of their axes
    assert {artist.axes for artist in drawn.moving if artist.axes is not None} == set(drawn.figure.axes)


def test_the_section_spans_the_movie():
    """No half of the picture is white: bodies cover most columns of the upper part."""
    shown = movie.stack_film(preset_run("fenz-test5"), np.linspace(0, 300, 7), None)
    with page(10.0, shown.height) as figure:
        pictures = np.array(list(movie.pictures(figure, shown, None)))[..., :3]
    height = pictures.shape[1]
    drawn = (pictures.min(axis=(0, 3)) < 235)[round(0.25 * height) : round(0.5 * height)]
    assert drawn.any(axis=0).mean() > 0.8


def test_what_stands_still_is_drawn_once(tmp_path, monkeypatch):
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    drawn, draw = [], FigureCanvasAgg.draw
    monkeypatch.setattr(FigureCanvasAgg, "draw", lambda canvas: drawn.append(canvas) or draw(canvas))
    animate(preset_run("fenz-test5"), tmp_path / "m.gif", **SHORT)
    assert len(drawn) == 1


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
