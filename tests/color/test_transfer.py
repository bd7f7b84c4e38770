import numpy as np
import pytest

from lippmann.color.transfer import (
    coding_chord,
    coding_slope,
    decode_srgb,
    dequantize,
    encode,
    encode_srgb,
    encode_with_slope,
    over_channels,
    pbr_neutral,
    quantize,
)


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
@pytest.mark.parametrize("bits", [8, 16])
def test_every_code_comes_back(bits, transfer):
    codes = np.arange(2**bits, dtype=np.uint8 if bits == 8 else np.uint16).reshape(-1, 4)
    linear = dequantize(codes, transfer)
    assert linear.dtype == np.float32
    back = quantize(linear, bits, transfer)
    assert back.dtype == codes.dtype
    np.testing.assert_array_equal(back, codes)


def test_known_values_of_the_srgb_curve():
    # 0.5 in linear light is 0.7353570 coded (IEC 61966-2-1); code 188 of 8 bits is the nearest.
    assert encode_srgb(np.array([0.5]))[0] == pytest.approx(0.735356983, abs=1e-8)
    assert decode_srgb(np.array([0.5]))[0] == pytest.approx(0.214041140, abs=1e-8)
    assert decode_srgb([-0.1, 0.0, 0.04045, 1.0]) == pytest.approx([-0.1 / 12.92, 0.0, 0.04045 / 12.92, 1.0], abs=1e-7)
    assert quantize(np.float32([0.5, 0.002, 1.0, 0.0]), 8, "srgb").tolist() == [188, 7, 255, 0]
    assert quantize(np.float32([0.5, 0.002, 1.0, 0.0]), 8, "linear").tolist() == [128, 1, 255, 0]


def test_values_out_of_range_go_to_the_ends():
    linear = np.float32([-1.0, -0.0, 1.0001, 3e38])
    assert quantize(linear, 8, "srgb").tolist() == [0, 0, 255, 255]
    assert quantize(linear, 16, "linear").tolist() == [0, 0, 65535, 65535]


def test_rounding_is_to_the_nearest_code():
    linear = np.float32([10.49, 10.51]) / np.float32(255)
    assert quantize(linear, 8, "linear").tolist() == [10, 11]


def test_large_pictures_are_coded_in_blocks_alike():
    linear = np.random.default_rng(1).random((1 << 22) + 17).astype(np.float32)
    whole = quantize(linear, 16, "srgb")
    np.testing.assert_array_equal(whole[-100:], quantize(linear[-100:], 16, "srgb"))


def test_a_transposed_picture_keeps_its_order():
    linear = np.random.default_rng(1).random((5, 4, 3)).astype(np.float32)
    np.testing.assert_array_equal(
        quantize(linear.swapaxes(0, 1), 8, "srgb"), quantize(linear, 8, "srgb").swapaxes(0, 1)
    )


def test_the_slope_is_that_of_the_curve():
    linear = np.array([-0.1, 0.0, 1e-3, 0.002, 0.01, 0.2, 0.9, 1.2], dtype=np.float32)
    slope = coding_slope(linear, "srgb")
    assert slope[[0, 7]] == pytest.approx([0, 0], abs=1e-6)
    assert slope[2:4] == pytest.approx([12.92, 12.92], rel=1e-3)
    expected = 1.055 / 2.4 * linear[4:7] ** (1 / 2.4 - 1)
    assert slope[4:7] == pytest.approx(expected, rel=1e-3)
    assert coding_slope(linear, "linear").tolist() == [0, 1, 1, 1, 1, 1, 1, 0]


@pytest.mark.parametrize("color", [[0.5, 0.4, 0.3], [0.05, 0.04, 0.03], [0.9, 0.8, 0.7], [3.0, 2.0, 1.5]])
def test_the_slope_with_a_tone_map_is_that_along_the_color(color):
    color, step = np.array([color]), 1e-4
    change = encode((1 + step) * color, "pbr-neutral") - encode((1 - step) * color, "pbr-neutral")
    assert coding_slope(color, "pbr-neutral") == pytest.approx(change / (2 * step * color), rel=0.05)
    low = np.array([0.2]) * color
    chord = (encode(color, "pbr-neutral") - encode(low, "pbr-neutral")) / (color - low)
    assert coding_chord(low, color, "pbr-neutral") == pytest.approx(chord, rel=1e-3)


@pytest.mark.parametrize("coding", ["linear", "srgb", "pbr-neutral"])
def test_codes_beside_their_slope_are_those_of_the_coding(coding):
    linear = np.random.default_rng(2).random((50, 3)).astype(np.float32) * 1.5 - np.float32(0.2)
    codes, slope = encode_with_slope(linear, coding)
    assert np.array_equal(codes, encode(linear, coding))
    assert np.array_equal(slope, coding_slope(linear, coding))


@pytest.mark.parametrize("coding", ["linear", "srgb"])
def test_the_chord_of_a_value_with_itself_is_the_slope(coding):
    values = np.array([0.001, 0.1, 0.3, 0.7])
    assert coding_chord(values, values, coding) == pytest.approx(coding_slope(values, coding))


@pytest.mark.parametrize("channels", [1, 3])
def test_reductions_over_colors_are_those_over_the_last_axis(channels):
    values = np.arange(4 * 5 * channels).reshape(4, 5, channels) % 7
    assert np.array_equal(over_channels(np.add, values), values.sum(axis=-1))
    assert np.array_equal(over_channels(np.maximum, values), values.max(axis=-1))


def neutral(color):
    """One colour by the specification's own steps (Khronos PBR Neutral, 2024)."""
    least = min(color)
    color = [value - (least - 6.25 * least * least if least < 0.08 else 0.04) for value in color]
    peak = max(color)
    if peak < 0.76:
        return color
    lower = 1 - 0.24**2 / (peak + 0.24 - 0.76)
    share = 1 - 1 / (0.15 * (peak - lower) + 1)
    return [value * lower / peak * (1 - share) + lower * share for value in color]


def test_the_tone_map_is_that_of_the_specification():
    random = np.random.default_rng(6)
    colors = random.random((400, 3)) * random.choice([0.1, 1.0, 4.0, 50.0], (400, 1))
    assert pbr_neutral(colors) == pytest.approx(np.array([neutral(color) for color in colors]), abs=1e-6)


def test_the_white_of_a_bright_color_is_no_change_by_its_dark_channel():
    assert coding_slope(np.array([[50.0, 1e-4, 0.0]]), "pbr-neutral").max() < 1.5
    assert coding_slope(np.zeros((1, 3)), "pbr-neutral").tolist() == [[0, 0, 0]]
