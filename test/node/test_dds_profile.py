# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The Fast DDS profile: what it says, where it is found, and when it is used."""

from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest

from vigg_ros.node.player import dds_profile
from vigg_ros.node.player.dds_profile import NAME, VARIABLE, find_shared_file, set_profile

ROOT = Path(__file__).parents[2]
SPACE = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"


def test_each_participant_gets_32_mib_of_shared_memory_and_udp():
    root = ElementTree.parse(ROOT / NAME).getroot()
    assert root.tag == f"{SPACE}profiles"
    described = {one.findtext(f"{SPACE}transport_id"): one for one in root.iter(f"{SPACE}transport_descriptor")}
    (participant,) = root.findall(f"{SPACE}participant")
    assert participant.get("is_default_profile") == "true"
    assert participant.findtext(f"{SPACE}rtps/{SPACE}useBuiltinTransports") == "false"
    chosen = participant.iterfind(f"{SPACE}rtps/{SPACE}userTransports/{SPACE}transport_id")
    used = [described[one.text] for one in chosen]
    assert [one.findtext(f"{SPACE}type") for one in used] == ["SHM", "UDPv4"]
    assert used[0].findtext(f"{SPACE}segment_size") == str(32 * 2**20)


@pytest.mark.parametrize(("given", "left"), [("/etc/mine.xml", {VARIABLE: "/etc/mine.xml"}), ("", {})])
def test_a_profile_of_the_user_stays_and_an_empty_value_means_none(given, left):
    environment = {VARIABLE: given}
    assert set_profile(environment) == []
    assert environment == left


SMALL = "/dev/shm has 64 MB free, the Fast DDS profile for large messages needs 128"


@pytest.mark.parametrize(("free_mb", "left", "note"), [(128, {VARIABLE: str(ROOT / NAME)}, ""), (64, {}, SMALL)])
def test_it_is_set_where_nothing_is_set_unless_shared_memory_is_small(free_mb, left, note, monkeypatch):
    monkeypatch.setattr(dds_profile.shutil, "disk_usage", lambda path: SimpleNamespace(free=free_mb * 2**20))
    environment = {}
    assert [found[: len(SMALL)] for found in set_profile(environment)] == [note] * bool(note)
    assert environment == left


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """A folder in which nothing of the source tree is found; the package lies in its lib/."""
    module = tmp_path / "lib" / "vigg_ros" / "node" / "player" / "dds_profile.py"
    monkeypatch.setattr(dds_profile, "__file__", str(module))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setattr(dds_profile.metadata, "files", lambda name: None)
    return tmp_path


def profile_below(folder):
    path = folder / "share" / "vigg_ros" / NAME
    path.parent.mkdir(parents=True)
    path.write_text("<profiles/>")
    return path


def test_it_is_found_where_pip_puts_it_for_a_target_folder(elsewhere):
    assert find_shared_file(NAME) is None
    path = profile_below(elsewhere / "lib")
    assert find_shared_file(NAME) == path


def test_it_is_found_in_a_workspace(elsewhere, monkeypatch):
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{elsewhere / 'other'}:{elsewhere / 'install'}")
    path = profile_below(elsewhere / "install")
    assert find_shared_file(NAME) == path


def test_it_is_found_by_what_pip_wrote_down(elsewhere, monkeypatch):
    path = profile_below(elsewhere / "anywhere")
    recorded = metadata.PackagePath("share/vigg_ros/package.xml")
    recorded.dist = SimpleNamespace(locate_file=lambda name: elsewhere / "anywhere" / name)
    monkeypatch.setattr(dds_profile.metadata, "files", lambda name: [metadata.PackagePath("a.py"), recorded])
    assert find_shared_file(NAME) == path
