import json
import math

import pytest

from lippmann.errors import PictureError
from lippmann.image import Provenance


def test_comes_back_from_json(provenance):
    text = json.dumps(provenance.to_dict(), allow_nan=False)
    assert Provenance.from_dict(json.loads(text)) == provenance
    assert Provenance.from_dict(json.loads(json.dumps(Provenance().to_dict()))) == Provenance()


def test_unknown_names_are_passed_over():
    assert Provenance.from_dict({"method": "full", "written_by_a_later_version": [1]}) == Provenance(method="full")


def test_a_later_change_of_the_mapping_given_changes_nothing():
    rays = {"primary": 1}
    made = Provenance(rays=rays)
    rays["primary"] = 2
    assert made.rays == {"primary": 1}


@pytest.mark.parametrize(
    "wrong",
    [
        {"method": 1},
        {"scene": None},
        {"spp": -1},
        {"spp": 1.5},
        {"depth": True},
        {"seed": "7"},
        {"subpixels": 1},
        {"traced_fraction": math.nan},
        {"traced_fraction": -0.1},
        {"rays": [1]},
        {"rays": {"primary": 0.5}},
        {"rays": {1: 1}},
        {"seconds": {"trace": math.inf}},
        {"seconds": {"trace": 10**400}},
        {"transfer": "gamma"},
        {"transfer": ["srgb"]},
        {"options": {"a": {}}},
        {"options": {"a": math.nan}},
        {"notes": "one sentence"},
        {"notes": [1]},
    ],
)
def test_wrong_values_are_refused_by_name(wrong):
    (name,) = wrong
    with pytest.raises(PictureError, match=f"^provenance: {name} is "):
        Provenance(**wrong)


@pytest.mark.parametrize("wrong", [None, [], "x", 3])
def test_what_is_no_mapping_is_refused(wrong):
    with pytest.raises(PictureError, match="mapping"):
        Provenance.from_dict(wrong)


def test_a_long_wrong_value_is_not_printed_whole():
    with pytest.raises(PictureError) as caught:
        Provenance(method=list(range(10000)))
    assert len(str(caught.value)) < 200
