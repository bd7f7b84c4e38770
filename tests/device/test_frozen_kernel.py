"""Recording a kernel once."""

from __future__ import annotations

import gc

import pytest


@pytest.fixture
def frozen(engine):
    from lippmann.device.frozen_kernel import Frozen

    return Frozen


def test_nothing_is_collected_while_recording(frozen):
    import drjit as dr
    import mitsuba as mi

    seen = []

    def kernel(x):
        seen.append(gc.isenabled())
        return x + 1

    values = dr.arange(mi.Float, 4)
    dr.make_opaque(values)
    frozen(kernel, object())(values)
    assert seen == [False]
    assert gc.isenabled()


def test_the_collector_comes_back_after_an_error(frozen):
    import drjit as dr
    import mitsuba as mi

    def kernel(x):
        raise ValueError("no")

    values = dr.arange(mi.Float, 4)
    dr.make_opaque(values)
    with pytest.raises((ValueError, RuntimeError)):
        frozen(kernel, object())(values)
    assert gc.isenabled()


def test_what_changes_after_recording_is_seen(frozen):
    """Values held by the object that the kernel reads are inputs, not constants of the recording."""
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.pbr.scene import SceneFeatures

    features = SceneFeatures(absorption=mi.Color3f([1.0], [2.0], [3.0]))
    dr.make_opaque(features.absorption)

    def kernel(index):
        return dr.gather(mi.Color3f, features.absorption, index).y

    call = frozen(kernel, features)
    zeros = dr.zeros(mi.UInt32, 4)
    dr.make_opaque(zeros)
    assert list(call(zeros)) == [2.0] * 4
