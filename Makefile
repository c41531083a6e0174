# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
# Everything runs in .venv, which tools/bootstrap.sh makes on first use (PYTHON=python3.12 chooses another Python).

BIN := .venv/bin
BAG := bags/room_rgbd
RATE := 1
# Two processes; the tests of a module stay together, as those of a node share one.
PARALLEL := -n 2 --dist loadscope

.PHONY: help demo live test test-all lint coverage docs fuzz trials results clean
.DEFAULT_GOAL := help

help:  ## list these targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 10

demo:  ## replay the bundled bag; ends with the table of errors and the path of the report
	@tools/bootstrap.sh
	@$(BIN)/vigg replay $(BAG) --config rgbd --output vigg_replay_demo_$$(date +%Y%m%d_%H%M%S)

live:  ## the node on the bundled bag over ROS 2 from PyPI, with a live table; RATE=0.2 plays slower than real time
	@tools/bootstrap.sh ros
	@$(BIN)/vigg live $(BAG) --rate $(RATE)

test:  ## the tests but the slow ones; those skipped are listed with their reason; PYTEST_ARGS="-k name" chooses some
	@tools/bootstrap.sh dev
	@$(BIN)/python -m pytest -rs $(PARALLEL) -m "not slow" $(PYTEST_ARGS)

test-all:  ## all tests
	@tools/bootstrap.sh dev
	@$(BIN)/python -m pytest -rs $(PARALLEL) $(PYTEST_ARGS)

lint:  ## ruff, and mypy (strict but for the borders)
	@tools/bootstrap.sh dev
	@$(BIN)/python -m ruff check .
	@$(BIN)/python -m mypy

coverage:  ## as test, with a table of the lines that no test runs
	@tools/bootstrap.sh dev
	@$(BIN)/python -m pytest $(PARALLEL) -m "not slow" --cov --cov-report=term-missing $(PYTEST_ARGS)

docs:  ## the documentation as a site, in site/; a broken link is an error
	@tools/bootstrap.sh docs
	@$(BIN)/python -m mkdocs build --strict --quiet

fuzz:  ## the hostile inputs, and all properties with many more random examples
	@tools/bootstrap.sh dev
	@$(BIN)/python -m pytest -rs --hypothesis-profile=fuzz -m "hostile or hypothesis" $(PYTEST_ARGS)

trials:  ## 10,000 registrations whose matches are all wrong: how many are answered
	@tools/bootstrap.sh dev
	@VIGG_TRIALS=0:10000 $(BIN)/python -m pytest -s -k matches_that_are_all_wrong test/registration/test_register_refuses.py

results:  ## measure what docs/results.md shows (40 minutes on two cores; goes on where it was stopped), and write it
	@tools/bootstrap.sh evaluation
	@$(BIN)/python tools/results.py $(RESULTS_ARGS)

clean:  ## remove what these targets made, .venv and the demo's reports included
	rm -rf .venv build install log site vigg_replay_demo_* *.egg-info .coverage
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
