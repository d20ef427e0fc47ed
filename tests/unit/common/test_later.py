"""Fields that are made when they are read first, and what is kept with an immutable object."""

import pickle
from dataclasses import dataclass, replace
from functools import partial

import pytest

from msfp_gen.common.later import Later, kept

made = []


@dataclass(frozen=True)
class Owner:
    size: int
    double: Later[int] = Later()
    words: Later[tuple[str, ...]] = Later(())


def doubled(factor, owner):
    made.append(owner.size)
    return factor * owner.size


def test_a_field_is_made_once_when_it_is_read():
    made.clear()
    owner = Owner(3, partial(doubled, 2))
    assert not made
    assert owner.double == owner.double == 6
    assert made == [3]
    assert Owner(3, 7).double == 7
    assert Owner(3, 7).words == ()
    with pytest.raises(TypeError):
        Owner(3)


def test_a_field_is_not_made_for_a_file_and_is_made_for_a_changed_copy():
    made.clear()
    owner = Owner(3, partial(doubled, 2))
    again = pickle.loads(pickle.dumps(owner))
    assert not made
    assert replace(again, size=5).double == 6  # of the original, not of size 5


def squared(owner, power):
    made.append(owner)
    return owner.size**power


def test_what_is_kept_is_made_again_for_other_arguments_only():
    made.clear()
    owner = Owner(3, 0)
    assert [kept(owner, squared, power) for power in (2, 2, 3, 3)] == [9, 9, 27, 27]
    assert len(made) == 2
    assert kept(Owner(2, 0), squared, 3) == 8
