"""Waits for what another process does: a condition with a deadline, as tests/support/eventually.hpp in C++."""

import threading
import time

PACE_S = 0.02  # between two looks at another process, which has no way to wake this one


def eventually(holds, deadline_s, words):
    """The first true value of holds(). After the deadline an AssertionError with words()."""
    deadline = time.monotonic() + deadline_s
    pace = threading.Event()
    while True:
        found = holds()
        if found:
            return found
        if time.monotonic() > deadline:
            raise AssertionError(f"not in {deadline_s} s: {words()}")
        pace.wait(PACE_S)
