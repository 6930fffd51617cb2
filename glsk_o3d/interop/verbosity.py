"""Open3D's verbosity level, for those who have set it."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

QUIET, TALKATIVE = 0, 3  # int(o3d.utility.VerbosityLevel.Error) and .Debug


def open3d_is(level: int) -> bool:
    """Whether Open3D has been imported and set to a verbosity level; it is not imported to find out."""
    utility = getattr(sys.modules.get("open3d"), "utility", None)
    return utility is not None and int(utility.get_verbosity_level()) == level


@contextmanager
def following_open3d() -> Iterator[None]:
    """Let the package's log say as much as Open3D does: debug messages at its level Debug, errors alone at Error.

    A level that the user has given the logger ``glsk_o3d`` comes first. Where nobody listens to the log, debug messages
    go to stderr, in Open3D's form.
    """
    log = logging.getLogger(__package__.partition(".")[0])
    talkative = open3d_is(TALKATIVE)
    if log.level != logging.NOTSET or not (talkative or open3d_is(QUIET)):
        yield
        return
    handler = logging.StreamHandler() if talkative and not log.hasHandlers() else logging.NullHandler()
    handler.setFormatter(logging.Formatter("[glsk-o3d %(levelname)s] %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.DEBUG if talkative else logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(logging.NOTSET)
        log.removeHandler(handler)
