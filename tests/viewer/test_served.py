"""The page while its server lives, changes its mind, or dies: served pictures in a real browser."""

from __future__ import annotations

import os

import numpy as np
import pytest
from pages import lenticular, noise

from lippmann.viewer.http_server import WebServer
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewer.server import ViewerSite

READY = "window.lippmann?.viewer?.ready.then(() => true)"
ALERT = "(a => a && !a.hidden && a.innerText)(document.querySelector('[role=alert]'))"


def write(path, seed):
    depth = np.linspace(-1, 1, 96 * 64, dtype=np.float32).reshape(64, 96)
    noise(lenticular(), seed=seed, maps={"depth": depth}).save(path)


@pytest.fixture
def served(tmp_path, open_tab):
    """A picture with a layer, the tab that shows it, and its server."""
    path = tmp_path / "shot.exr"
    write(path, 1)
    with WebServer(ViewerSite([PictureFile(path)])) as server:
        tab = open_tab(size=(900, 700)).open(server.address)
        tab.wait_for(READY)
        yield path, tab, server


def drawn(tab):
    return tab.evaluate("window.lippmann.viewer.pixels().data")


def choose_layer(tab):
    tab.page.select_option("[aria-label=Layer]", "depth")


@pytest.mark.slow
def test_layers_come_when_they_are_asked_for(served):
    _, tab, _ = served
    before = drawn(tab)
    assert not any("tiles/depth" in asked for asked in tab.asked_for)
    choose_layer(tab)
    tab.wait_for("performance.getEntriesByType('resource').some(({ name }) => name.includes('tiles/depth'))")
    tab.wait_until(lambda: drawn(tab) != before)
    tab.assert_clean()


@pytest.mark.slow
def test_a_file_written_anew_is_shown_after_a_reload(served):
    path, tab, server = served
    before = drawn(tab)
    write(path, 2)
    os.utime(path, ns=(1, 1))
    tab.open(server.address)
    tab.wait_for(READY)
    assert drawn(tab) != before
    tab.assert_clean()


@pytest.mark.slow
def test_an_old_page_does_not_mix_two_states_of_a_file(served, open_tab):
    path, tab, server = served
    write(path, 2)
    os.utime(path, ns=(1, 1))
    other = open_tab().open(server.address)
    other.wait_for(READY)
    choose_layer(tab)
    assert "reload" in tab.wait_for(ALERT)


@pytest.mark.slow
def test_a_server_that_died_is_said(served):
    _, tab, server = served
    server.close()
    choose_layer(tab)
    assert "does not answer" in tab.wait_for(ALERT)
