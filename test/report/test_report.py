# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The report of a replay, read back as a browser would."""

import csv
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.acceptance.checks import EXPLANATIONS
from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.registration import Config, Reason
from vigg_ros.report.gallery import Gallery
from vigg_ros.report.page import write_report
from vigg_ros.report.recording import measure
from vigg_ros.report.wording import length, nearest_preset, summary_table
from vigg_ros.tracking.frame_result import State
from vigg_ros_testing.page_reader import Page
from vigg_ros_testing.report_samples import compared, lost, recording, refused, started, tracked, truth
from vigg_ros_testing.short_recordings import CHEAP, ROOM, short_entries, write_entries

RUN = {"version": "1.2.3", "command": "vigg replay walk", "processor": "Abacus 9000", "cores": 2, "system": "Linux"}


def report(tmp_path, results, *, config=None, run_info=RUN, **fields):
    """The page of a recording of these results."""
    gallery = Gallery(config or Config())
    for i, result in enumerate(results):
        gallery.offer(replace(result, compared=compared(i)))
    replayed = recording(results, **fields)
    path = tmp_path / "report.html"
    write_report(replayed, measure(replayed), gallery, run_info, path)
    return Page(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A walk with a bit of everything."""
    results = [started(0), *(tracked(i, new_keyframe=i % 10 == 0) for i in range(1, 40))]
    results[7] = lost(7, Reason.NO_DEPTH, "the source has 3 surface points with features, expected at least 50")
    results[20:23] = [lost(i) for i in range(20, 23)]
    results[23] = tracked(23, state=State.RELOCALISED)
    results[30] = refused(30)
    notes = ["/camera/image: found encoding 8UC3, taken as bgr8"]
    return report(tmp_path_factory.mktemp("walk"), results, truth=truth(40), notes=notes, refused={"DEPTH_SIZE": 4})


def test_the_head_says_coverage_and_accuracy_with_its_alignment(walk):
    assert walk.headings[0] == "Replay of walk"
    assert "35 of 40 colour images got a pose (87.5%)" in walk.text
    assert "Compared with the truth over 35 of them" in walk.text
    assert "after SE(3) alignment of the positions, without scale" in walk.text
    assert "4 lost, 1 refused" in walk.text


def test_times_come_with_median_p95_and_the_machine(walk):
    assert "55 ms median; p95 55 ms; Abacus 9000, 2 cores, Linux" in walk.text
    assert "keypoints" in walk.text
    assert "20 (p95 20)" in walk.text


def test_every_reason_is_explained_once_with_its_count(walk):
    assert "NO_DEPTH lost 1 (2.5%) 0.70 s Too few 3-D points" in walk.text
    assert "3 (7.5%)" in walk.text
    assert "the source has 3 surface points with features" in walk.text
    assert "DEPTH_SIZE" in walk.text


def test_all_sections_are_there(walk):
    assert walk.headings[1:] == [
        "What became of the frames", "Frames without a pose", "Where the sensor went", "Errors", "Evidence", "Time",
        "Frames worth a look", "Notes", "Run",
    ]  # fmt: skip
    assert walk.tags.count("svg") == 5
    assert "found encoding 8UC3, taken as bgr8" in walk.text
    assert "DEPTH_SIZE 4" in walk.text


def test_pictures_have_a_letter_that_stands_in_the_strip_too(walk):
    strip = walk.source[: walk.source.index("Frames without a pose")]
    for letter in "ABCDEF":
        assert f">{letter}</text>" in strip
        assert f"{letter} · " in walk.text
    assert walk.tags.count("img") == 12


def test_the_page_needs_nothing_else(walk):
    links = walk.values("src", "href", "xlink:href", "action", "data", "srcset", "background", "poster")
    assert links
    assert all(link.startswith(("data:image/", "#")) for link in links)
    assert not {"script", "link", "iframe", "object", "embed", "base", "form"} & set(walk.tags)
    assert "@import" not in walk.source
    assert "url(http" not in walk.source.replace(" ", "")
    assert any("default-src 'none'" in value for value in walk.values("content"))
    assert "currentColor" in walk.source, "plots take the ink of the page"
    assert "var(--line)" in walk.source
    assert "#010203" not in walk.source
    assert "#040506" not in walk.source


def test_ids_are_unique_and_references_to_them_hold(walk):
    ids = walk.values("id")
    assert len(ids) == len(set(ids))
    assert {link[1:] for link in walk.values("href", "xlink:href") if link.startswith("#")} <= set(ids)


def test_the_same_replay_gives_the_same_page(tmp_path):
    results = [started(0), *map(tracked, range(1, 5))]
    assert report(tmp_path, results, truth=truth(5)).source == report(tmp_path, results, truth=truth(5)).source


EVIL = "<script>alert(1)</script><img src=http://x.example/y>&amp;\"' \x1b[31m\x00\u202e"


def test_whatever_a_bag_holds_is_shown_as_text(tmp_path):
    results = [
        started(0), tracked(1, frame_id=EVIL), lost(2, message=EVIL, frame_id=EVIL),
        refused(3, code=EVIL, message=EVIL),
    ]  # fmt: skip
    page = report(
        tmp_path, results, name=EVIL, notes=[EVIL], refused={EVIL: 1}, truth=truth(3),
        run_info={**RUN, EVIL: EVIL, "processor": EVIL},
    )  # fmt: skip
    assert "script" not in page.tags
    assert all(link.startswith(("data:image/", "#")) for link in page.values("src", "href", "xlink:href"))
    shown = "<script>alert(1)</script><img src=http://x.example/y>&amp;\"' □[31m□□"
    # Title, heading, reason, its message, note, refused messages, note on frames, machine (twice), run.
    assert page.text.count(shown) >= 10
    assert not {"\x1b", "\x00", "\u202e"} & set(page.source)


def test_without_truth_the_page_says_that_errors_are_unknown(tmp_path):
    page = report(tmp_path, [started(0), *map(tracked, range(1, 5))])
    assert "no ground truth" in page.text
    assert "Errors" not in page.headings
    assert "Where the sensor went" in page.headings
    assert "aligned" not in page.text


OF_ANOTHER_TIME = [started(100), *map(tracked, range(101, 105))]
NONE = "no answered frame has a true pose near its stamp"
ONE = "only 1 answered frame has a true pose; errors need two"
TWO_APART = "2 answered frames have a true pose, but no two of one session; errors need two"


@pytest.mark.parametrize(
    ("results", "words"),
    [
        (OF_ANOTHER_TIME, NONE),
        ([started(0)], ONE),
        ([started(0), lost(1)], ONE),
        ([started(0), started(1, session=1)], TWO_APART),
    ],
)
def test_a_truth_of_too_few_answered_frames_is_not_called_missing(tmp_path, results, words):
    page = report(tmp_path, results, truth=truth(5))
    assert page.text.count(words) == 2, "in the lead and in the tile"
    assert "no ground truth" not in page.text
    assert "Errors" not in page.headings
    of_them = recording(results, truth=truth(5))
    assert words in summary_table(of_them, measure(of_them), RUN)


def test_of_scans_the_page_speaks_as_scans(tmp_path):
    results = [started(0), tracked(1), lost(2, Reason.NO_DEPTH), refused(3)]
    page = report(tmp_path, results, leaders="scans")
    assert "2 of 4 scans got a pose" in page.text
    assert "of 4 scans received" in page.text
    assert "One of the scans could not be made into a frame." in page.text
    assert "NO_DEPTH lost 1 (25.0%) 0.20 s Too few 3-D points: is depth missing" in page.text
    assert "colour image" not in page.text


DEGENERATE = {
    "no frame": [],
    "one frame": [started(0)],
    "two frames": [started(0), tracked(1)],
    "one lost frame": [lost(0, keyframe_id=None)],
    "all lost": [lost(i, keyframe_id=None) for i in range(20)],
    "lost after the first": [started(0), *(lost(i) for i in range(1, 20))],
    "all refused": [refused(i, stamp_ns=0) for i in range(5)],
    "equal stamps": [started(0), tracked(0), lost(0)],
    "at rest": [started(0, T_odom_frame=np.eye(4)), *(tracked(i, T_odom_frame=np.eye(4)) for i in range(1, 9))],
    "several sessions": [e for s in range(6) for e in (started(0, session=s), tracked(1, session=s))],
    "a session that is lost": [started(0), tracked(1), lost(2, session=1, keyframe_id=None)],
}


@pytest.mark.parametrize("count", [0, 20], ids=["without truth", "with truth"])
@pytest.mark.parametrize("case", DEGENERATE)
def test_every_outcome_gives_a_page(tmp_path, case, count):
    results = DEGENERATE[case]
    page = report(tmp_path, results, truth=truth(count))
    answered = sum(result.has_pose for result in results)
    assert f"{answered} of {len(results)} colour images got a pose" in page.text
    assert ("Where the sensor went" in page.headings) == (answered > 0)
    assert "nan" not in page.text.lower()
    assert page.headings[-1] == "Run"
    assert ("The 4 longest of 6 sessions" in page.text) == (case == "several sessions"), "maps are limited"


def test_a_long_recording_gives_a_page_of_bounded_size(tmp_path):
    results = [
        lost(i) if i % 3 == 0 else tracked(i, overlap=0.5 + 0.3 * np.sin(i), new_keyframe=i % 2 == 0)
        for i in range(1, 3000)
    ]
    page = report(tmp_path, results, truth=truth(3000))
    assert len(page.source) < 3_000_000


def test_every_reason_is_explained(tmp_path):
    page = report(tmp_path, [started(0), *(lost(i, reason) for i, reason in enumerate(Reason, 1))])
    for reason in Reason:
        assert EXPLANATIONS[reason].meaning in page.text
        assert EXPLANATIONS[reason].remedy in page.text


def test_options_that_differ_from_the_nearest_preset_are_listed(tmp_path):
    config = Config.preset("rgbd").replace({"visual.top_k": 77})
    assert nearest_preset(config) == ("rgbd", {"visual.top_k": (77, 150)})
    page = report(tmp_path, [started(0)], config=config)
    assert "visual.top_k 77 150" in page.text
    assert "unchanged" not in page.text
    assert "The configuration is the preset rgbd , unchanged." in report(tmp_path, [started(0)]).text


@pytest.mark.parametrize(
    ("metres", "words"),
    [
        (12.345, "12.3 m"),
        (1.0, "1 m"),
        (0.1234, "12.3 cm"),
        (0.01, "1 cm"),
        (0.0042, "4.2 mm"),
        (1e-5, "0.01 mm"),
        (9e-6, "under 0.01 mm"),
        (0.0, "under 0.01 mm"),
    ],
)
def test_lengths_are_in_the_unit_that_suits_them(metres, words):
    assert length(metres) == words


def test_matplotlib_is_loaded_only_to_write_a_report():
    code = "import sys, vigg_ros.report.page; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_frames_out_of_time_are_reported(tmp_path):
    bag = write_entries(tmp_path / "bag", short_entries(ROOM, frames=3, every=4))
    changes = {**CHEAP, "time_budget_s": 1e-6}
    options = [word for name, value in changes.items() for word in ("--set", f"{name}={value}")]
    assert main(["replay", str(bag), "--output", str(tmp_path / "out"), *options]) == ExitCode.NOTHING_PAIRED
    with (tmp_path / "out" / "frames.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["state"], row["reason"]) for row in rows] == [("LOST", "TIMEOUT")] * 3
    page = Page((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
    assert "The time budget was used up" in page.text
    assert "raise time_budget_s" in page.text
