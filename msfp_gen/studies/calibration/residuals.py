"""Residuals of a fit and their exact Jacobian: one run with gradients for each test."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.motions.motion import Motion
from msfp_gen.simulation.gradients import UNDAMPED, undamped_surfaces
from msfp_gen.simulation.simulate import simulate
from msfp_gen.studies.calibration.measurement import Measurement
from msfp_gen.studies.calibration.unknowns import Unknown, changed_scene

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

Progress = Callable[[int, float, float], None]  # number of the evaluation, its share done, last deviation [N]
FAILED = 10.0  # residual of a run that failed, over the largest force: worse than any run, so that the step is refused


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Runs of all tests at one set of values.

    residuals: weighted, over the largest force of all tests, shape (N,). jacobian: with respect to the unknowns over
    their scales, shape (N, k). forces: of the runs, one array for each test [N]. failure: of a run that failed.
    """

    residuals: Array
    jacobian: Array
    forces: tuple[Array, ...] = ()
    failure: RunError | InputError | None = None


@dataclass(eq=False)
class Residuals:
    """Residuals as a function of the unknowns, over their scales.

    tests: sampled. scenes: one for each test. scale: of each unknown. with_offset: whether each test has an offset of
    its force, as a last unknown. largest: force by which residuals are divided [N].
    """

    tests: tuple[Measurement, ...]
    scenes: tuple[Scene, ...]
    unknowns: tuple[Unknown, ...]
    with_offset: bool
    progress: Progress | None = None
    count: int = 0
    deviation: float = np.nan
    _known: dict[bytes, Evaluation] = field(default_factory=dict)

    @property
    def largest(self) -> float:
        """Largest force of all tests [N]."""
        return float(max(np.abs(test.force).max() for test in self.tests))

    @property
    def scale(self) -> Array:
        """Unit of each unknown: its value at the start, the largest force for offsets."""
        values = [abs(u.start) or max(abs(u.low), abs(u.high)) for u in self.unknowns]
        return np.array(values + [self.largest] * self.offsets)

    @property
    def offsets(self) -> int:
        """Number of offsets."""
        return len(self.tests) if self.with_offset else 0

    def at(self, x: Array) -> Evaluation:
        """The evaluation at x; the last one is kept, since an optimiser asks for its Jacobian afterwards."""
        key = x.tobytes()
        if key not in self._known:
            self.count += 1
            found = self._evaluate(x * self.scale)
            self._known = {key: found}
            if found.failure is None:
                self.deviation = float(np.sqrt(np.mean(found.residuals**2))) * self.largest
        return self._known[key]

    def _evaluate(self, values: Array) -> Evaluation:
        forces, residuals, blocks, size = [], [], [], len(self.unknowns)
        for index, (test, scene) in enumerate(zip(self.tests, self.scenes, strict=True)):
            try:
                force, slopes = self._run(test, changed_scene(scene, self.unknowns, values[:size]), index)
            except (RunError, InputError) as error:
                rows = sum(len(each.time) for each in self.tests)
                return Evaluation(np.full(rows, FAILED), np.zeros((rows, len(values))), (), error)
            shift = np.zeros((len(force), self.offsets))
            if self.with_offset:
                force = force + values[size + index]
                shift[:, index] = 1.0
            forces.append(force)
            residuals.append(test.weight * (force - test.force) / self.largest)
            blocks.append(test.weight * np.column_stack([slopes, shift]) * self.scale / self.largest)
        return Evaluation(np.concatenate(residuals), np.concatenate(blocks), tuple(forces))

    def _run(self, test: Measurement, scene: Scene, index: int) -> tuple[Array, Array]:
        """Force of a run at the times of a test, shape (T,), and its derivatives, shape (T, k)."""
        paths = [member.path for unknown in self.unknowns for member in unknown.members]

        def show(time: float, end: float) -> None:
            assert self.progress is not None
            self.progress(self.count, (index + time / end) / len(self.tests), self.deviation)

        if self.progress is not None:
            show(0.0, 1.0)  # a short run does not report by itself
        result = simulate(scene, gradients=paths, progress=None if self.progress is None else show)
        assert result.gradients is not None
        time, at = result.history.time, test.time - test.time[0]
        columns = dict(zip(paths, result.gradients.rows["top_force"][:, :, 0], strict=True))
        slopes = [sum(columns[member.path] for member in unknown.members) for unknown in self.unknowns]
        return (
            np.interp(at, time, result.history.top_force[:, 0]),
            np.column_stack([np.interp(at, time, np.asarray(slope)) for slope in slopes]),
        )


def scenes_of(scene: Scene, tests: Sequence[Measurement]) -> tuple[Scene, ...]:
    """The scene under the displacement of each test, along E1 from the centre, with the effects fixed.

    Raises InputError for a scene that is no test rig, or whose runs have no gradients.
    """
    if scene.top.kind != "rig":
        raise InputError(f'top.kind = "{scene.top.kind}": a test holds the top plate; give a scene with a rig')
    return tuple(_test_scene(scene, test) for test in tests)


def _test_scene(scene: Scene, test: Measurement) -> Scene:
    zeros = np.zeros(len(test.time))
    path = np.column_stack([test.displacement - test.displacement[0], zeros, zeros])
    motion = Motion.from_arrays(test.time - test.time[0], path, name=test.name)
    made = replace(
        scene,
        name=test.name,
        motion=motion,
        motion_table=None,
        duration=None,
        stop=None,
        output_step=motion.duration / (len(test.time) - 1),
        top=scene.top if test.axial_load is None else replace(scene.top, axial_load=test.axial_load),  # type: ignore[call-arg]
    )
    made = replace(made, effects=made.modelled)  # so that no evaluation selects others
    for surface in undamped_surfaces(made, made.modelled)[:1]:
        raise InputError(UNDAMPED.format(surface=surface))
    return made
