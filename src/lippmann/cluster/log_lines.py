"""Dask's log, a line for each event."""

from __future__ import annotations

import logging


def drop_tracebacks() -> None:
    """Let all handlers that log in this process write an error's kind and text in place of its traceback."""
    loggers = (logging.getLogger(name) for name in (None, *logging.root.manager.loggerDict))
    handlers = {handler for logger in loggers for handler in logger.handlers}
    for handler in (*handlers, *filter(None, [logging.lastResort])):
        handler.addFilter(_shorten)


def _shorten(record: logging.LogRecord) -> bool:
    text = record.getMessage().partition("Traceback (most recent call last)")[0]
    error = record.exc_info[1] if record.exc_info else None
    why = f" ({type(error).__name__}: {error})" if error else ""
    record.msg, record.args = " ".join(f"{text}{why}".split()), ()
    record.exc_info = record.exc_text = None
    return True
