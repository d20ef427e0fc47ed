"""Bearings served by the protocol of `element genericClient`: answers, axes, clocks, failures, the command line."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import Array
from support.ends import BEARING, INTERFACE, LOAD, advance, port, swing
from support.generic_client import Client, serving

from msfp_gen import Auto, Effects, InputError, Motion, Scene, Solver, Top, TwoPort, load_scene
from msfp_gen.cli import main
from msfp_gen.embedding.server import Server, freedoms
from msfp_gen.scene.file.loader import scene_text

STEP = 0.01
RIG = Top.rig(LOAD, **{name: getattr(INTERFACE, name) for name in vars(INTERFACE)})
SCENE = Scene(BEARING, Motion.ramp(0.1, 1.0), RIG)


def motion(time: float, amplitude: float = 1.0) -> Array:
    """`swing` as a client gives it: displacements, rates and accelerations of all degrees of freedom, shape (3, 12)."""
    return (amplitude * swing(time)).transpose(1, 0, 2).reshape(3, 12)


def test_a_client_gets_the_forces_of_a_two_port():
    """Of two bearings that are served at once; trials that are not committed leave nothing behind."""
    expected = advance(port(), 0, 20, STEP).reshape(20, 12)
    with serving(port(), port()) as served:
        clients = [Client(each) for each in served.ports]
        for i in range(1, 21):
            for client in clients:
                client.trial(i * STEP, motion(i * STEP, 0.7))
                assert np.array_equal(client.trial(i * STEP, motion(i * STEP)), expected[i - 1])
                client.commit()
        for client in clients:
            client.end()
    assert served.failed == 0
    assert sorted(line.partition(": ")[2] for line in served.lines)[2:] == ["ended at t = 0.2 s"] * 2


def test_the_tangent_is_that_of_the_clients_method():
    """The factors of Newmark's method are found in two trials; damping and mass are in the tangent, or zero."""
    rate, acceleration = 2 / STEP, 4 / STEP**2
    reference = port()
    advance(reference, 0, 20, STEP)
    moved = motion(21 * STEP)
    change = 1e-5 * np.cos(np.arange(12))
    moved += np.outer([1.0, rate, acceleration], change)
    response = reference.trial(21 * STEP, *moved.reshape(3, 2, 6).transpose(1, 0, 2))
    with serving(port()) as served:
        client = Client(served.ports[0])
        stiff = client.matrix(12)
        for i in range(1, 21):
            client.trial(i * STEP, motion(i * STEP))
            client.commit()
        client.trial(21 * STEP, motion(21 * STEP))
        client.trial(21 * STEP, moved)
        found = client.matrix(13)
        assert not client.matrix(14).any() and not client.matrix(15).any()
        client.commit()
        assert np.array_equal(client.matrix(13), stiff)  # no time has passed
        client.end()
    expected = response.effective_stiffness(rate, acceleration)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()
    assert stiff[8, 8] == pytest.approx(INTERFACE.vertical_stiffness, rel=1e-5) and stiff[6, 6] > 0


def test_axes_of_clients():
    """Y up and the plane X-Y are the same bearing as Z up, rotated by a right-handed rotation."""
    y_up, plane = freedoms(12, "Y"), freedoms(6, "Z")
    assert np.array_equal(freedoms(12, "Z"), np.eye(12))
    assert np.linalg.det(y_up[:3, :3]) == pytest.approx(1.0)
    assert np.array_equal(y_up @ [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0], np.eye(12)[2] + np.eye(12)[11])
    assert np.array_equal(plane, y_up[:, [0, 1, 5, 6, 7, 11]])
    amplitude = np.zeros((2, 6))
    amplitude[1, [0, 2, 4]] = 0.03, 0.0004, 0.01  # in the plane E1-E3
    expected = advance(port(), 0, 20, STEP, amplitude).reshape(20, 12)[-1]
    for count, up, axes in ((6, "Z", plane), (12, "Y", y_up)):
        with serving(port(), up=up) as served:
            client = Client(served.ports[0], count)
            for i in range(1, 21):
                given = swing(i * STEP, amplitude).transpose(1, 0, 2).reshape(3, 12) @ axes
                force = client.trial(i * STEP, given)
                client.commit()
            client.end()
        assert force == pytest.approx(axes.T @ expected, rel=1e-12, abs=1e-9)


def test_a_clock_that_is_set_back_starts_at_zero():
    expected = advance(port(), 0, 20, STEP).reshape(20, 12)[-1]
    with serving(port()) as served:
        client = Client(served.ports[0])
        for i in range(1, 21):
            force = client.trial((i if i <= 10 else i - 10) * STEP, motion(i * STEP))
            client.commit()
        client.end()
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-6 * LOAD)


def test_a_failed_bearing_answers_nan_until_a_shorter_step_succeeds():
    with serving(port(), port()) as served:
        client, other = (Client(each) for each in served.ports)
        client.trial(STEP, motion(STEP))
        client.commit()
        lifted = motion(2 * STEP)
        lifted[0, 8] += 0.02  # more than the load
        assert np.isnan(client.trial(2 * STEP, lifted)).all() and np.isnan(client.matrix(13)).all()
        lifted[0] = np.nan  # a client goes on with what it was given
        assert np.isnan(client.trial(2 * STEP, lifted)).all()
        assert np.isfinite(client.trial(2 * STEP, motion(2 * STEP))).all()
        client.end()
        assert np.isfinite(other.trial(STEP, motion(STEP))).all()
        other.socket.close()  # without an end
    assert served.failed == 1
    failures = [line for line in served.lines if "two-port" in line]
    assert len(failures) == 1 and "uplift is not modelled" in failures[0]
    assert any("failed on the way" in line for line in served.lines)


@pytest.mark.parametrize(
    "sizes, word",
    [
        ([9, 9, 9, 0, 1, 0, 0, 0, 9, 0, 256], "9 degrees of freedom"),
        ([12, 12, 12, 0, 1, 0, 0, 0, 12, 0, 30], "an element genericClient of OpenSees sends others"),
        ([12, 12, 0, 0, 1, 0, 0, 0, 12, 0, 256], "an element genericClient of OpenSees sends others"),
        ([12, 12, 12, 0, 1, 0, 0, 0, 12, 0, 2**30], "an element genericClient of OpenSees sends others"),
        ([-12, -12, -12, 0, 1, 0, 0, 0, -12, 0, 256], "an element genericClient of OpenSees sends others"),
    ],
)
def test_another_client_is_refused(sizes: list[int], word: str):
    with serving(port()) as served:
        client = Client(served.ports[0], sizes=sizes)
        assert client.socket.recv(1) == b""
        client.socket.close()
    assert served.failed == 1 and word in served.lines[-1]


def test_an_unknown_message_ends_the_connection_alone():
    with serving(port(), count=2) as served:
        client = Client(served.ports[0])
        client.send(77)
        assert client.socket.recv(1) == b""
        client.socket.close()
        client = Client(served.ports[0])
        assert np.isfinite(client.ask(10)[:12]).all()
        client.end()
    assert served.failed == 1 and any("77" in line for line in served.lines)


def test_a_scene_with_a_rig_gives_its_two_port():
    found, expected = TwoPort.of_scene(SCENE), port()
    assert found.axial_load == LOAD and found.interface == INTERFACE and found.model.spec == expected.model.spec
    assert np.array_equal(advance(found, 0, 3, STEP), advance(expected, 0, 3, STEP))
    given = Scene(BEARING, SCENE.motion, RIG, Auto(uplift=True), Solver(rtol=1e-3))
    assert TwoPort.of_scene(given).model.effects == Effects(uplift=True, top_rotation=True)


@pytest.mark.parametrize(
    "name, word",
    [
        ("fenz-test2", "top.vertical_stiffness = 0"),
        ("ridgecrest-clc", "top.kind = 'mass': a two-port needs the interface of a rig"),
        ("fenz-monotonic", "stop: the ends of a two-port give motion and load"),
    ],
)
def test_other_scenes_are_refused(name: str, word: str):
    with pytest.raises(InputError, match=word):
        TwoPort.of_scene(load_scene(name))


def test_the_command_serves_and_ends(tmp_path: Path):
    (tmp_path / "scene.toml").write_text(scene_text(SCENE), encoding="utf-8")
    with socket.create_server(("127.0.0.1", 0)) as free:
        number = free.getsockname()[1]
    command = [sys.executable, "-m", "msfp_gen", "serve", "scene.toml", "--port", str(number), "--bearings", "1"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == f"serving scene.toml at 127.0.0.1:{number}\n"
        client = Client(number)
        force = client.trial(STEP, motion(STEP))
        client.commit()
        client.end()
        assert process.wait(60) == 0
        assert "bearing 1 (scene.toml): ended at t = 0.01 s" in process.stderr.read()
    assert np.array_equal(force, advance(port(), 0, 1, STEP).ravel())


@pytest.mark.parametrize(
    "options, word",
    [
        (["fenz-test2", "--port", "7000"], "top.vertical_stiffness = 0"),
        (["scene.toml", "--port", "x"], "'x' is not a whole number"),
        (["scene.toml", "--port", "0"], "--port = 0: give at least 1"),
        (["scene.toml", "--port", "99999"], "--port = 99999: give a port from 1 to 65535"),
        (["scene.toml", "--port", "7000", "--up", "X"], "--up = 'X': give one of Y, Z"),
        (["scene.toml", "--port", "7000", "--bearings", "0"], "--bearings = 0: give at least 1"),
        (["scene.toml", "--port", "7000", "--host", "192.0.2.1"], "192.0.2.1 does not let it be used"),
        (["nothing.toml", "--port", "7000"], "nothing.toml"),
    ],
)
def test_what_the_command_refuses(
    options: list[str], word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(scene_text(SCENE), encoding="utf-8")
    assert main(["serve", *options]) == 2
    output = capsys.readouterr()
    assert word in output.err and output.err.count("\n") == 1 and not output.out


def test_a_port_in_use_is_named():
    with socket.create_server(("127.0.0.1", 0)) as used:
        number = used.getsockname()[1]
        with pytest.raises(InputError, match=f"--port = {number}: 127.0.0.1 does not let it be used"):
            Server([("one", port)], number, report=[].append)
