"""Shards put together: the run folder that one uninterrupted run would have left."""

import contextlib
import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, scene_refs
from beacon_mj.eval.runs.run_folder import (
    RunFolder,
    difference,
    distinct_machines,
    load_config,
    load_rows,
)
from beacon_mj.eval.runs.runner import plan
from beacon_mj.eval.runs.shards import Shard
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.files import files_below, replacing


def merge(out: Path, folders: Sequence[Path]) -> list[Row]:
    """Write the run that the shards in `folders` make up, and return its rows.

    Rows are put into canonical order. Logs are linked (hard links) where the file
    system can do that and copied elsewhere, so the shards can be deleted afterwards.

    Args:
        out: The new run folder.
        folders: All shards of one run, in any order.

    Raises:
        RunError: If a folder is no shard, a shard is there twice, is missing or
            unfinished, or two differ in their options; nothing is written then.
    """
    configs = {path: load_config(path) for path in dict.fromkeys(folders)}
    _check_shards(configs)
    _check_same(configs)
    rows = [row for path in configs for row in _finished(path, configs[path])]
    rows.sort(key=lambda row: row.key)
    config = msgspec.structs.replace(
        next(iter(configs.values())),
        shard=None,
        machines=distinct_machines(m for c in configs.values() for m in c.machines),
    )
    folder = RunFolder(out)
    folder.create(config)
    try:
        folder.append(rows)
        for path in configs:
            _take_logs(path, out)
        folder.finish(config, rows, summarize(rows))
    finally:
        folder.close()
    return rows


def _check_shards(configs: Mapping[Path, RunConfig]) -> None:
    """Raise unless every shard of one partition is there once."""
    found: dict[Shard, Path] = {}
    for path, config in configs.items():
        if config.shard is None:
            raise RunError(f"{path}: expected a shard (eval --shard) but it is whole.")
        if config.shard in found:
            raise RunError(f"{found[config.shard]}, {path}: both are {config.shard}.")
        found[config.shard] = path
    if not found:
        raise RunError("Expected the folders of all shards but there is none.")
    first, *others = found
    for shard in others:
        if shard.of != first.of:
            raise RunError(
                f"{found[shard]}: expected a shard I/{first.of}, as {found[first]} is, "
                f"but it is {shard}."
            )
    wanted = (Shard(i, first.of) for i in range(1, first.of + 1))
    if missing := [str(shard) for shard in wanted if shard not in found]:
        raise RunError(f"Expected all shards but {_some(missing)} are missing.")


def _check_same(configs: Mapping[Path, RunConfig]) -> None:
    """Raise unless the shards differ in nothing but which part they are."""
    first, *others = configs
    whole = msgspec.structs.replace(configs[first], shard=None)
    for path in others:
        if found := difference(
            whole, msgspec.structs.replace(configs[path], shard=None)
        ):
            raise RunError(f"{path}: expected the options of {first} but {found}.")


def _finished(path: Path, config: RunConfig) -> list[Row]:
    """Return a shard's rows; raise unless they are its episodes, all of them."""
    rows = load_rows(path)
    _, refs = scene_refs(config)
    wanted = {key for job in plan(config, refs) for key in job.keys}
    have = {row.key for row in rows}
    if missing := sorted(wanted - have):
        names = [f"{planner} {family}_{k:04d}" for planner, family, k in missing]
        raise RunError(
            f"{path}: expected a finished shard but it lacks {_some(names)}; "
            f"go on with: beacon-mj eval --resume --out {path}"
        )
    if foreign := sorted(have - wanted):
        names = [f"{planner} {family}_{k:04d}" for planner, family, k in foreign]
        raise RunError(
            f"{path}: expected only its own episodes but has {_some(names)}."
        )
    return rows


def _take_logs(shard: Path, out: Path) -> None:
    """Link or copy whole logs; an unfinished one (.part) stays where it is."""
    for log in files_below(shard / "logs", ".mcap"):
        target = out / log.relative_to(shard)
        target.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(OSError):
            os.link(log, target)
        if not target.exists():
            with replacing(target, RunError) as part:
                shutil.copy2(log, part)


def _some(names: Sequence[str]) -> str:
    """Return up to five names, and how many more there are."""
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more
