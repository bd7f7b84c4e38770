"""Copies are merged where time counts, and instanced where they are few and large or memory is scarce."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.device.pbr.shapes import FEW_INSTANCES, LARGE_MESH, MOST_INSTANCES, CopiedMesh, choose_instances
from lippmann.errors import SceneError

PLENTY = 1 << 40


def mesh(triangles, copies, *, instantiable=True):
    return CopiedMesh(triangles, triangles // 2, copies, instantiable)


def test_many_small_copies_are_merged():
    assert choose_instances({0: mesh(300, 3000)}, PLENTY) == set()


def test_few_large_copies_are_instanced():
    assert choose_instances({0: mesh(LARGE_MESH, 8), 1: mesh(LARGE_MESH, 1)}, PLENTY) == {0}


def test_instances_stay_few_while_memory_lasts():
    meshes = {number: mesh(LARGE_MESH, FEW_INSTANCES // 2) for number in range(5)}
    assert len(choose_instances(meshes, PLENTY)) == 2


def test_scarce_memory_makes_instances_where_they_save_most():
    meshes = {"many small": mesh(100, 1000), "some larger": mesh(5000, 100)}
    merged = sum(each.bytes_once * each.copies for each in meshes.values())
    assert choose_instances(meshes, merged) == set()
    assert choose_instances(meshes, merged - 1) == {"some larger"}
    assert choose_instances(meshes, sum(each.bytes_once for each in meshes.values())) == set(meshes)


def test_what_cannot_be_instanced_is_merged_or_refused():
    lamp = {0: mesh(LARGE_MESH, 8, instantiable=False)}
    assert choose_instances(lamp, PLENTY) == set()
    with pytest.raises(SceneError):
        choose_instances(lamp, lamp[0].bytes_once)


def test_a_scene_without_copies_is_never_refused():
    assert choose_instances({0: mesh(10**6, 1), 1: mesh(10**6, 1)}, 1) == set()


def test_a_scene_that_fits_no_way_is_refused_in_one_line():
    with pytest.raises(SceneError) as refusal:
        choose_instances({0: mesh(300, 2_000_000)}, 1 << 30, name="crowd.glb")
    text = str(refusal.value)
    assert "crowd.glb: memory: 2,000,000 placed meshes of 600,000,000 triangles need" in text
    copy = 300 * 120 + 150 * 64  # bytes, as the module says
    assert f"1.0 GiB, about {2**30 // copy:,} such copies" in text
    assert refusal.value.parameter == "memory"


@given(
    st.dictionaries(
        st.integers(0, 50),
        st.builds(mesh, st.integers(1, 10**6), st.integers(1, 3000), instantiable=st.booleans()),
        min_size=1,
    ),
    st.integers(1, 10**12),
)
def test_the_choice_keeps_to_memory_and_to_the_number_of_instances(meshes, memory):
    try:
        chosen = choose_instances(meshes, memory)
    except SceneError:
        assert sum(each.bytes_once * each.copies for each in meshes.values()) > memory
        return
    assert all(meshes[key].instantiable and meshes[key].copies > 1 for key in chosen)
    assert sum(meshes[key].copies for key in chosen) <= MOST_INSTANCES
    need = sum(each.bytes_once * (1 if key in chosen else each.copies) for key, each in meshes.items())
    assert need <= max(memory, sum(each.bytes_once for each in meshes.values()))
