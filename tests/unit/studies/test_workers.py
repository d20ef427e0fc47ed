"""Workers of this machine: threads or processes by measurement, pools that live on, scripts without a guard."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from msfp_gen import InputError, RunError, load_scene, simulate_batch
from msfp_gen.studies import workers as module
from msfp_gen.studies.workers import Way, Ways, Workers, end_idle, local_pool

# Calls as text, for `eval` in a process that imports nothing for them.
PID = "__import__('os').getpid()"
SPIN = f"(sum(x for x in range(600_000)), {PID})[1]"  # tens of milliseconds with the global lock
FAIL = "1 // 0"
DIE = f"__import__('os').kill({PID}, 9)"
THREADS = "__import__('threading')"
STUCK = f"{PID} if {THREADS}.main_thread() is not {THREADS}.current_thread() else {THREADS}.Lock()"
TELL = """
import time
from msfp_gen.studies.workers import proceed
for number in range(1, 11):
    time.sleep(SECONDS / 10)
    proceed(float(number), 10.0)
"""


def all_of(function: Any, calls: list[Any], workers: int = 2, ways: Ways | None = None) -> list[Any]:
    """Values in the order of the calls."""
    with local_pool(workers, ways) as pool:
        found = dict(pool.results(function, ((index, (call,)) for index, call in enumerate(calls))))
    return [found[index] for index in range(len(calls))]


def test_the_faster_way_is_kept() -> None:
    workers = Workers(2)
    workers._waited = 2 * module.START
    slow, fast = Way(100, 4.0, 2.0), Way(100, 3.0, 2.5)
    assert workers.in_process(Ways(slow, fast)) and not workers.in_process(Ways(fast, slow))
    assert workers.in_process(Ways(fast, Way())) and workers.in_process(Ways(fast, Way(3, 9.0, 1.0))), "tried first"
    assert not workers.in_process(Ways(Way(3, 9.0, 0.1), Way())), "threads are measured before"
    assert not workers.in_process(Ways(Way(100, 2.2, 2.0), Way())), "there is too little to gain"
    workers._waited = 0.5 * module.START
    assert not workers.in_process(Ways(slow, fast)), "their start would cost more than they save"
    workers.shutdown()
    assert not Workers(1).in_process(Ways(slow, fast)), "one worker waits for nobody"


def test_calls_that_wait_for_each_other_go_to_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "START", 0.05)
    monkeypatch.setattr(module, "TRIED", (2, 0.0))
    ways = Ways()
    pids = all_of(eval, [SPIN] * 60, workers=3, ways=ways)
    assert pids[0] == os.getpid() and pids[-1] != os.getpid()
    assert not ways.processes.calls or len(set(pids)) == 4, "measured when all have started"


def test_short_work_stays_in_threads() -> None:
    assert set(all_of(eval, [SPIN] * 4)) == {os.getpid()}


def test_pools_live_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "in_process", lambda *_: True)
    first: set[int] = set()
    while len(first) < 2:  # a process that starts later answers later
        first |= set(all_of(eval, [PID] * 8))
    threads = threading.active_count()
    assert set(all_of(eval, [PID] * 8)) <= first and os.getpid() not in first
    assert threading.active_count() == threads
    with pytest.raises(ZeroDivisionError, match="division") as caught:
        all_of(eval, [PID, FAIL, PID, PID])
    assert "<string>" in str(caught.value.__cause__), "where in the process"
    assert not set(all_of(eval, [PID] * 8)) & first, "after an error other workers"


def test_a_process_that_dies_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "in_process", lambda *_: True)
    with pytest.raises(RunError, match=r"workers died \(workers: TerminatedWorkerError\); check their memory"):
        all_of(eval, [DIE] * 4)


def test_what_cannot_travel_runs_in_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "in_process", lambda self, _: self._suited)
    here = threading.Lock()
    assert all_of(lambda lock: (lock is here, os.getpid()), [here] * 4) == [(True, os.getpid())] * 4
    assert all_of(eval, [STUCK] * 4) == [os.getpid()] * 4


ROWS = f"__import__('numpy').full(({module.LARGE // 8}, 2), 0.25)"


@pytest.mark.skipif(not module.MEMORY.is_dir(), reason="no files in memory")
def test_large_arrays_come_in_files_in_memory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """They are equal, may be changed, and leave no file behind, nor a folder when workers end."""
    end_idle()
    monkeypatch.setattr(module, "MEMORY", tmp_path)
    monkeypatch.setattr(Workers, "in_process", lambda *_: True)
    mapped: list[Path] = []
    take = module._content
    monkeypatch.setattr(module, "_content", lambda path: (mapped.append(path), take(path))[1])
    for found in all_of(eval, [ROWS] * 4):
        assert found.shape == (module.LARGE // 8, 2) and (found == 0.25).all()
        found[0, 0] = 1.0
    assert len(mapped) == 4
    (folder,) = tmp_path.iterdir()
    assert not list(folder.iterdir())
    end_idle()
    assert not folder.exists()


def test_large_arrays_come_as_bytes_where_there_is_no_room(tmp_path: Path) -> None:
    value = {"rows": np.zeros(module.LARGE), "few": np.ones(3)}
    for folder in (None, str(tmp_path / "gone")):
        content, files = module._packed(value, (), folder)
        assert not files and len(content) > 8 * module.LARGE
        assert module._Unpickler(io.BytesIO(content), (), []).load()["few"].tolist() == [1.0] * 3


@pytest.mark.parametrize("processes", [False, True])
def test_progress_of_calls_is_told(processes: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "in_process", lambda *_: processes)
    told: list[tuple[str, float]] = []
    with local_pool(2) as pool:
        calls = ((key, (TELL.replace("SECONDS", "1.5"),)) for key in "ab")
        keys = [key for key, _ in pool.results(exec, calls, lambda key: lambda x, end: told.append((key, x / end)))]
    assert sorted(keys) == ["a", "b"]
    for key in "ab":
        shares = [share for name, share in told if name == key]
        assert shares and shares == sorted(shares) and shares[-1] == 1.0 and (processes or len(shares) == 10)


@pytest.mark.parametrize("processes", [False, True])
def test_an_error_ends_the_calls_that_run(processes: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Workers, "in_process", lambda *_: processes)
    begin = time.perf_counter()
    with pytest.raises(IndexError), local_pool(2) as pool:
        calls = ((index, (TELL.replace("SECONDS", "20.0" if index else "0.1"),)) for index in range(4))
        for _ in pool.results(exec, calls):
            raise IndexError
    assert time.perf_counter() - begin < 15.0


SCRIPT = """
import os
from msfp_gen import load_scene, simulate_batch
from msfp_gen.studies.workers import Workers
Workers.in_process = lambda self, _: self._suited
print("script", flush=True)
results = simulate_batch([load_scene("fenz-test1")] * 6, workers=2)
print(len({id(each.scene) for each in results}), {each.status for each in results}, flush=True)

from msfp_gen.studies.workers import local_pool
class Mine:
    pass
def pid(mine):
    return os.getpid(), type(mine) is Mine
with local_pool(2) as pool:
    found = dict(pool.results(pid, ((i, (Mine(),)) for i in range(4))))
    print({(process != os.getpid(), mine) for process, mine in found.values()})
"""


def test_a_script_needs_no_guard(tmp_path: Path) -> None:
    """It runs once, and what only the script defines goes to processes too."""
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    command = [sys.executable, str(tmp_path / "script.py")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["script", "1 {'ok'}", "{(True, True)}"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_workers_do_not_hang_after_a_fork(tmp_path: Path) -> None:
    """A fork has no threads of the workers of its parent: it makes its own."""
    program = (
        "import os, sys\n"
        "from msfp_gen import load_scene, simulate_batch\n"
        "run = lambda: len(simulate_batch([load_scene('fenz-test1')] * 4, workers=2))\n"
        "run()\n"
        "child = os.fork()\n"
        "if not child:\n"
        "    os._exit(run())\n"
        "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout == "4\n", done.stderr


def test_a_wrong_number_of_workers_is_named() -> None:
    with pytest.raises(InputError, match="workers = 0"):
        simulate_batch([load_scene("fenz-test1")], workers=0)
