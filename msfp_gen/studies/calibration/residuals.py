"""The unknowns of a fit, and the residuals of its tests with their exact Jacobian.

Values of the unknowns come in; a pool runs the scene of every test; weighted differences of force and their derivatives
go out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.aliases import FitProgress
from msfp_gen.common.arrays import Array
from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.parameters import Parameter, changed_parameters, parameters_of
from msfp_gen.simulation.gradients import UNDAMPED, undamped_surfaces
from msfp_gen.simulation.simulate import simulate
from msfp_gen.studies.calibration.intervals import SINGULAR
from msfp_gen.studies.calibration.measurement import Measurement
from msfp_gen.studies.workers import SharedProgress, Ways, local_pool, proceed

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

RANGE = 10.0  # default bounds: the value at the start, divided and multiplied by this
_OF_THE_TEST = {
    "motion": "the tests give the motion",
    "load": "the tests have no load history",
    "initial_state": "a test starts at the centre of the bearing",
}
ForceOrError = (
    tuple[Array, Array] | RunError | InputError
)  # force and its derivatives at the times of a test, or the error
TRAVEL = 1.5  # peak displacement of a test over the sum of all capacities, at most
RATIOS = 1e-3, 5.0  # peak force of a test over the axial load, at least and at most
FAILED = 10.0  # residual of a failed run, over the largest force: worse than any run, so that the step is refused


@dataclass(frozen=True)
class Unknown:
    """One value to be fitted.

    Attributes:
        name: path of the parameter; of tied parameters all paths, separated by `=`.
        members: the parameters that have this value.
        low, high: bounds [`unit`].
    """

    name: str
    members: tuple[Parameter, ...]
    low: float
    high: float

    @property
    def start(self) -> float:
        """Value at the start of the fit [`unit`]."""
        return self.members[0].value

    @property
    def unit(self) -> str:
        """SI unit of the value."""
        return self.members[0].unit


def unknowns_of(
    scene: Scene, paths: Sequence[str], bounds: Mapping[str, tuple[float, float]] | None = None
) -> tuple[Unknown, ...]:
    """The unknowns at some paths; `A=B` is one unknown for both. Raises InputError that names the path.

    bounds: path, as given or of one parameter -> (low, high) [SI].
    """
    if isinstance(paths, str) or not paths:
        raise InputError(f"parameters = {paths!r}: give a list of paths, such as ['bearing.surfaces[*].friction']")
    unused, unknowns = {_full_path(path): limits for path, limits in (bounds or {}).items()}, []
    for path in map(_full_path, paths):
        tied = path.split("=")
        members = [parameters_of(scene, [part], "parameters") for part in tied]
        groups = [(p,) for p in members[0]] if len(tied) == 1 else [tuple(p for m in members for p in m)]
        limits = unused.pop(path, None)
        for group in groups:
            name = "=".join(parameter.path for parameter in group)
            unknowns.append(_unknown(name, group, unused.pop(name, limits)))
    if unused:
        raise InputError(f"bounds: {next(iter(unused))!r} is no parameter of this fit; give one of its paths")
    fitted = [member for unknown in unknowns for member in unknown.members]
    names = [member.path for member in fitted]
    for member in fitted:
        if names.count(member.path) > 1:
            raise InputError(f"parameters = {member.path!r}: given twice; give each parameter once")
        if member.part in _OF_THE_TEST:
            raise InputError(f"parameters = {member.path!r}: {_OF_THE_TEST[member.part]}; leave it out")
    return tuple(unknowns)


def scene_at(scene: Scene, unknowns: Sequence[Unknown], values: Array) -> Scene:
    """The scene with values of the unknowns, shape (k,). Raises InputError where a field does not accept its value."""
    pairs = zip(unknowns, values, strict=True)
    return changed_parameters(scene, {p: float(value) for unknown, value in pairs for p in unknown.members})


def _full_path(path: str) -> str:
    """A path, or tied paths, with `bearing.` before a path without a table, such as `friction[0]`."""
    parts = [part.strip() for part in str(path).split("=")]
    return "=".join(part if "." in part else f"bearing.{part}" for part in parts)


def _unknown(name: str, members: tuple[Parameter, ...], limits: tuple[float, float] | None) -> Unknown:
    first = members[0]
    if len({(member.unit, member.field) for member in members}) > 1:
        raise InputError(f"parameters = {name!r}: different quantities cannot have one value; give them apart")
    if limits is None:
        if first.value == 0:
            raise InputError(f"parameters = {name!r}: it is 0 in the scene, which gives no range; give bounds for it")
        ends = first.value / RANGE, first.value * RANGE
        limits = min(ends), max(ends)
    low, high = map(float, limits)
    if not low < high or not np.isfinite([low, high]).all():
        raise InputError(f"bounds of {name} = {low:g}, {high:g}: give a lower bound below an upper one")
    if (first.least is not None and low < first.least) or (first.above is not None and low <= first.above):
        least = f"at least {first.least:g}" if first.least is not None else f"more than {first.above:g}"
        raise InputError(f"bounds of {name} = {low:g}, {high:g}: this field is {least}; raise the lower bound")
    if not low < first.value < high:
        raise InputError(f"bounds of {name} = {low:g}, {high:g}: the scene has {first.value:g}; start between them")
    return Unknown(name, members, low, high)


@dataclass(frozen=True, eq=False)
class EvaluatedResiduals:
    """Runs of all tests at one set of values.

    residuals: weighted, over the largest force of all tests, shape (N,) [-]. jacobian: with respect to the unknowns
    over their scales, shape (N, k) [-]. forces: of each run at the times of its test, shape (T,) [N]. failure: of a run
    that failed.
    """

    residuals: Array
    jacobian: Array
    forces: tuple[Array, ...] = ()
    failure: RunError | InputError | None = None

    @property
    def square(self) -> float:
        """Sum of the squares of the residuals."""
        return float(self.residuals @ self.residuals)

    @property
    def variance(self) -> float:
        """Variance of the residuals: sum of squares over rows less unknowns [-]."""
        rows, unknowns = self.jacobian.shape
        return self.square / float(max(rows - unknowns, 1))

    def step(self, free: NDArray[np.bool_]) -> Array:
        """Step of the free unknowns to the minimum of the linearised sum of squares, shape (k,) [-]."""
        step = np.zeros(len(free))
        step[free] = np.linalg.lstsq(self.jacobian[:, free], -self.residuals, rcond=1 / SINGULAR)[0]
        return step

    def step_in_errors(self, step: Array) -> float:
        """Length of a step of the unknowns, shape (k,), in standard errors (Bates and Watts 1981) [-]."""
        length, error = float(np.linalg.norm(self.jacobian @ step)), float(np.sqrt(len(step) * self.variance))
        return length / error if error else np.inf if length else 0.0


@dataclass(eq=False)
class Residuals:
    """Residuals of the tests as a function of the unknowns over their scales.

    tests: sampled. scenes: one for each test. unknowns: without offsets. with_offset: whether the offset of force of
    each test is a further unknown. progress: see `fit`. count: number of evaluations. deviation: of the last
    evaluation [N].
    """

    tests: tuple[Measurement, ...]
    scenes: tuple[Scene, ...]
    unknowns: tuple[Unknown, ...]
    with_offset: bool
    progress: FitProgress | None = None
    count: int = 0
    deviation: float = np.nan
    _last: tuple[bytes, EvaluatedResiduals] | None = None
    _ways: Ways = field(default_factory=Ways)

    @property
    def names(self) -> list[str]:
        """Names of the unknowns, then of the offsets."""
        return [u.name for u in self.unknowns] + [f"offset of {test.name}" for test in self.tests[: self.offsets]]

    @property
    def rtol(self) -> float:
        """Relative tolerance of the runs [-]."""
        return self.scenes[0].solver.rtol

    def tighten(self, factor: float) -> None:
        """Divide the tolerances of later runs by a factor."""
        self.scenes = tuple(replace(scene, solver=scene.solver.tightened(factor)) for scene in self.scenes)
        self._last = None

    @property
    def largest(self) -> float:
        """Largest force of all tests, by which residuals are divided [N]."""
        return float(max(np.abs(test.force).max() for test in self.tests))

    @property
    def scale(self) -> Array:
        """Scale of each unknown, shape (k,) [its unit]: its value at the start, or the largest force for an offset."""
        values = [abs(u.start) or max(abs(u.low), abs(u.high)) for u in self.unknowns]
        return np.array(values + [self.largest] * self.offsets)

    @property
    def offsets(self) -> int:
        """Number of offsets."""
        return len(self.tests) if self.with_offset else 0

    def at(self, x: Array) -> EvaluatedResiduals:
        """The evaluation at x. The last evaluation is cached, since an optimiser asks for its Jacobian afterwards."""
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self.evaluate(x)
        return self._last[1]

    def evaluate(self, x: Array, jacobian: Array | None = None) -> EvaluatedResiduals:
        """Run all tests at x. A given Jacobian, shape (N, k), is taken as it is, and the runs have no derivatives."""
        self.count += 1
        evaluation = self._evaluate(x * self.scale, jacobian)
        if evaluation.failure is None:
            self.deviation = float(np.sqrt(np.mean(evaluation.residuals**2))) * self.largest
        return evaluation

    def split(self, rows: Array) -> list[Array]:
        """Rows of all tests, shape (N, ...), split into the rows of each test, shape (T, ...) [unit of `rows`]."""
        return np.split(rows, np.cumsum([len(test.time) for test in self.tests])[:-1])

    def _evaluate(self, values: Array, jacobian: Array | None) -> EvaluatedResiduals:
        size, forces, residuals, blocks = len(self.unknowns), [], [], []
        for index, (test, run) in enumerate(zip(self.tests, self._runs(values[:size], jacobian is None), strict=True)):
            if isinstance(run, RunError | InputError):
                rows = sum(len(other.time) for other in self.tests)
                return EvaluatedResiduals(np.full(rows, FAILED), np.zeros((rows, len(values))), (), run)
            force, slopes = run
            shift = np.zeros((len(force), self.offsets))
            if self.with_offset:
                force = force + values[size + index]
                shift[:, index] = 1.0
            forces.append(force)
            residuals.append(test.weight * (force - test.force) / self.largest)
            if jacobian is None:
                blocks.append(test.weight * np.column_stack([slopes, shift]) * self.scale / self.largest)
        jacobian = np.concatenate(blocks) if jacobian is None else jacobian
        return EvaluatedResiduals(np.concatenate(residuals), jacobian, tuple(forces))

    def _runs(self, values: Array, slopes: bool) -> list[ForceOrError]:
        """Run all tests at the same time; a run that fails gives its error. slopes: whether with derivatives."""
        for spec in dict.fromkeys(scene.spec for scene in self.scenes):
            build_model(spec.layout, spec.effects, gradients=slopes)
        shared = SharedProgress(len(self.tests), self._report)
        tests = enumerate(zip(self.tests, self.scenes, strict=True))
        calls = ((index, (test, scene, self.unknowns, values, slopes)) for index, (test, scene) in tests)
        self._report(0.0, 1.0)  # a short run does not report by itself
        with local_pool(min(len(self.tests), usable_cores()), self._ways) as pool:
            runs = dict(pool.results(_run, calls, shared.of))
        return [runs[index] for index in range(len(self.tests))]

    def _report(self, share: float, _: float) -> None:
        if self.progress is not None:
            self.progress(self.count, share, self.deviation)


def _run(test: Measurement, scene: Scene, unknowns: Sequence[Unknown], values: Array, slopes: bool) -> ForceOrError:
    """Force of a run at the times of its test, shape (T,) [N], and its derivatives, shape (T, k) or (T, 0)."""
    paths = [member.path for unknown in unknowns for member in unknown.members]
    try:
        result = simulate(
            scene_at(scene, unknowns, values),
            gradients=paths if slopes else (),
            gradient_errors=False,
            progress=proceed,
        )
    except (RunError, InputError) as error:
        return error
    time, at = result.history.time, test.time - test.time[0]
    force = np.interp(at, time, result.history.top_force[:, 0])
    if result.gradients is None:
        return force, np.zeros((len(at), 0))
    rows = dict(zip(paths, result.gradients.arrays["top_force"][:, :, 0], strict=True))
    columns = [sum(rows[member.path] for member in unknown.members) for unknown in unknowns]
    return force, np.column_stack([np.interp(at, time, np.asarray(column)) for column in columns])


def scenes_of(scene: Scene, tests: Sequence[Measurement]) -> tuple[Scene, ...]:
    """The scene of each test: the displacement of the test along E1 from the centre, and fixed effects.

    Raises InputError for a scene without a test rig, or whose runs have no gradients.
    """
    if scene.top.kind != "rig":
        raise InputError(f'top.kind = "{scene.top.kind}": a test holds the top plate; give a scene with a rig')
    return tuple(_test_scene(scene, test) for test in tests)


def _check_size(scene: Scene, test: Measurement) -> None:
    """Raise InputError where displacement or force of a test do not fit the bearing, as with a wrong unit."""
    travel = sum(surface.capacity for surface in scene.bearing.surfaces)
    largest, ratio = np.abs(test.displacement).max(), np.abs(test.force).max() / scene.top.axial_load  # type: ignore[attr-defined]
    if largest > TRAVEL * travel:
        raise InputError(
            f"{test.name}: displacement reaches {largest:.4g} m, and the surfaces slide by {travel:.4g} m at "
            "most; check its unit and the bearing"
        )
    if not RATIOS[0] < ratio < RATIOS[1]:
        raise InputError(
            f"{test.name}: force reaches {ratio:.3g} of the axial load; check the unit of the force, and the load"
        )


def _test_scene(scene: Scene, test: Measurement) -> Scene:
    zeros = np.zeros(len(test.time))
    path = np.column_stack([test.displacement - test.displacement[0], zeros, zeros])
    motion = Motion.from_arrays(test.time - test.time[0], path, name=test.name)
    test_scene = replace(
        scene,
        name=test.name,
        motion=motion,
        motion_table=None,
        duration=None,
        stop=None,
        output_step=motion.duration / (len(test.time) - 1),
        top=scene.top if test.axial_load is None else replace(scene.top, axial_load=test.axial_load),  # type: ignore[call-arg]
    )
    _check_size(test_scene, test)
    test_scene = replace(test_scene, effects=test_scene.modelled)  # so that all evaluations have the same effects
    for surface in undamped_surfaces(test_scene, test_scene.modelled)[:1]:
        raise InputError(UNDAMPED.format(surface=surface))
    return test_scene
