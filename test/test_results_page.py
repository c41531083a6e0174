# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The generated parts of docs/results.md: where they go, and what they say."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from vigg_ros.bench.pair_results import INDOOR_LIMITS

ROOT = Path(__file__).parents[1]

import failures  # noqa: E402
import results  # noqa: E402
import results_page  # noqa: E402


def summary(method: str, group: str, **changes: object) -> dict[str, object]:
    return {
        "method": method, "group": group, "pairs": 4, "rotation_deg": 0.123, "translation_m": 0.0456, "recall": 75.0,
        "answered": 75.0, "wrong": 0, "ms": 120.4, **changes,
    }  # fmt: skip


def test_the_page_has_a_place_for_every_run() -> None:
    page = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    for run in results.RUNS:
        for name in (run.name, f"{run.name} failures") if run.pictures else (run.name,):
            page = results_page.with_block(page, name, f"HERE {name}")
            assert f"HERE {name}\n<!-- end: {name} -->" in page
    assert "HERE machine" in results_page.with_block(page, "machine", "HERE machine")


@pytest.mark.parametrize("page", ["", "<!-- generated: a -->", "<!-- generated: a -->\n<!-- end: a -->\n" * 2])
def test_a_page_without_its_markers_is_refused(page: str) -> None:
    with pytest.raises(ValueError, match="needs the markers"):
        results_page.with_block(page, "a", "text")


def test_a_table_has_a_column_for_each_group_and_sums_the_rest(tmp_path: Path) -> None:
    rows = [
        summary("default", "20"),
        summary("floor", "20", recall=100.0, answered=100.0, ms=None),
        summary("default", "60", rotation_deg=None, translation_m=None, recall=0.0, answered=0.0, wrong=2, pairs=12),
        summary("floor", "60", translation_m=12.5, recall=100.0, answered=100.0, ms=None, pairs=12),
    ]
    (tmp_path / "pairs.json").write_text(json.dumps({"summaries": rows}))
    assert results_page.block("vigg evaluate x", tmp_path).splitlines() == [
        "`vigg evaluate x`",
        "",
        "| gap | 20 (4 pairs) | 60 (12 pairs) | answered | wrong | ms |",
        "|---|---|---|---|---|---|",
        # 3 of 16 pairs were answered.
        "| `default` | 0.12 / 4.56 / 75.0 | - / - / 0 | 19 % | 2 | 120 |",
        "| `floor` | 0.12 / 4.56 / 100 | 0.12 / 1250 / 100 | 100 % | 0 | - |",
    ]


def test_a_run_shows_its_reliability(tmp_path: Path) -> None:
    row = {
        "method": "default", "group": "all", "pairs": 20, "answered": 16, "wrong": 0, "wrong_per_1000": 0.0,
        "wrong_per_1000_low": 0.0, "wrong_per_1000_high": 205.9, "nees": 7.25, "nees_low": 4.42, "nees_high": 7.82,
        "nees_inside": None,
    }  # fmt: skip
    (tmp_path / "reliability.json").write_text(json.dumps({"reliability": [row]}))
    assert results_page.block("vigg evaluate x", tmp_path).splitlines()[-1] == (
        "| `default` | all | 16 of 20 | 0 | 0.00 (0.00 to 206) | 7.25 (4.42 to 7.82) | - % |"
    )
    (tmp_path / "reliability.csv").write_text("method,group\ndefault,all\n")
    assert failures.listing(tmp_path) == "No answer is wrong."


def test_the_curves_of_a_run_get_to_the_page(tmp_path: Path) -> None:
    run, images = tmp_path / "kitchen", tmp_path / "images"
    for folder in (run, images):
        folder.mkdir()
    for name in ("rooms.png", "rooms_by_overlap.png"):
        (run / name).write_bytes(b"a picture")
    assert "(images/curves_kitchen_rooms.png)" in results_page.curves(run, images)
    assert [path.name for path in images.iterdir()] == ["curves_kitchen_rooms.png"]


def test_data_that_is_absent_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "WORK", tmp_path)
    arguments = results.argparse.Namespace(data=str(tmp_path), jobs=1, every=None)
    run = next(run for run in results.RUNS if run.data and run.pictures)
    found = results.blocks(run, arguments, tmp_path)
    assert set(found) == {run.name, f"{run.name} failures"}
    assert all(f"the data set `{run.data}` was not there" in text and run.command in text for text in found.values())


def test_commands_name_the_data_and_not_where_it_lies() -> None:
    for run in results.RUNS:
        assert "/home" not in run.command
        assert not any(word.startswith("/") for word in run.arguments)
    kitti = next(run for run in results.RUNS if run.name == "kitti")
    place = Path("/data")
    located = [results.located(word, kitti.data, place) for word in kitti.arguments]
    assert "/data/kitti_04" in located
    assert "/data/kitti_04/refined_pairs.txt" in located


def write_results(folder: Path, name: str, rows: list[tuple[str, ...]]) -> None:
    """A table as an evaluation leaves it, with the limits it was judged by."""
    (folder / f"{name}.csv").write_text("\n".join(map(",".join, rows)))
    (folder / f"{name}.json").write_text(json.dumps({"limits": asdict(INDOOR_LIMITS)}))


def test_the_worst_failures_are_wrong_answers_then_refusals_one_of_a_kind(tmp_path: Path) -> None:
    rows = [
        ("default", "20", "1", "0", "", "1", "0.01"),
        ("default", "60", "2", "1", "", "20", "0.5"),
        ("default", "60", "3", "1", "", "90", "1.5"),
        ("default", "60", "4", "1", "LOST", "inf", "inf"),
        ("default", "60", "5", "1", "LOST", "inf", "inf"),
        ("paper", "60", "6", "1", "", "90", "9"),
    ]
    names = ("method", "group", "target", "source", "reason", "rotation_error_deg", "translation_error_m")
    write_results(tmp_path, "pairs", [names, *rows])
    assert [row["target"] for row in failures.worst(tmp_path, 5)] == ["3", "4"]
    assert [row["target"] for row in failures.worst(tmp_path, 1)] == ["3"]
    assert failures.listing(tmp_path).splitlines() == [
        "All wrong answers:",
        "",
        "- 60, source 1, target 3: 90.0 deg, 150 cm",
        "- 60, source 1, target 2: 20.0 deg, 50 cm",
    ]


def test_a_failure_is_drawn_with_what_speaks_for_its_cause(tmp_path: Path) -> None:
    work = tmp_path / "rendered"
    work.mkdir()
    names = ("method", "group", "target", "source", "reason", "rotation_error_deg", "translation_error_m")
    # The fifth pair of the benchmark: a white room.
    row = ("default", "weak texture", "weak texture 0.8", "weak texture 0.9", "NO_TEXTURE", "inf", "inf")
    write_results(work, "rooms", [names, row])
    assert failures.listing(work) == "No answer is wrong."
    (tmp_path / "failure_rendered_9.jpg").write_bytes(b"of an older run")
    (found,) = failures.draw(["rendered", "--seed", "0"], tmp_path, work, tmp_path, 3)
    assert [path.name for path in tmp_path.glob("*.jpg")] == ["failure_rendered_1.jpg"]
    assert found.picture == "images/failure_rendered_1.jpg"
    assert "no answer, NO_TEXTURE" in found.text
    assert "under the true motion" in found.text
    assert f"]({found.picture})" in failures.block([found])
    assert failures.block([]) == "None: every pair was answered rightly."
