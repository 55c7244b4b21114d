"""Limits that a process sets itself, before it does what cannot be trusted."""

_PR_SET_PDEATHSIG = 1


def limit_memory(memory_mib: int) -> None:
    """Bound the address space to what is in use and `memory_mib` [MiB]; leave no core.

    Where the system cannot do so, nothing is bounded.
    """
    try:
        import resource

        with open("/proc/self/statm") as file:
            used = int(file.read().split()[0]) * resource.getpagesize()
    except (ImportError, OSError):
        return  # No Linux: there the limit means something else, or nothing.
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    limit = used + memory_mib * 2**20
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def limit_effort(cpu_s: int, file_bytes: int) -> None:
    """Bound the processor time from now on [s], and the size of any file it writes."""
    try:
        import resource
    except ImportError:
        return
    usage = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(usage.ru_utime + usage.ru_stime) + 1 + cpu_s
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))


def end_with(parent: int) -> None:
    """Let the kernel kill this process with its parent, compiled loops included.

    Args:
        parent: The parent's process id.
    """
    import ctypes
    import os
    import signal

    try:
        prctl = ctypes.CDLL(None).prctl
    except (OSError, AttributeError):
        return
    prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)
    if os.getppid() != parent:
        os._exit(0)


def become(
    words: list[str], parent: int, memory_mib: int, *, end_with_parent: bool
) -> None:
    """Limit this process, and let another program take its place.

    Args:
        words: The program and its arguments.
        parent: The parent's process id.
        memory_mib: Address space that it may take beyond what is in use here [MiB].
        end_with_parent: Whether the kernel ends it with the parent's thread.
    """
    import os
    import signal

    if end_with_parent:
        end_with(parent)
    limit_memory(memory_mib)
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # Which Python had ignored.
    os.execvp(words[0], words)
