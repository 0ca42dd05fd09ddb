"""Audits of arrays."""

import numpy as np
import pytest

import halflight as hl


def test_what_is_brighter_is_told_with_its_factor() -> None:
    furnace = hl.load("furnace")
    right = np.full((12, 16, 3), 0.5)
    told = hl.audit(furnace, 1.25 * right, at_most=0.1)
    assert told.is_within is False and told.met and told.mask.all()
    assert abs(told.error.value - 0.25) < 5 * told.error.standard_error
    assert abs(told.mean_error.value - 0.25) < 5 * told.mean_error.standard_error
    (factor,) = told.causes[0].numbers
    assert told.causes[0].kind == "brightness" and abs(factor.value - 1.25) < 5 * factor.standard_error
    assert told.signed.shape == (12, 16, 3) and told.signed.min() >= 0 and told.signed.max() > 0.05
    assert told.where[0].share > 0 and told.estimate[told.where[0].rows, told.where[0].columns].size
    same = hl.audit(furnace, 1.25 * right, at_most=0.1)
    assert same.error == told.error and np.array_equal(same.estimate, told.estimate)
    assert "off" in repr(told)


def test_bad_pictures_say_so() -> None:
    furnace = hl.load("furnace")
    with pytest.raises(ValueError, match="height, width, 3"):
        hl.audit(furnace, np.ones((4, 4)))
    with pytest.raises(ValueError, match="column 1, row 2"):
        hole = np.ones((4, 4, 3))
        hole[2, 1, 0] = np.nan
        hl.audit(furnace, hole)
    for wrong in [{"at_most": 0.0}, {"resolve": 0.0}, {"time": -1.0}, {"tolerance": 2.0}]:
        with pytest.raises(ValueError):
            hl.audit(furnace, np.ones((4, 4, 3)), **wrong)
