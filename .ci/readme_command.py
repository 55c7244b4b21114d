"""Print one of the two commands of the README's first code block.

Usage: python .ci/readme_command.py run|tests
"""

import re
import sys
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def commands() -> dict[str, str]:
    """Return the two commands by what they do."""
    block = re.search(r"```(?:bash|sh|console)\n(.*?)```", README.read_text(), re.S)
    if block is None:
        raise SystemExit(f"{README}: expected a shell code block but found none")
    lines = [x for x in block[1].splitlines() if x and not x.startswith("#")]
    if len(lines) != 2:
        raise SystemExit(f"{README}: expected two commands but found {len(lines)}")
    return {"run": lines[0], "tests": lines[1]}


if __name__ == "__main__":
    print(commands()[sys.argv[1]])
