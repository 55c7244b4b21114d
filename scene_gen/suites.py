"""Suites: sets of families that were released together, under a name with a version.

Released scenes never change. `RELEASED` holds, for each family of each suite, a digest
of its files and one of sample scenes, and a test compares both. Where the scenes of a
family have to change, it becomes a family with a new name in a new version of its
suite, such as `learning-v2`.

Only what is shown to be of a suite carries its name: a family whose files are the
released ones. What a template says of itself (`<text name="suite">`) selects families
of the user's own, and is never taken for a release.
"""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from beacon_mj.errors import TemplateError, unknown
from beacon_mj.scene import Profile
from beacon_mj.scene_gen.family import (
    default_families,
    family_paths,
    family_sha256,
    load_family,
)
from beacon_mj.scene_gen.generate import generate_scene

ALL = "all"  #: Every family: those of all suites, and the user's own.
#: Perception, seed and index of the sample scenes of a release.
SAMPLES: tuple[tuple[Profile, int, int], ...] = (
    ("noisy", 0, 0),
    ("noisy", 7, 4),
    ("truth", 7, 1),
)


class Release(NamedTuple):
    """What a family was when its suite was released.

    Attributes:
        files: SHA-256 of its files; see `family_sha256`.
        scenes: SHA-256 of its sample scenes; see `sample_sha256`.
    """

    files: str
    scenes: str


RELEASED: Mapping[str, Mapping[str, Release]] = {
    "paper-v1": {
        "sparse": Release(
            files="e9cb6924b44a9644a9b2cba4337d303f67f83c2af37a292dd93d7eefdcb342aa",
            scenes="22b9167bb9509e48c24645de81ca8dd59614dd164958fa5effbbbf5b7b0da414",
        ),
        "cluttered": Release(
            files="2fe5db2e762a180bba2a1378870d8aae31c4b1fa18ffff546d82eb16f898f68f",
            scenes="c4ff405314b7de6075065ecbed2bc3e19bf3793ad4e72b1d170830aa05cb6e96",
        ),
        "collision-required": Release(
            files="4241d5d9589cdf20a12a2c17877447314f7ae53d0aec267f7b264b32387e59e6",
            scenes="9707c3899229d9c0c16e1c62b41c1bae17e54709a08e1f0c63ba928885108a7d",
        ),
        "collision-shortcut": Release(
            files="9e0973711f0615d19162462759ccce01147421d5bf25d17f045742b1e37c6a89",
            scenes="feb49b3e5f3de5cdc63d4c7ee729c859f8ec89833f6668be6aeae262e8be3b79",
        ),
    },
    "learning-v1": {
        "lookalike-doors": Release(
            files="a15121ace01738cefc4dbc3ac9b2da3b35988a8ef49526c66123e5db18195982",
            scenes="1be8986ccf787b1cc7958b0ef94dac44a337b3df864f5bb6da5ea2f8ef641736",
        ),
        "lookalike-doors-08": Release(
            files="2fa06ddc3502b4f8a7d81923ab35511db416368ccd0d3873ece0ea6f9b07ce33",
            scenes="b4ccf66e47309ac79b5be0110751a3a2d7ab01562c408a7f2d5a0fa97dd313c4",
        ),
        "lookalike-doors-shuffled": Release(
            files="a53ec5cf5f3cdff46e1251d79a48b9f1141481e7d71ac508a98799a506d52837",
            scenes="6d6a1e9ae5e023ea44b6eedb43a7b71647b89f41cd340fae66f1348d51b7e456",
        ),
        "unweighed-doors": Release(
            files="52853edd3b8c37dfe6b88276b77faed3713cabbed6c6c218165d5725c1502554",
            scenes="0fca0eb8b8740c3c4691570bbfbbe6cd2c9def3886c8afe73c624f41d93efb99",
        ),
        "unweighed-doors-redrawn": Release(
            files="04c9a2f56b5c535a44639d7c9a19cc391a82d95575391de2c9503e337326bd21",
            scenes="ecb85b67ea39e92e023405c011cb57c7e98ea53a3067fa62e897c0278d6dc752",
        ),
        "revisited-rooms": Release(
            files="7d785f35a8d1fa462379df48efe7d4b8daddc5fede5c20e9c8ca50c658a0ab20",
            scenes="f6d769295f5f4079e89e1d9063f25f6cd2db7864e171a7028cde014d473eabef",
        ),
        "revisited-rooms-redrawn": Release(
            files="9c1da48bd524e0bf81d29b9f56bdbd43b627bd8220b02e97b7419886f876328b",
            scenes="a10027abd0caaec9dd83a0fa083ea50fe884c2e0e2f3653c7a70a59f21b83526",
        ),
    },
    "hard-v1": {
        "hard-required": Release(
            files="d4f4b577a07ee6b487f0840f93440ab20a7aeec8b40fb367c89e26cc6bd6b57c",
            scenes="9cc96d4e090ceb045a406eeb04349034b549364c9d49f1bb8b316b8453ff0dcb",
        ),
        "hard-shortcut": Release(
            files="68165cd420f48442fa02e18e5dfc9d6b76033ee3d72f597172f35fb3195ae628",
            scenes="b499129015d5079fb93b558776d9e359ed2181f9f58ddea6932e32cd14b9cef2",
        ),
    },
    "scale-v1": {
        "warehouse-12": Release(
            files="ee42496ec6176c64be0c1121b1c8abbfe3d933626c4455c3be36509a09736bfd",
            scenes="12856c2c2291d3ee86ade0f23dee6734474e7de40389138872e15a46ee45a09c",
        ),
        "warehouse-24": Release(
            files="509ecd9ad970554122d01eaa5dac95718b5c7ce3d079cd9a525bfc053bbe3a24",
            scenes="37a6964b15e022935269db418ad0660374c331dcf3a1624af14d8f5ea24056df",
        ),
        "warehouse-48": Release(
            files="0d53340ee65bcd9e7fc3a379918305790d5b8c79fa4ef1ed543a84aa7baf70db",
            scenes="562027d8ef2ffce7edb50d475e9e3885e1769345ee30e27f695790e89ac54834",
        ),
    },
}


def sample_sha256(family: str) -> str:
    """Return a digest of the sample scenes of a shipped family."""
    scenes = [generate_scene(family, i, seed, told) for told, seed, i in SAMPLES]
    return hashlib.sha256("".join(s.sha256 for s in scenes).encode()).hexdigest()


def released_suite(family: str, files_sha256: str) -> str | None:
    """Return the suite that a family of that name and those files is of, or None.

    Args:
        family: Its name.
        files_sha256: See `family_sha256`.
    """
    for suite, families in RELEASED.items():
        if family in families and families[family].files == files_sha256:
            return suite
    return None


def suite_of(family: str, templates: Path | None = None) -> str | None:
    """Return the suite whose scenes a family has, or None.

    Raises:
        TemplateError: If there is no such family or a file cannot be read.
    """
    return released_suite(family, family_sha256(family, templates))


def stated_suite(family: str, templates: Path | None = None) -> str | None:
    """Return the suite that a family of the user's own says it is of.

    None where it says nothing, or names a released suite, of which it is not.
    """
    said = load_family(family, templates).texts.get("suite")
    return None if said in RELEASED else said


def suite_families(suite: str, templates: Path | None = None) -> list[str]:
    """Return the families of a suite: a released one, one of the user's own, or `all`.

    In a released suite a family of the user's own of the same name takes the place of
    the shipped one; its scenes are not the suite's then.

    Raises:
        TemplateError: If there is no such suite, or a template is no good.
    """
    names = family_paths(templates)
    if suite == ALL:
        return [*names]
    if suite in RELEASED:
        return [n for n in names if n in RELEASED[suite]]
    own = {n: stated_suite(n, templates) for n in names if not _shipped(n, templates)}
    found = [name for name, said in own.items() if said == suite]
    if not found:
        known = [*RELEASED, *(said for said in own.values() if said), ALL]
        raise TemplateError(unknown("suite", suite, known))
    return found


def suites_of(suite: str | Sequence[str]) -> tuple[str, ...]:
    """Return the names of one or several suites."""
    return (suite,) if isinstance(suite, str) else tuple(suite)


def chosen_families(
    families: Sequence[str], suites: Sequence[str], templates: Path | None = None
) -> list[str]:
    """Return the families that are named, or those of the suites that are.

    Where neither is named they are those of `paper-v1`, and those of the user's own
    that name no suite.

    Raises:
        TemplateError: If both are named, a name is unknown, or a template is no good.
    """
    if families and suites:
        raise TemplateError(
            "--suite: expected no --family beside it, for a suite names its families: "
            "give one of the two."
        )
    if suites:
        names = [n for s in suites for n in suite_families(s, templates)]
    else:
        names = [*(families or default_families(templates))]
    return [*dict.fromkeys(names)]


def _shipped(family: str, templates: Path | None) -> bool:
    return family_paths(templates)[family] == family_paths().get(family)
