"""What Dask logs of an error is one line."""

from __future__ import annotations

import io
import logging

from lippmann.cluster.log_lines import drop_tracebacks


def test_errors_are_logged_without_tracebacks():
    logger, said = logging.getLogger("lippmann-test-of-lines"), io.StringIO()
    logger.propagate = False
    logger.addHandler(logging.StreamHandler(said))
    drop_tracebacks()
    try:
        raise ConnectionError("reset by\npeer")
    except ConnectionError:
        logger.exception("no heartbeat for %d %%", 3)
    logger.error("failed: %s", "Traceback (most recent call last)\n  File x")
    assert said.getvalue() == "no heartbeat for 3 % (ConnectionError: reset by peer)\nfailed:\n"
