"""Limits that a process sets itself, before it does what cannot be trusted."""


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
