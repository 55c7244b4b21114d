"""Under which conditions two runs were made: what keeps them from being compared."""

from collections.abc import Iterator

from beacon_mj.eval.statistics.results import Results
from beacon_mj.source_files import first_change


def differences(first: Results, other: Results) -> Iterator[str]:
    """Yield a line for each condition in which two runs differ.

    Conditions are the protocol, the files of families of one name, and the files of
    planners of one name. Versions and settings are none: they are what is compared.
    """
    ours, theirs = first.config, other.config
    if ours.protocol != theirs.protocol:
        names = ", ".join(
            name
            for name in type(ours.protocol).__struct_fields__
            if getattr(ours.protocol, name) != getattr(theirs.protocol, name)
        )
        yield (
            f"{other.folder}: expected the protocol of {first.folder} but {names} "
            "differs."
        )
    both = ours.scene_dir is None and theirs.scene_dir is None
    for name in ours.families.keys() & theirs.families.keys() if both else ():
        if ours.families[name] != theirs.families[name]:
            yield (
                f"{other.folder}: expected the family {name} of {first.folder} but its "
                "files differ."
            )
    entries = {entry.name: entry for entry in ours.planners}
    for entry in theirs.planners:
        before = entries.get(entry.name)
        if before is not None and (change := first_change(before.code, entry.code)):
            yield (
                f"{other.folder}: expected the code of {entry.name} in {first.folder} "
                f"but {change}."
            )
