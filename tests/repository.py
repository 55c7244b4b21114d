"""Where the checkout is whose tests run."""

from pathlib import Path

REPOSITORY = Path(__file__).parent.parent
