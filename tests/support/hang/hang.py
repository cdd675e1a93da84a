"""A process whose loop hangs while DDS goes on."""

import ctypes
import os


class Hang:
    """The first thread of a child process stands still. The others go on, as those of DDS and of the metrics do."""

    SEIZE, INTERRUPT, DETACH, ANY_THREAD = 0x4206, 0x4207, 17, 0x40000000

    def __init__(self, process):
        """`process`: a running subprocess.Popen."""
        self.pid = process.pid
        self.libc = ctypes.CDLL(None, use_errno=True)
        self.libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]

    def __enter__(self):
        """Raises OSError where a thread cannot be stopped, as in some containers."""
        for request in (self.SEIZE, self.INTERRUPT):
            if self.libc.ptrace(request, self.pid, None, None) != 0:
                raise OSError(ctypes.get_errno(), f"a thread cannot be stopped here: {os.strerror(ctypes.get_errno())}")
        os.waitpid(self.pid, self.ANY_THREAD)
        return self

    def __exit__(self, *_):
        self.libc.ptrace(self.DETACH, self.pid, None, None)
