"""What stays in memory at once is counted."""

from lippmann.rendering.film.memory_model import PHOTON, photons


def test_photons_of_one_pass_are_held_while_the_next_is_shot():
    one = photons(1000, 1)
    assert one == 2 * 1000 * PHOTON
    assert photons(1000, 2) == photons(1000, 30) == 2 * one
