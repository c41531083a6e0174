# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options: read, changed, refused and written; a refusal says what was found, and changes nothing."""

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from vigg_ros.registration import Config, ConfigError
from vigg_ros.registration.config import PAPER, PRESETS
from vigg_ros.registration.options import CliqueConfig

OPTIONS = {name: (spec, value) for name, spec, value in Config().options()}
NUMBERS = [name for name, (spec, _) in OPTIONS.items() if type(spec.default) in (int, float)]
RANGE_ROW = pytest.mark.hostile("Parameters: NaN or out of range F, or refused at run time with the old value kept")


def load(tmp_path: Path, text: str) -> Config:
    path = tmp_path / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return Config.load(path)


def changed_options(before: Config, after: Config) -> set[str]:
    return {name for (name, _, a), (_, _, b) in zip(before.options(), after.options(), strict=True) if a != b}


@pytest.mark.parametrize("name", OPTIONS)
def test_every_option_says_what_it_is_for(name: str) -> None:
    spec, value = OPTIONS[name]
    assert len(spec.metadata["doc"]) > 15
    assert value == spec.default
    if type(spec.default) in (int, float):
        assert -math.inf < spec.metadata["low"] <= spec.default <= spec.metadata["high"] < math.inf
    elif not isinstance(spec.default, bool):
        assert spec.default in (spec.metadata["choices"] or ("",))  # free text is empty by default
    assert name.endswith("_m") == (spec.metadata["unit"] in ("m", "m/m"))
    assert name.endswith("_per_m") == (spec.metadata["unit"] == "m/m")


def test_replace_changes_what_it_names_and_nothing_else() -> None:
    before = Config()
    after = before.replace({"visual.top_k": 77, "seed": 5, "cliques.inlier_threshold_m": 0.3})
    assert (after.visual.top_k, after.seed, after.cliques.inlier_threshold_m) == (77, 5, 0.3)
    assert changed_options(before, after) == {"visual.top_k", "seed", "cliques.inlier_threshold_m"}
    assert before == Config()
    assert before.replace({}) == before


@pytest.mark.hostile("Parameters: unknown key F with a suggestion")
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
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("visual.top_k", [10.0, "10", True, None, [10], math.nan, math.inf, 10**400]),
        ("geometric.voxel_size_m", ["0.05", True, math.nan, -math.inf, 10**400]),
        ("geometric.mutual", [1, "true"]),
        ("visual.detector", [3, "SIFT", ""]),
    ],
)
def test_a_value_of_another_type_or_choice_or_that_is_no_number_is_refused(name: str, values: list[Any]) -> None:
    for value in values:
        with pytest.raises(ConfigError, match=f"{name} is .*, expected ") as caught:
            Config().replace({name: value})
        assert repr(value)[:50] in str(caught.value)


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


@pytest.mark.hostile("Parameters: inconsistent set refused as a whole")
def test_an_inconsistent_set_is_refused_as_a_whole() -> None:
    config = Config()
    with pytest.raises(ConfigError, match=r"min_range_m is 9\.0 and geometric\.max_range_m is 8\.0"):
        config.replace({"geometric.min_range_m": 9.0, "visual.top_k": 10})
    with pytest.raises(ConfigError, match="the first must be below the second"):
        config.replace({"geometric.min_range_m": 8.0})
    with pytest.raises(ConfigError, match="too far for cells"):
        config.replace({"geometric.max_range_m": 1000.0, "geometric.voxel_size_m": 0.001})
    assert config.visual.top_k == 150
    assert config.replace({"geometric.min_range_m": 9.0, "geometric.max_range_m": 10.0}).geometric.min_range_m == 9


@pytest.mark.parametrize("name", PRESETS)
def test_what_is_written_is_read_back(name: str, tmp_path: Path) -> None:
    config = Config.preset(name).replace({"seed": 3, "geometric.voxel_size_m": 1 / 30})
    assert load(tmp_path, config.to_yaml()) == config


def test_presets_have_the_papers_numbers() -> None:
    assert Config.preset("rgbd") == Config()
    expected = {
        "geometric.voxel_size_m": (0.025, 0.3),
        "cliques.inlier_threshold_m": (0.10, 0.60),
        "geometric.sample_k": (5000, 10000),
        "visual.top_k": (150, 300),
        "cliques.score_threshold": (0.9, 0.9),
        "local_match.gamma_squared": (10.0, 10.0),
        "local_match.iterations": (3, 3),
    }
    for place, preset in enumerate(("rgbd_paper", "lidar")):
        values = {name: value for name, _, value in Config.preset(preset).options()}
        assert {name: values[name] for name in expected} == {name: both[place] for name, both in expected.items()}
    with pytest.raises(ConfigError, match=r"unknown preset 'rgb'; did you mean rgbd"):
        Config.preset("rgb")


def test_what_is_counted_in_voxels_follows_the_voxel_size() -> None:
    """A preset that set it apart would part the two scales."""
    apart = changed_options(Config.preset("rgbd"), Config.preset("lidar"))
    assert not [name for name in apart if name.endswith("_voxels")]


@pytest.mark.parametrize("sensor", ["rgbd", "lidar"])
def test_the_papers_method_keeps_what_belongs_to_the_sensor(sensor: str) -> None:
    ours, papers = Config.preset(sensor), Config.preset(f"{sensor}_paper")
    assert changed_options(ours, papers) == set(PAPER)


PARAMETERS = {"ros__parameters": {"visual": {"top_k": 9}, "cliques.inlier_threshold_m": 1, "seed": 4}}
CHANGED = Config().replace({"visual.top_k": 9, "cliques.inlier_threshold_m": 1.0, "seed": 4})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", Config()),
        ("# nothing\n", Config()),
        ("preset: lidar\nvisual: {top_k: 9}\n", Config.preset("lidar").replace({"visual.top_k": 9})),
        *((yaml.safe_dump({node: PARAMETERS}), CHANGED) for node in ("/registrar", "/**", "registrar")),
    ],
)
def test_a_file_changes_its_preset_or_the_default_and_may_be_one_for_ros(text, expected, tmp_path) -> None:
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
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\x00garbage\x80")
    for path in (tmp_path / "missing.yaml", tmp_path, tmp_path / "bytes.yaml"):
        with pytest.raises(ConfigError, match=f"{path}.* cannot be read as a YAML file"):
            Config.load(path)


def test_the_old_name_of_a_section_works_with_a_note() -> None:
    with pytest.warns(FutureWarning, match=r"verification\.min_overlap is called acceptance\.min_overlap now"):
        config = Config().replace({"verification.min_overlap": 0.2})
    assert config.acceptance.min_overlap == 0.2
    with pytest.warns(FutureWarning), pytest.raises(ConfigError, match="by its old name too"):
        Config().replace({"acceptance.min_overlap": 0.2, "verification.min_overlap": 0.3})


def test_the_off_of_yaml_is_a_choice_of_that_name_and_no_other(tmp_path: Path) -> None:
    """YAML reads off as false, in files and in --set alike."""
    (tmp_path / "off.yaml").write_text("input:\n  own_body: off\n")
    assert Config.load(tmp_path / "off.yaml").input.own_body == "off"
    for changes in ({"input.own_body": True}, {"visual.detector": False}):
        with pytest.raises(ConfigError, match="expected str"):
            Config().replace(changes)


@pytest.mark.parametrize("section", ["acceptance", "verification"])
def test_an_option_that_is_gone_says_what_takes_its_place(section: str) -> None:
    with pytest.raises(ConfigError, match=r"min_inliers is no option any more; acceptance\.max_false_alarms"):
        Config().replace({f"{section}.min_inliers": 8})
