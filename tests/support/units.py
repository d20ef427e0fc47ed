"""Units (FMU) for tests: one program to drive instances of FMI 2.0 and 3.0 through FMPy."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from msfp_gen import Motion, Scene, Solver, Top
from support import Array
from support.ends import BEARING, INTERFACE, LOAD

INPUTS = range(1, 37)  # value references
MASS = 11e3  # supported [kg]
STILL = Motion(np.array([0.0, 1.0]), np.zeros((1, 6, 6)))


def rig() -> Scene:
    """The two-port of `support.ends` as a scene."""
    restraint = {field.name: getattr(INTERFACE, field.name) for field in fields(INTERFACE)}
    return Scene(BEARING, STILL, Top.rig(LOAD, **restraint), solver=Solver(rtol=1e-4))


def mass(rtol: float = 1e-4) -> Scene:
    top = Top.mass(MASS, 5e3, 0.5, rotational_stiffness=1e7, rotational_damping=1e4)
    return Scene(BEARING, STILL, top, solver=Solver(rtol=rtol))


class Unit:
    """One instance of a unit; messages: what its logger received."""

    def __init__(self, path: Path, *, exchange: bool = False, **given: float | bool) -> None:
        from fmpy import extract, read_model_description

        self.messages: list[str] = []
        self.folder = extract(str(path))
        self.description = read_model_description(self.folder)
        self.references = {each.name: each.valueReference for each in self.description.modelVariables}
        self.outputs = [v.valueReference for v in self.description.modelVariables if v.causality == "output"]
        self.version = int(self.description.fmiVersion[0])
        self.exchange = exchange
        self.fmu: Any = self._instance()
        self._instantiate()
        for name, value in given.items():
            self.set(name.replace("__", "."), value)

    def _instance(self) -> Any:
        from fmpy.fmi2 import FMU2Model, FMU2Slave
        from fmpy.fmi3 import FMU3Model, FMU3Slave

        kinds = {(2, False): FMU2Slave, (2, True): FMU2Model, (3, False): FMU3Slave, (3, True): FMU3Model}
        kind = self.description.modelExchange if self.exchange else self.description.coSimulation
        return kinds[self.version, self.exchange](
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=kind.modelIdentifier,
            instanceName="unit",
        )

    def _instantiate(self) -> None:
        if self.version == 2:
            from fmpy import fmi2

            def log2(environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
                self.messages.append(message.decode())

            self._callbacks = fmi2.fmi2CallbackFunctions()
            self._callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(log2)
            self._callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
            self._callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
            self.fmu.instantiate(callbacks=self._callbacks)
        else:

            def log3(environment: Any, status: int, category: bytes, message: bytes) -> None:
                self.messages.append(message.decode())

            self.fmu.instantiate(logMessage=log3)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.fmu.freeInstance()

    def start(self, time: float = 0.0) -> Self:
        if self.version == 2:
            self.fmu.setupExperiment(startTime=time)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=time)
        self.fmu.exitInitializationMode()
        if self.exchange:
            self.fmu.enterContinuousTimeMode()
        return self

    def set(self, name: str, value: float | bool) -> None:
        reference = [self.references[name]]
        if isinstance(value, bool):
            self.fmu.setBoolean(reference, [value])
        else:
            self.write(reference, [value])

    def get(self, name: str) -> float:
        return float(self.read([self.references[name]])[0])

    def write(self, references: Sequence[int], values: Sequence[float] | Array) -> None:
        numbers = [float(x) for x in np.ravel(values)]
        (self.fmu.setReal if self.version == 2 else self.fmu.setFloat64)(list(references), numbers)

    def read(self, references: Sequence[int]) -> Array:
        return np.array((self.fmu.getReal if self.version == 2 else self.fmu.getFloat64)(list(references)))

    def step(self, time: float, step: float, ends: Array | None = None) -> Array:
        """A communication step with these inputs; the outputs at its end."""
        if ends is not None:
            self.write(INPUTS, ends)
        self.fmu.doStep(time, step)
        return self.read(self.outputs)

    def derivative(self, unknowns: Sequence[int], known: int) -> Array:
        given: tuple[Any, ...] = (list(unknowns), [known], [1.0])
        return np.array(self.fmu.getDirectionalDerivative(*given))

    def call(self, name: str, *given: Any) -> int:
        """The status of a function of the standard that FMPy has not for this kind of instance."""
        return int(getattr(self.fmu.dll, f"fmi{self.version}{name}")(ctypes.c_void_p(self.fmu.component), *given))

    def state(self) -> bytes:
        if self.version == 2:
            held = self.fmu.getFMUstate()
            found = self.fmu.serializeFMUstate(held)
            self.fmu.freeFMUstate(held)
        else:
            held = self.fmu.getFMUState()
            found = self.fmu.serializeFMUState(held)
            self.fmu.freeFMUState(held)
        return bytes(found)

    def restore(self, state: bytes) -> None:
        if self.version == 2:
            held = self.fmu.deSerializeFMUstate(state)
            self.fmu.setFMUstate(held)
            self.fmu.freeFMUstate(held)
        else:
            held = self.fmu.deserializeFMUState(state)
            self.fmu.setFMUState(held)
            self.fmu.freeFMUState(held)
