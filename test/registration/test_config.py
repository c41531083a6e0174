# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options: read, changed, refused and written; a refusal says what was found, and changes nothing."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError
from pathlib import Path
from typing import Any

import pytest
import yaml

from vigg_ros.registration import Config, ConfigError
from vigg_ros.registration.config import PAPER, PRESETS
from vigg_ros.registration.options import CliqueConfig, GeometricConfig

OPTIONS = {name: (spec, value) for name, spec, value in Config().options()}
NUMBERS = [name for name, (spec, _) in OPTIONS.items() if type(spec.default) in (int, float)]
UNKNOWN_ROW = pytest.mark.hostile("Parameters: unknown key F with a suggestion")
RANGE_ROW = pytest.mark.hostile("Parameters: NaN or out of range F, or refused at run time with the old value kept")


def load(tmp_path: Path, text: str) -> Config:
    path = tmp_path / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return Config.load(path)


@pytest.mark.parametrize("name", OPTIONS)
def test_every_option_says_what_it_is_for(name: str) -> None:
    spec, value = OPTIONS[name]
    assert len(spec.metadata["doc"]) > 15
    assert value == spec.default
    kind = type(spec.default)
    if kind in (int, float):
        low, high = spec.metadata["low"], spec.metadata["high"]
        assert math.isfinite(low)
        assert math.isfinite(high)
        assert low <= spec.default <= high
    elif kind is str:
        assert spec.default in spec.metadata["choices"]
    else:
        assert kind is bool
    assert name.endswith("_m") == (spec.metadata["unit"] == "m")


def test_replace_changes_what_it_names_and_nothing_else() -> None:
    before = Config()
    after = before.replace({"visual.top_k": 77, "seed": 5, "cliques.inlier_threshold_m": 0.3})
    assert (after.visual.top_k, after.seed, after.cliques.inlier_threshold_m) == (77, 5, 0.3)
    changed = {
        name for (name, _, a), (_, _, b) in zip(before.options(), after.options(), strict=True) if a != b
    }
    assert changed == {"visual.top_k", "seed", "cliques.inlier_threshold_m"}
    assert before == Config()
    assert before.replace({}) == before


def test_a_configuration_cannot_be_changed_in_place() -> None:
    with pytest.raises(FrozenInstanceError):
        Config().seed = 3  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        Config().visual.top_k = 3  # type: ignore[misc]


@UNKNOWN_ROW
@pytest.mark.parametrize(
    ("name", "suggestion"),
    [
        ("visual.topk", "did you mean visual.top_k?"),
        ("top_k", "did you mean visual.top_k?"),
        ("geometric.voxel_size", "did you mean geometric.voxel_size_m?"),
        ("sed", "did you mean seed?"),
        ("visual", "visual."),
        ("%%%", "known are visual.detector"),
    ],
)
def test_an_unknown_option_is_refused_with_a_suggestion(name: str, suggestion: str) -> None:
    with pytest.raises(ConfigError, match="unknown option") as caught:
        Config().replace({name: 1})
    assert suggestion in str(caught.value)
    assert repr(name) in str(caught.value)


@RANGE_ROW
@pytest.mark.parametrize("name", NUMBERS)
def test_bounds_are_inclusive_and_hold(name: str) -> None:
    spec, _ = OPTIONS[name]
    kind, low, high = type(spec.default), spec.metadata["low"], spec.metadata["high"]
    # The nearest range must stay below the farthest.
    wide = {"geometric.max_range_m": 1000.0} if name == "geometric.min_range_m" else {}
    for bound in (kind(low), kind(high)):
        changed = Config().replace({**wide, name: bound})
        assert next(value for other, _, value in changed.options() if other == name) == bound
    step = 1 if kind is int else 1e-9 + abs(high) * 1e-9
    for beyond in (kind(low) - step, kind(high) + step):
        with pytest.raises(ConfigError, match=f"{name} is .*, expected .* to ") as caught:
            Config().replace({name: beyond})
        assert spec.metadata["unit"] in str(caught.value)


@RANGE_ROW
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 10**400])
@pytest.mark.parametrize("name", ["geometric.voxel_size_m", "refinement.iterations", "seed"])
def test_what_is_no_number_of_this_world_is_refused(name: str, value: float) -> None:
    with pytest.raises(ConfigError, match=name):
        Config().replace({name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("visual.top_k", 10.0),
        ("visual.top_k", "10"),
        ("visual.top_k", True),
        ("visual.top_k", None),
        ("visual.top_k", [10]),
        ("geometric.voxel_size_m", "0.05"),
        ("geometric.voxel_size_m", True),
        ("geometric.mutual", 1),
        ("geometric.mutual", "true"),
        ("visual.detector", 3),
        ("visual.detector", "SIFT"),
        ("visual.detector", ""),
    ],
)
def test_a_value_of_another_type_or_choice_is_refused(name: str, value: Any) -> None:
    with pytest.raises(ConfigError, match=f"{name} is .*, expected ") as caught:
        Config().replace({name: value})
    assert repr(value) in str(caught.value)


@pytest.mark.hostile("Parameters: Integer for a double A")
def test_an_integer_is_accepted_for_a_real_number() -> None:
    config = Config().replace({"geometric.voxel_size_m": 1})
    assert config.geometric.voxel_size_m == 1.0
    assert isinstance(config.geometric.voxel_size_m, float)


def test_the_constructor_checks_as_replace_does() -> None:
    with pytest.raises(ConfigError, match="seed is 'abc', expected int"):
        Config(seed="abc")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"cliques\.inlier_threshold_m is nan"):
        Config(cliques=CliqueConfig(inlier_threshold_m=math.nan))
    with pytest.raises(ConfigError, match=r"sample_k is 5000\.0, expected int"):
        Config(geometric=GeometricConfig(sample_k=5000.0))  # type: ignore[arg-type]


@pytest.mark.hostile("Parameters: inconsistent set refused as a whole")
def test_an_inconsistent_set_is_refused_as_a_whole() -> None:
    config = Config()
    with pytest.raises(ConfigError, match=r"min_range_m is 9\.0 and geometric\.max_range_m is 8\.0"):
        config.replace({"geometric.min_range_m": 9.0, "visual.top_k": 10})
    with pytest.raises(ConfigError, match="the first must be below the second"):
        config.replace({"geometric.min_range_m": 8.0})
    assert config.visual.top_k == 150
    assert config.replace({"geometric.min_range_m": 9.0, "geometric.max_range_m": 10.0}).geometric.min_range_m == 9


@pytest.mark.parametrize("name", PRESETS)
def test_what_is_written_is_read_back(name: str, tmp_path: Path) -> None:
    config = Config.preset(name).replace({"seed": 3, "geometric.voxel_size_m": 1 / 30})
    assert load(tmp_path, config.to_yaml()) == config


def test_presets() -> None:
    assert Config.preset("rgbd") == Config()
    # The paper's numbers.
    for preset, numbers in {
        "rgbd": (0.025, 0.10, 5000, 150, 0.9, 10.0, 3),
        "rgbd_paper": (0.025, 0.10, 5000, 150, 0.9, 10.0, 3),
        "lidar": (0.3, 0.60, 10000, 300, 0.9, 10.0, 3),
    }.items():
        config = Config.preset(preset)
        assert numbers == (
            config.geometric.voxel_size_m,
            config.cliques.inlier_threshold_m,
            config.geometric.sample_k,
            config.visual.top_k,
            config.cliques.score_threshold,
            config.local_match.gamma_squared,
            config.local_match.iterations,
        )
    with pytest.raises(ConfigError, match=r"unknown preset 'rgb'; did you mean rgbd"):
        Config.preset("rgb")


@pytest.mark.parametrize("sensor", ["rgbd", "lidar"])
def test_the_papers_method_keeps_what_belongs_to_the_sensor(sensor: str) -> None:
    ours, papers = Config.preset(sensor), Config.preset(f"{sensor}_paper")
    changed = {name for (name, _, a), (_, _, b) in zip(ours.options(), papers.options(), strict=True) if a != b}
    assert changed == set(PAPER)


def test_a_file_starts_from_the_preset_it_names(tmp_path: Path) -> None:
    config = load(tmp_path, "preset: lidar\nvisual: {top_k: 9}\nseed: 4\n")
    assert config == Config.preset("lidar").replace({"visual.top_k": 9, "seed": 4})


def test_an_empty_file_is_the_default(tmp_path: Path) -> None:
    assert load(tmp_path, "") == load(tmp_path, "# nothing\n") == Config()


@pytest.mark.parametrize("node", ["/registrar", "/**", "registrar"])
def test_a_ros_parameter_file_holds_the_same_sections(node: str, tmp_path: Path) -> None:
    parameters = {"visual": {"top_k": 9}, "cliques.inlier_threshold_m": 1, "seed": 4}
    text = yaml.safe_dump({node: {"ros__parameters": parameters}})
    expected = Config().replace({"visual.top_k": 9, "cliques.inlier_threshold_m": 1.0, "seed": 4})
    assert load(tmp_path, text) == expected


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("- 1\n- 2\n", "expected sections of options"),
        ("just words\n", "expected sections of options"),
        ("a: [1, 2\n", "cannot be read as a YAML file"),
        ("a: !!python/object/apply:os.getcwd []\n", "cannot be read as a YAML file"),
        ("visual: 3\n", "unknown option 'visual'"),
        ("visual: {top_k: {k: 3}}\n", "unknown option 'visual.top_k.k'"),
        ("1: 2\n", "unknown option '1'"),
        ("preset: kinect\n", "unknown preset 'kinect'"),
        ("seed: " + "9" * 400 + "\n", "seed is 999"),
        ("geometric: {voxel_size_m: .nan}\n", "voxel_size_m is nan"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        load(tmp_path, text)
    assert said in str(caught.value)


def test_a_file_that_is_none_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "missing.yaml", tmp_path):
        with pytest.raises(ConfigError, match="cannot be read as a YAML file") as caught:
            Config.load(path)
        assert str(path) in str(caught.value)
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\x00garbage\x80")
    with pytest.raises(ConfigError, match="cannot be read as a YAML file"):
        Config.load(tmp_path / "bytes.yaml")


def test_a_range_that_fine_cells_cannot_cover_is_refused() -> None:
    with pytest.raises(ConfigError, match="too far for cells"):
        Config().replace({"geometric.max_range_m": 1000.0, "geometric.voxel_size_m": 0.001})
