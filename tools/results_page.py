# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The generated parts of docs/results.md: tables of runs between markers; the text around them is written by hand."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

LIBRARIES = ("numpy", "opencv-python-headless", "open3d", "small_gicp", "kiss-matcher")


def with_block(page: str, name: str, content: str) -> str:
    """The page with what stands between the markers of this name replaced. Raises ValueError without markers."""
    begin, end = f"<!-- generated: {name} -->", f"<!-- end: {name} -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if len(pattern.findall(page)) != 1:
        raise ValueError(f"the page needs the markers {begin} and {end}, once")
    return pattern.sub(lambda _: f"{begin}\n{content}\n{end}", page)


def absent(data: str, command: str) -> str:
    """What stands where a data set is not at hand."""
    return f"Skipped: the data set `{data}` was not there when this page was made. The command is `{command}`."


def block(command: str, folder: Path) -> str:
    """The command and a table for each subject of a run."""
    parts = [f"`{command}`"]
    for path in sorted(folder.glob("*.json")):
        content = json.loads(path.read_text(encoding="utf-8"))
        if "reliability" in content:
            # Of the first method, which the page is about; reliability.csv has the others.
            first = content["reliability"][0]["method"]
            parts.append(reliability_table([one for one in content["reliability"] if one["method"] == first]))
        else:
            parts.append(table(content["summaries"], title_of(path.stem)))
    return "\n\n".join(parts)


def curves(folder: Path, images: Path) -> str:
    """The pictures of cumulative errors that a run left, copied among those of the page."""
    lines = ""
    for path in sorted(folder.glob("*.png")):
        if not path.stem.endswith("_by_overlap"):
            name = f"curves_{folder.name}_{path.stem}.png"
            shutil.copyfile(path, images / name)
            lines += f"\n\n![Share of pairs below each rotation and translation error, by method](images/{name})"
    return lines


def title_of(stem: str) -> str:
    """What the first column's rows are compared by: the gap, the kind of place or the overlap."""
    return {"pairs": "gap"}.get(stem, stem.replace("_", " "))


def table(summaries: Sequence[Mapping[str, Any]], title: str) -> str:
    """A row for each method, a column for each group: RE (deg) / TE (cm) / RR (%)."""
    groups = list(dict.fromkeys(one["group"] for one in summaries))
    methods = list(dict.fromkeys(one["method"] for one in summaries))
    found = {(one["method"], one["group"]): one for one in summaries}
    counts = [found[methods[0], group]["pairs"] for group in groups]
    heading = [title, *(f"{group} ({count} pairs)" for group, count in zip(groups, counts, strict=True))]
    lines = [_row([*heading, "answered", "wrong", "ms"]), "|---" * (len(heading) + 3) + "|"]
    for method in methods:
        rows = [found[method, group] for group in groups]
        totals = answered(rows), sum(row["wrong"] for row in rows), ms(rows)
        lines.append(_row([f"`{method}`", *map(cell, rows), *totals]))
    return "\n".join(lines)


def reliability_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """A row for each method and group: how many answers are wrong, and whether errors are as their covariance says."""
    heading = ("method", "reliability", "answered", "wrong", "wrong/1000 (95 %)", "NEES (95 % of runs)", "inside 95 %")
    lines = [_row(heading), "|---" * len(heading) + "|"]
    for one in rows:
        wrong = [number(one[f"wrong_per_1000{suffix}"]) for suffix in ("", "_low", "_high")]
        squared = [number(one[f"nees{suffix}"]) for suffix in ("", "_low", "_high")]
        spans = (f"{value} ({low} to {high})" for value, low, high in (wrong, squared))
        answered_of = f"{one['answered']} of {one['pairs']}"
        inside = f"{number(one['nees_inside'])} %"
        lines.append(_row([f"`{one['method']}`", one["group"], answered_of, one["wrong"], *spans, inside]))
    return "\n".join(lines)


def cell(one: Mapping[str, Any]) -> str:
    """RE / TE / RR, a dash for a median among failures."""
    rotation, translation = one["rotation_deg"], one["translation_m"]
    errors = f"{number(rotation)} / {number(None if translation is None else 100 * translation)}"
    return f"{errors} / {one['recall']:.0f}" if one["recall"] in (0, 100) else f"{errors} / {one['recall']:.1f}"


def number(value: float | None) -> str:
    """Two or three digits that count."""
    if value is None:
        return "-"
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def answered(rows: Sequence[Mapping[str, Any]]) -> str:
    """The coverage over all groups, in percent."""
    pairs = sum(row["pairs"] for row in rows)
    return f"{sum(row['answered'] * row['pairs'] for row in rows) / pairs:.0f} %"


def ms(rows: Sequence[Mapping[str, Any]]) -> str:
    """The range of the groups' medians."""
    times = sorted(row["ms"] for row in rows if row["ms"] is not None)
    if not times:
        return "-"
    low, high = f"{times[0]:.0f}", f"{times[-1]:.0f}"
    return low if low == high else f"{low} to {high}"


def machine(work: Path, root: Path) -> str:
    """Where and with what the figures were measured."""
    files = sorted(work.glob("*/*.json"), key=lambda path: path.stat().st_mtime)
    if not files:
        return "Nothing has been measured yet."
    facts = json.loads(files[-1].read_text(encoding="utf-8"))
    libraries = ", ".join(f"{name} {version}" for name, version in _versions(LIBRARIES))
    return (
        f"Measured with version {facts['version']} at commit {commit(root)} on {facts['cores']} cores of "
        f"{facts['processor']}, Python {facts['python']}, {libraries}."
    )


def commit(root: Path) -> str:
    """The short hash of what is checked out, with a note if the package differs from it."""
    try:
        said = ["git", "-C", str(root), "describe", "--always", "--abbrev=10", "--exclude=*"]
        name = subprocess.run(said, check=True, capture_output=True, text=True).stdout.strip()
        changed = ["git", "-C", str(root), "status", "--porcelain", "--", "vigg_ros"]
        dirty = subprocess.run(changed, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return f"{name} with changes" if dirty else name


def _versions(names: Iterable[str]) -> list[tuple[str, str]]:
    found = []
    for name in names:
        try:
            found.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            found.append((name, "absent"))
    return found


def _row(cells: Sequence[object]) -> str:
    return f"| {' | '.join(map(str, cells))} |"
