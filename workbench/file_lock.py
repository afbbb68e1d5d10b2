"""An advisory lock of the operating system that reserves a file for one writer.

The lock ends with the process that holds it.
"""

from __future__ import annotations

from typing import BinaryIO

try:
    import fcntl
except ImportError:  # absent on Windows
    fcntl = None


def locked(stream: BinaryIO) -> bool:
    """Lock an open file until it is closed; False if another process holds the lock.

    Where the system or the file system has no locks, nothing is locked and the answer is True.
    """
    if fcntl is None:
        return True
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass  # a network disk without locks
    return True
