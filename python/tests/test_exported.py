"""Exported MJCF moves in MuJoCo's own package as the refined model does in ASID: the core of the table that `exported.py` prints."""

import mujoco
import pytest
from exported import measure
from exported_cases import CASES, SAME, Case

#: A law of each kind: values, a remembered command, a spring, contacts, and dry friction, which MuJoCo integrates in its own way.
CORE = [
    "viscous-friction@shoulder",
    "actuator-delay@push",
    "joint-stiffness@elbow",
    "coulomb-friction@shoulder",
    "rolling-friction@board",
]


@pytest.mark.parametrize("name", CORE)
def test_an_exported_document_replays_as_well_as_the_refined_model(name, tmp_path):
    (case,) = [c for c in CASES if c.effects[0].startswith(name)]
    row = measure(case, tmp_path)
    assert row.apart <= case.most, row
    # The effect matters here, and the document alone says it: noise of some hundred readings is good to a few per cent.
    assert row.nominal > 5 and abs(row.exported - 1) < 0.1, row


def test_every_distance_beyond_rounding_has_its_reason():
    assert all(case.why or case.most == SAME for case in CASES)


def test_the_package_is_the_version_that_delays_need():
    assert tuple(map(int, mujoco.__version__.split(".")[:2])) >= (3, 5)


def test_a_document_without_the_effect_is_found_out(tmp_path):
    """The measure itself: a nominal model is many deviations from the log."""
    row = measure(Case("arm", ("viscous-friction@shoulder:damping=0.0",)), tmp_path)
    assert row.apart <= SAME and abs(row.nominal - row.exported) < 1e-9, row
