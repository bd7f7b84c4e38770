"""The coding curve on the device is that of the host."""

import numpy as np
import pytest

from lippmann.color.transfer import encode

pytestmark = pytest.mark.usefixtures("engine")


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_codes_are_those_of_the_host(transfer):
    import mitsuba as mi

    from lippmann.device.transfer import encode as encode_on_device

    linear = np.concatenate([[-1, 0, 0.0031308, 1, 2], np.geomspace(1e-6, 1, 500)]).astype(np.float32)
    np.testing.assert_allclose(
        np.array(encode_on_device(mi.Float(linear), transfer)), encode(linear, transfer), atol=1e-6
    )
    color = np.array(encode_on_device(mi.Color3f(mi.Float(linear)), transfer))
    np.testing.assert_allclose(color[1], encode(linear, transfer), atol=1e-6)
