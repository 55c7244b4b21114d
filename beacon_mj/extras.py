"""Packages that only an extra brings: what to say where one is missing."""

from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires

DISTRIBUTION = "beacon-mj"


def missing(error: ImportError, extra: str) -> str:
    """Return which package was expected, and the command that installs it.

    The command names the packages of the extra themselves, so that it works whether
    beacon-mj came from an index, a file or a checkout.

    Args:
        error: Why the import failed.
        extra: The extra of `pyproject.toml` that has the package.
    """
    names = [*packages(extra)] or [error.name or extra]
    words = " ".join(f"'{name}'" for name in names)
    return (
        f"expected package {error.name!r} but it is not installed: pip install {words} "
        f"(extra {extra!r} of {DISTRIBUTION})."
    )


def packages(extra: str) -> Iterator[str]:
    """Yield the requirements of an extra; none if beacon-mj itself is not installed."""
    try:
        lines = requires(DISTRIBUTION) or []
    except PackageNotFoundError:
        return
    for line in lines:
        requirement, _, marker = line.partition(";")
        if f"extra == '{extra}'" in marker.replace('"', "'"):
            yield requirement.strip()
