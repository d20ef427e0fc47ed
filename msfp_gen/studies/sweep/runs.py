"""The runs of a sweep, each handed over as it ends, so that none has to stay in memory."""

from __future__ import annotations

import threading
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TYPE_CHECKING

from msfp_gen.buildings.result import BuildingResult
from msfp_gen.common.cores import usable_cores
from msfp_gen.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.result import Result
from msfp_gen.simulation.batch import check_method, specs_of
from msfp_gen.simulation.run_any import simulate

if TYPE_CHECKING:
    from msfp_gen.buildings.load import AnyScene


def completed_runs(
    scenes: Sequence[AnyScene], workers: int | None = None
) -> Generator[tuple[int, Result | BuildingResult], None, None]:
    """Run scenes at the same time, in threads; yields (index, result) in the order in which the runs end.

    Every result is that of `simulate`; that of a failed run has its rows until then. Closing the iterator, or an
    exception in its consumer (use `contextlib.closing`), ends the other runs. workers: number of runs at the same time;
    None: one for each core. Raises InputError before the first run: an invalid number of workers, or a method that does
    not support the effects of a scene; RunError: a scene has no rows at all.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers = {workers!r}: give a whole number of runs at the same time, 1 or more")
    for scene in scenes:
        try:
            check_method(scene)
        except InputError as error:
            raise InputError(f"{scene.name}: {error}") from error
    for spec in dict.fromkeys(spec for scene in scenes for spec in specs_of(scene)):
        build_model(spec.layout, spec.effects)
    return _completed(scenes, workers or usable_cores())


def _completed(scenes: Sequence[AnyScene], workers: int) -> Generator[tuple[int, Result | BuildingResult], None, None]:
    stop = threading.Event()
    pool = ThreadPoolExecutor(workers, "msfp-gen-sweep")
    try:
        # Long runs start first, so that all workers end at about the same time.
        order = sorted(range(len(scenes)), key=lambda index: -scenes[index].end)
        indices = {pool.submit(_result_of, scenes[index], stop): index for index in order}
        for future in as_completed(list(indices)):
            yield indices.pop(future), future.result()
            del future  # holds the result
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


class _StoppedError(Exception):
    """Ends a run in a worker after the sweep has ended."""


def _result_of(scene: AnyScene, stop: threading.Event) -> Result | BuildingResult:
    def proceed(_: float, __: float) -> None:
        if stop.is_set():
            raise _StoppedError

    try:
        return simulate(scene, progress=proceed)
    except RunError as error:
        if isinstance(error.result, Result | BuildingResult):
            return error.result
        raise RunError(f"{scene.name}: {error}", status=error.status) from error
