"""Says at the end what came of the inputs that were generated."""

import pytest

from tests.fuzz.harness import TALLIES


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    for kind, tally in sorted(TALLIES.items()):
        terminalreporter.write_line(
            f"fuzz {kind}: {tally.inputs} inputs, {tally.refused} refused, the others "
            f"good; one took at most {tally.seconds:.1f} s and {tally.megabytes:.0f} MB"
        )
