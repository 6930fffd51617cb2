"""Ctrl-C, counted instead of raised."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def counted_interrupts() -> Iterator[list[int]]:
    """Count Ctrl-C in a list instead of being torn out of the block by it; outside the main thread none comes."""
    pressed: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    before = signal.signal(signal.SIGINT, lambda number, frame: pressed.append(number))
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
