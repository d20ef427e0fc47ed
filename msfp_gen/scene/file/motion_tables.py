"""The kinds of `[motion]` in a scene file.

Each class is the table of one kind: its annotations are the rules of the scene reader, `build` makes the motion.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Notes, Quantity, Text, ruled_fields
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.inputs import InputCache, digest_of, expecting, is_input
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Load, Prescribed, Rotation

if TYPE_CHECKING:
    from msfp_gen.motions.records import Record

MOST_BYTES = 128 << 20  # of the motions that are kept, and of the records
RECORDS = "MSFP_GEN_RECORDS"  # environment variable: further folders with records, beside the folder of the scene file
_LENGTH, _TIME, _COUNT = Quantity("m", above=0.0), Quantity("s", above=0.0), Quantity("", above=0.0)
_FREQUENCY, _ANGULAR = Quantity("Hz", above=0.0), Quantity("rad/s", above=0.0)
_TIMES = Quantity("s", least=0.0, shape=(None,))
_FORCE, _MOMENT, _ANGLE = Quantity("N", shape=(3,)), Quantity("N m", shape=(3,)), Quantity("rad")
_NONE = (0.0, 0.0, 0.0)
Vectors = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class HistoryTable:
    """Table of one kind. of: the class of the history; make: the name of its constructor, which takes the fields."""

    kind: ClassVar[str]
    of: ClassVar[type[Prescribed]]
    make: ClassVar[str]

    def build(self) -> Prescribed:
        """The history. Raises InputError."""
        return getattr(self.of, self.make)(**{f.name: getattr(self, f.name) for f in fields(self)})  # type: ignore[no-any-return]


@dataclass(frozen=True, kw_only=True)
class _Ramp(HistoryTable):
    kind, make = "ramp", "ramp"
    duration: Annotated[float, _TIME]


@dataclass(frozen=True, kw_only=True)
class _Harmonic(HistoryTable):
    kind, make = "harmonic", "harmonic"
    frequency: Annotated[float, _FREQUENCY]
    cycles: Annotated[float, _COUNT]
    phase: Annotated[float, _ANGLE] = 0.0
    lead_in: Annotated[float | None, _TIME] = None


@dataclass(frozen=True, kw_only=True)
class ConstantLoad(HistoryTable):
    """`Load.constant`."""

    kind, of, make = "constant", Load, "constant"
    force: Annotated[tuple[float, float, float], _FORCE] = _NONE
    moment: Annotated[tuple[float, float, float], _MOMENT] = _NONE


@dataclass(frozen=True, kw_only=True)
class RampLoad(_Ramp, ConstantLoad):
    """`Load.ramp`."""


@dataclass(frozen=True, kw_only=True)
class HarmonicLoad(_Harmonic, ConstantLoad):
    """`Load.harmonic`."""


@dataclass(frozen=True, kw_only=True)
class SampledLoad(HistoryTable):
    """`Load.from_arrays`: linear between samples; two samples at the same time make a jump."""

    kind, of, make = "samples", Load, "from_arrays"
    time: Annotated[tuple[float, ...], _TIMES]
    force: Annotated[Vectors, Quantity("N", shape=(None, 3))]
    moment: Annotated[Vectors | None, Quantity("N m", shape=(None, 3))] = None


@dataclass(frozen=True, kw_only=True)
class LoadPieces(HistoryTable):
    """The polynomials of a `Load`."""

    kind, of, make = "pieces", Load, "of"
    knots: Annotated[tuple[float, ...], _TIMES]
    coefficients: Annotated[tuple[Any, ...], Quantity("", shape=(None, 6, 6), computed=True)]
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class ConstantRotation(HistoryTable):
    """`Rotation.constant`."""

    kind, of, make = "constant", Rotation, "constant"
    psi: Annotated[float, _ANGLE] = 0.0
    theta: Annotated[float, _ANGLE] = 0.0


@dataclass(frozen=True, kw_only=True)
class RampRotation(_Ramp, ConstantRotation):
    """`Rotation.ramp`."""


@dataclass(frozen=True, kw_only=True)
class HarmonicRotation(_Harmonic, ConstantRotation):
    """`Rotation.harmonic`."""


@dataclass(frozen=True, kw_only=True)
class SampledRotation(HistoryTable):
    """`Rotation.from_arrays`: a spline through psi, theta with zero rates at its ends."""

    kind, of, make = "samples", Rotation, "from_arrays"
    time: Annotated[tuple[float, ...], _TIMES]
    angles: Annotated[Vectors, Quantity("rad", shape=(None, 2))]


@dataclass(frozen=True, kw_only=True)
class RotationPieces(HistoryTable):
    """The polynomials of a `Rotation`."""

    kind, of, make = "pieces", Rotation, "of"
    knots: Annotated[tuple[float, ...], _TIMES]
    name: str = ""
    coefficients: Annotated[tuple[Any, ...], Quantity("", shape=(None, 2, 6), computed=True)]


LOADS: dict[str, type[HistoryTable]] = {
    kind.kind: kind for kind in (ConstantLoad, RampLoad, HarmonicLoad, SampledLoad, LoadPieces)
}
ROTATIONS: dict[str, type[HistoryTable]] = {
    kind.kind: kind for kind in (ConstantRotation, RampRotation, HarmonicRotation, SampledRotation, RotationPieces)
}


def history_from(kinds: Mapping[str, type[HistoryTable]], table: Mapping[str, Any], path: str) -> Any:
    """The load or rotation history of a validated table; raises InputError whose message starts with `path`."""
    values = dict(table)
    try:
        return kinds[values.pop("kind")](**values).build()
    except InputError as error:
        text = str(error)
        for word in ("load", "rotation"):
            text = text.removeprefix(word) if text.startswith((f"{word}.", f"{word}:", f"{word} ")) else text
        raise InputError(path + text if text != str(error) else f"{path}: {text}") from None


def polynomials_of(history: Prescribed) -> dict[str, Any]:
    """The table of any load or rotation history: its polynomials."""
    table: dict[str, Any] = {"kind": "pieces", "knots": history.knots.tolist()}
    table["coefficients"] = history.coefficients.tolist()
    return table | ({"name": history.name} if history.name else {})


@dataclass(frozen=True)
class Paths(Text):
    """The path of a file; several: or a list of them."""

    several: bool = False

    def parse(self, value: object, *, text: bool = False) -> Any:
        """`value` itself, a list as a tuple; raises ValueError whose text is the remedy."""
        if not self.several:
            return super().parse(value, text=text)
        several = isinstance(value, list | tuple) and value and all(isinstance(item, str) for item in value)
        if not (isinstance(value, str) or several):
            raise ValueError("give a text in quotes, or a list of them: one file for each component")
        return value if isinstance(value, str) else tuple(value)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Components(Text):
    """A list of components of a record."""

    def parse(self, value: object, *, text: bool = False) -> Any:
        """`value` as a tuple; raises ValueError whose text is the remedy."""
        if not (isinstance(value, list | tuple) and value and set(map(str, value)) <= {"E1", "E2", "E3"}):
            raise ValueError("give a list of E1, E2 and E3, or some of them")
        return tuple(value)


@dataclass(frozen=True, kw_only=True)
class MotionTable:
    """Fields of every kind: name, time at rest after the end of the motion [s], and the table of a base rotation.

    make: the name of the constructor of `Motion`, which takes the other fields.
    """

    kind: ClassVar[str]
    make: ClassVar[str] = ""
    name: str = ""
    hold: Annotated[float | None, _TIME] = None
    rotation: Mapping[str, Any] | None = None

    def build(self) -> Motion:
        """The motion; raises InputError whose message starts with `motion`.

        It is made once for each table and contents of its files, as long as it is among those that were made last.
        """
        if isinstance(self, PolynomialMotion):
            return self._build()
        files = _digests(self.files)
        with expecting(files):
            return _motions.value(fingerprint((self, files)), self._build)

    @property
    def files(self) -> tuple[Path, ...]:
        """The files from which the motion is read. Raises InputError where there is none at a path."""
        return ()

    def _build(self) -> Motion:
        try:
            motion = self._motion()
            motion = motion if self.hold is None else motion.held(self.hold)
            if self.rotation is None:
                return motion
            return motion.rocking(history_from(ROTATIONS, self.rotation, "motion.rotation"))
        except InputError as error:
            text = str(error)
            raise InputError(text if text.startswith("motion") else f"motion.{text}") from None

    def _motion(self) -> Motion:
        """The motion without the time at rest and without rotation."""
        return getattr(Motion, self.make)(**self._values())  # type: ignore[no-any-return]

    def _values(self, *omitted: str) -> dict[str, Any]:
        """Fields by name, less `hold`, `rotation` and the omitted ones."""
        left_out = {"hold", "rotation", *omitted}
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name not in left_out}


@dataclass(frozen=True, kw_only=True)
class Harmonic(MotionTable):
    """`Motion.harmonic`: A sin(2 pi f t) after a smooth lead-in."""

    kind, make = "harmonic", "harmonic"
    amplitude: Annotated[float, _LENGTH]
    frequency: Annotated[float, _FREQUENCY]
    direction: Annotated[float, _ANGLE] = 0.0
    cycles: Annotated[float, _COUNT] = 2.0
    lead_in: Annotated[float | None, _TIME] = None


@dataclass(frozen=True, kw_only=True)
class Circle(MotionTable):
    """`Motion.circle`: a circular path."""

    kind, make = "circle", "circle"
    amplitude: Annotated[float, _LENGTH]
    angular_frequency: Annotated[float, _ANGULAR]
    cycles: Annotated[float, _COUNT] = 2.0
    lead_in: Annotated[float, _TIME] = 20.0


@dataclass(frozen=True, kw_only=True)
class FigureEight(Circle):
    """`Motion.figure_eight`: a path in the form of an eight."""

    kind, make = "figure-eight", "figure_eight"


@dataclass(frozen=True, kw_only=True)
class Ramp(MotionTable):
    """`Motion.ramp`: constant acceleration."""

    kind, make = "ramp", "ramp"
    acceleration: Annotated[float, Quantity("m/s^2", above=0.0)]
    duration: Annotated[float, _TIME]
    direction: Annotated[float, _ANGLE] = 0.0


@dataclass(frozen=True, kw_only=True)
class RecordMotion(MotionTable):
    """`Motion.from_record`: one file, one file for each component, or a record bundled with the package.

    unit, time_step: of files of numbers without a header; see `records.read_record`.
    components: which are kept; the others are zero. rotated_by: rotation of the horizontal components that are
    kept, about E3 from E1 towards E2. scale_to: a table of the fields of `records.ScaleTo`.
    """

    kind: ClassVar[str] = "record"
    file: Annotated[str | tuple[str, ...] | None, Paths(several=True)] = None
    bundled: str | None = None
    unit: str | None = None
    time_step: Annotated[float | None, _TIME] = None
    components: Annotated[tuple[str, ...] | None, Components()] = None
    rotated_by: Annotated[float | None, _ANGLE] = None
    scale: Annotated[float, Quantity("")] = 1.0
    scale_to: Mapping[str, Any] | None = None
    start: Annotated[float | None, Quantity("s", least=0.0)] = None
    duration: Annotated[float | None, _TIME] = None
    correct: bool = True
    corner: Annotated[float, _FREQUENCY] = 0.05
    taper: Annotated[float, _TIME] = 1.0

    def _motion(self) -> Motion:
        from msfp_gen.motions.records import ScaleTo

        source = self.bundled or _digests(self.files)
        read_by = (source, self.unit, self.time_step, self.components, self.rotated_by)
        record = _records.value(fingerprint(read_by), self._record)
        target = None if self.scale_to is None else ScaleTo(**self.scale_to)
        values = self._values("file", "bundled", "unit", "time_step", "components", "rotated_by", "scale_to")
        return Motion.from_record(record, scale_to=target, **values | {"name": self.name or None})

    @property
    def files(self) -> tuple[Path, ...]:
        """The files of the record; none where it comes with the package."""
        if (self.file is None) == (self.bundled is None):
            defect = "neither is" if self.file is None else "both are"
            raise InputError(f"motion.file and motion.bundled: {defect} given; give one, a path or a record's name")
        return tuple(_existing(file) for file in ([self.file] if isinstance(self.file, str) else self.file or ()))

    def _record(self) -> Record:
        from msfp_gen.motions import records

        if self.bundled is None:
            record = records.read_record(*self.files, unit=self.unit, time_step=self.time_step)
        elif self.unit is not None or self.time_step is not None:
            raise InputError("motion.unit and motion.time_step are of files without a header; leave them out")
        else:
            record = records.bundled(self.bundled)
        record = record if self.components is None else record.with_components(self.components)
        return record if self.rotated_by is None else record.rotated(self.rotated_by)


@dataclass(frozen=True, kw_only=True)
class CsvMotion(MotionTable):
    """`Motion.from_csv`: a file with columns of time and displacement or acceleration, units in its header."""

    kind: ClassVar[str] = "arrays"
    file: Annotated[str, Paths()]

    def _motion(self) -> Motion:
        return Motion.from_csv(self.files[0], name=self.name)

    @property
    def files(self) -> tuple[Path, ...]:
        """The file with the columns."""
        return (_existing(self.file),)


@dataclass(frozen=True, kw_only=True)
class PolynomialMotion(MotionTable):
    """The polynomials of a `Motion`: the exact form in which a motion made in Python is written."""

    kind: ClassVar[str] = "pieces"
    knots: Annotated[tuple[float, ...], Quantity("s", shape=(None,))]
    coefficients: Annotated[tuple[Any, ...], Quantity("", shape=(None, 6, 6), computed=True)]
    jumps: Annotated[tuple[float, ...], Quantity("s", shape=(None,))] = ()
    max_step: Annotated[float | None, _TIME] = None
    metadata: Annotated[Mapping[str, str | float] | None, Notes()] = None

    def _motion(self) -> Motion:
        return Motion(**self._values() | {"metadata": self.metadata or {}})

    @classmethod
    def of(cls, motion: Motion) -> dict[str, Any]:
        """The `[motion]` table of any motion, `kind` included."""
        names = ("knots", "coefficients", "jumps")
        table = {"kind": cls.kind, **{name: getattr(motion, name).tolist() for name in names}}
        rest = {"max_step": motion.max_step, "name": motion.name, "metadata": dict(motion.metadata)}
        return table | {name: value for name, value in rest.items() if value is not None}


def _digests(paths: Sequence[Path]) -> dict[str, str]:
    """The sha256 of files by their absolute paths. Raises InputError."""
    try:
        return {str(path.absolute()): digest_of(path) for path in paths}
    except OSError as error:
        raise InputError(
            f"motion.file = {error.filename!r}: cannot be read ({error.strerror}); check the file"
        ) from None


_motions: InputCache[Motion] = InputCache(MOST_BYTES, lambda motion: motion.coefficients.nbytes)
_records: InputCache[Record] = InputCache(MOST_BYTES, lambda record: record.acceleration.nbytes)


def resolved(file: str | tuple[str, ...], folder: Path | None, name: str = "motion.file") -> str | tuple[str, ...]:
    """The path or paths of a `file` key as absolute paths; relative ones start from the folder of the scene file.

    Security: a scene file can only read files in or below its own folder and the folders in `MSFP_GEN_RECORDS`. For a
    table made in Python (`folder` None) there is no restriction. Raises InputError that begins with `name`.
    """
    if isinstance(file, str):
        return _resolved(file, folder, name)
    return tuple(_resolved(path, folder, name) for path in file)


def located(table: Mapping[str, Any], folder: Path | None, name: str = "motion") -> dict[str, Any]:
    """The table of a motion with absolute paths of its files, and with the rows of a tabulated target spectrum.

    folder, errors: see `resolved`; name: of the table.
    """
    located = dict(table)
    if "file" in located:
        located["file"] = resolved(located["file"], folder, f"{name}.file")
    if isinstance(located.get("scale_to"), Mapping):
        located["scale_to"] = with_spectrum(located["scale_to"], folder, f"{name}.scale_to")
    return located


def with_spectrum(target: Mapping[str, Any], folder: Path | None, name: str) -> dict[str, Any]:
    """The table of a target with the rows of its spectrum in place of the path of their file; else as in `located`."""
    from msfp_gen.motions.records.scaling import read_spectrum

    located = dict(target)
    if isinstance(located.get("spectrum"), str):
        path = Path(str(resolved(located["spectrum"], folder, f"{name}.spectrum")))
        if not is_input(path):
            raise InputError(f"{name}.spectrum = {str(path)!r}: no such file; paths are relative to the scene file")
        located["spectrum"] = [list(pair) for pair in read_spectrum(path)]
    return located


def _resolved(file: str, folder: Path | None, name: str) -> str:
    try:
        path = ((folder or Path()) / file).resolve()
    except (OSError, ValueError, RuntimeError) as error:  # such as a null character, or a loop of symbolic links
        raise InputError(f"{name} = {file!r}: this is no path ({error}); give the path of a file") from None
    records = os.environ.get(RECORDS, "").split(os.pathsep)
    permitted = [folder, *(Path(record).expanduser() for record in records if record)] if folder is not None else []
    if permitted and not any(path.is_relative_to(record.resolve()) for record in permitted):
        raise InputError(
            f"{name} = {file!r}: outside the folder of the scene file; put the file there, or name its folder "
            f"in the environment variable {RECORDS}"
        )
    return str(path)


def paths_in(*kinds: type) -> tuple[str, ...]:
    """Names of the fields of dataclasses that are paths of files."""
    rules = [(name, rule) for kind in kinds for name, rule, _ in ruled_fields(kind)]
    return tuple(dict.fromkeys(name for name, rule in rules if isinstance(rule, Paths)))


def _existing(file: str | None) -> Path:
    """The path of an existing file; raises InputError for any other."""
    path = Path(str(file))
    if not is_input(path):
        raise InputError(f"motion.file = {str(path)!r}: no such file; paths are relative to the scene file")
    return path


KINDS: dict[str, type[MotionTable]] = {
    kind.kind: kind for kind in (Harmonic, Circle, FigureEight, Ramp, RecordMotion, CsvMotion, PolynomialMotion)
}


def motion_from(table: Mapping[str, Any]) -> Motion:
    """The motion of a validated `[motion]` table whose paths are absolute. Raises InputError."""
    return KINDS[table["kind"]](**{key: value for key, value in table.items() if key != "kind"}).build()
