"""Type V as a machine of states: what it allows, and that all it allows together has its slopes."""

from itertools import product

import pytest

from motionary.pipeline.alignment.type_v import MOST_ADVANCE, TypeV


def admits(advances: tuple[int, ...]) -> bool:
    state = TypeV()
    for advance in advances:
        if not state.least <= advance <= MOST_ADVANCE:
            return False
        state = state.after(advance)
    return True


def test_just_those_sequences_pass_that_never_stay_thrice_in_a_row():
    for advances in product(range(5), repeat=5):
        text = "".join(map(str, advances))
        assert admits(advances) == ("000" not in text and "4" not in text), text


def test_its_slopes_are_a_third_and_three():
    for advances in product(range(4), repeat=6):
        if admits(advances):
            assert 6 // 3 <= sum(advances) <= 6 * 3


@pytest.mark.parametrize(("stays", "advance"), [(0, 4), (2, 0), (0, -1)])
def test_an_advance_that_is_not_allowed_is_refused(stays, advance):
    with pytest.raises(ValueError, match=f"advance of {advance} after {stays} stays; it may be"):
        TypeV(stays).after(advance)


def test_an_advance_forgets_the_stays():
    assert TypeV(2).after(3) == TypeV(0)
    assert TypeV().after(0).after(0) == TypeV(2)
