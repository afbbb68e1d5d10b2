"""How is a file kept for one writer? By a lock of the system, which ends with the process that holds it."""

from __future__ import annotations

from typing import BinaryIO

try:
    import fcntl
except ImportError:  # not every system has it
    fcntl = None


def locked(stream: BinaryIO) -> bool:
    """Keeps other writers away until the stream is closed, where system and disk can; False if one was first."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass  # a network disk without locks
    return True
