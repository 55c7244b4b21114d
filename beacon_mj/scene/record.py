"""What all records of a scene have in common."""

from typing import Annotated

import msgspec
from msgspec import Meta

Coordinate = Annotated[float, Meta(ge=-100.0, le=100.0)]
Positive = Annotated[float, Meta(gt=0.0, le=1e6)]
NonNegative = Annotated[float, Meta(ge=0.0, le=1e6)]
Probability = Annotated[float, Meta(ge=0.0, le=1.0)]


class Record(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True
):
    """Base of the records a scene is made of."""
