# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executable ``registrar``, as long as there is no node behind it."""

import pytest

from vigg_ros.node import main


def test_it_says_that_the_node_comes_later_and_fails(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "later release" in err
    assert "vigg replay" in err


def test_arguments_that_ros2_run_adds_do_not_hide_that_message(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--ros-args", "-r", "__node:=front"]) == 2
    assert "later release" in capsys.readouterr().err


def test_help_says_it_too(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    assert "vigg replay" in capsys.readouterr().out
