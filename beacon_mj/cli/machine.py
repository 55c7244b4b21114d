"""`beacon-mj fidelity` and `beacon-mj doctor`."""

from beacon_mj.cli import FAILED


def fidelity(*checks: str) -> int:
    """Compare the physics with closed forms; status 1 if a row fails.

    Parameters
    ----------
    checks
        Names of checks to run, such as creep; all by default.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import redraw, show

    done: list[bool] = []

    def count(passed: bool) -> None:
        done.append(passed)
        redraw(f"{len(done)} rows, {sum(done)} pass")

    found = beacon_mj.run_fidelity(checks, on_row=lambda row: count(row.passed))
    redraw("\n")
    show(found)
    return 0 if found.ok else FAILED


def doctor() -> int:
    """Say which versions are here and what is missing; status 1 if something is."""
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show

    found = beacon_mj.doctor()
    show(found)
    if found.missing and found.backends:
        remark(f"missing: {', '.join(found.missing)}")
    return 0 if found.ok else FAILED
