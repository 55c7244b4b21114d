"""The options that stand for several settings of the protocol, or for one."""

import msgspec

from beacon_mj.episode.protocol import PRESETS, Protocol, WorldKind
from beacon_mj.eval.runs.variants import PROTOCOL, Values, text_of, texts_of


def with_preset(name: str | None, settings: Values) -> list[str]:
    """Return settings that begin with a preset's, so that the user's own win.

    Args:
        name: A preset of the protocol; None for the default one.
        settings: The user's.

    Raises:
        RunError: If there is no preset of that name.
    """
    own = [*texts_of(settings)]
    if name is None:
        return own
    Protocol.preset(name)
    values = PRESETS[name].items()
    return [f"{PROTOCOL}.{field}={text_of(value)}" for field, value in values] + own


def in_world(
    protocol: Protocol | str | None, world: WorldKind | None
) -> Protocol | None:
    """Return a protocol, or a preset's, in a world; None if none of both is given.

    Raises:
        RunError: If there is no such preset or world.
    """
    found = Protocol.preset(protocol) if isinstance(protocol, str) else protocol
    if world is None:
        return found
    return msgspec.structs.replace(found or Protocol(), world=world)
