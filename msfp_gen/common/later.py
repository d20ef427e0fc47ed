"""What is made when it is asked for first: fields of dataclasses, and what follows from an immutable object."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeVar, overload

T = TypeVar("T")
_REQUIRED: Any = object()


class Later(Generic[T]):
    """A field of a dataclass that may be given as a `partial`: called with the object when the field is read first.

    The value takes the place of the function, so that it is made once. default: of the field; without it the field is
    required.
    """

    def __init__(self, default: Any = _REQUIRED) -> None:
        self._default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Any: ...
    @overload
    def __get__(self, instance: object, owner: type) -> T: ...
    def __get__(self, instance: object | None, owner: type) -> Any:
        if instance is None:  # `dataclass` asks for the default
            if self._default is _REQUIRED:
                raise AttributeError(self._name)
            return self._default
        value = vars(instance)[self._name]
        if isinstance(value, partial):
            value = vars(instance)[self._name] = value(instance)
        return value

    def __set__(self, instance: object, value: T | partial[T]) -> None:
        vars(instance)[self._name] = value


def kept(owner: Any, make: Callable[..., T], *of: object) -> T:
    """`make(owner, *of)`, kept with an immutable `owner` until it is asked for with another `of`.

    make: a function of a module, by whose name the value is kept. The value must not be changed.
    """
    slots, name = vars(owner), f"_{make.__module__}.{make.__qualname__}"
    slot = slots.get(name)
    if slot is None or slot[0] != of:
        slot = slots[name] = (of, make(owner, *of))
    value: T = slot[1]
    return value
