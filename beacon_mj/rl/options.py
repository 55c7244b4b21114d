"""What can be chosen of an environment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError, unknown
from beacon_mj.rl.observer import NEAREST
from beacon_mj.scene import PROFILES, Profile

SEED = 1000  #: Of scenes that no published table holds.


@dataclass(frozen=True, kw_only=True)
class Options:
    """The scenes of an environment, and how episodes are run and rewarded in them.

    Attributes:
        family: Name of a scene family.
        indices: The scenes, in their order, over and over; None for 0, 1, 2, ...
        seed: Seed of the scenes, of perception and of planners, >= 0.
        perception: What is told about class and material: `truth`, `noisy` or
            `misleading`.
        protocol: How episodes are run: a protocol, or the name of a preset, `paper` or
            `realistic`.
        templates: Folder of your own family templates.
        nearest: Obstacles in an observation, 1 to 100.
        weights: Weights of reward terms in place of the defaults.
        name: The planner's name in rows.
        log_dir: Folder for an MCAP log an episode; None for none.
    """

    family: str
    indices: Sequence[int] | None = None
    seed: int = SEED
    perception: Profile = "noisy"
    protocol: Protocol | str | None = None
    templates: str | Path | None = None
    nearest: int = NEAREST
    weights: Mapping[str, float] = field(default_factory=dict)
    name: str = "policy"
    log_dir: str | Path | None = None

    def __post_init__(self) -> None:
        """Check what is checked nowhere else.

        Raises:
            RunError: If a value is no good.
        """
        if self.perception not in PROFILES:
            raise RunError(unknown("perception", str(self.perception), PROFILES))
        if self.rules.overnight != "restored":
            raise RunError(
                "Expected protocol.overnight to be 'restored', because each day of a "
                f"mission is an episode here, but it was {self.rules.overnight!r}."
            )

    @cached_property
    def rules(self) -> Protocol:
        """The protocol itself."""
        if isinstance(self.protocol, Protocol):
            return self.protocol
        return Protocol.preset(self.protocol or "paper")

    @cached_property
    def folder(self) -> Path | None:
        """The folder of templates, as a path."""
        return None if self.templates is None else Path(self.templates)


def made_options(family: str, given: Mapping[str, Any]) -> Options:
    """Return options that were given by name.

    Raises:
        RunError: If there is no option of a name, or a value is no good.
    """
    known = [each.name for each in fields(Options)]
    for name in given:
        if name not in known:
            raise RunError(unknown("option of an environment", name, known))
    return Options(family=family, **given)
