"""Gymnasium environments: `import beacon_mj.gym` registers one a released family.

Their ids are `beacon_mj/FAMILY-vN`, with the version N of the family's suite. Gymnasium
imports this module by itself for `gymnasium.make("beacon_mj.gym:beacon_mj/FAMILY-vN")`.
"""

from beacon_mj.errors import BeaconError
from beacon_mj.extras import missing
from beacon_mj.scene_gen.suites import RELEASED

try:
    import gymnasium
except ImportError as _error:
    raise BeaconError(missing(_error, "rl")) from _error

from beacon_mj.gym.env import NavigationEnv

__all__ = ["ENV_IDS", "NavigationEnv", "env_id"]


def env_id(family: str, suite: str) -> str:
    """Return the id of a family, such as `beacon_mj/sparse-v1`.

    Args:
        family: Its name.
        suite: Its suite, whose name ends with a version, such as `paper-v1`.
    """
    return f"beacon_mj/{family}-v{suite.rpartition('-v')[2]}"


#: The ids that are registered, by family.
ENV_IDS = {
    family: env_id(family, suite)
    for suite, families in RELEASED.items()
    for family in families
}
for _family, _id in ENV_IDS.items():
    if _id not in gymnasium.registry:
        gymnasium.register(
            _id,
            entry_point="beacon_mj.gym.env:NavigationEnv",
            kwargs={"family": _family},
        )
