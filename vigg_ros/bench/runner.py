# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs methods on pairs, in processes of one core each, and skips what is measured already."""

from __future__ import annotations

import hashlib
import math
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice

import cv2

from vigg_ros.bench.alternatives import refine_truth
from vigg_ros.bench.catalogue import find_method
from vigg_ros.bench.frame_cache import FrameCache
from vigg_ros.bench.methods import MethodAnswer, Task
from vigg_ros.bench.pair_results import PairResult, ResultFile
from vigg_ros.bench.pairs import FramePair
from vigg_ros.bench.reliability import nees
from vigg_ros.registration import BagError, Config, DataError, ViggError
from vigg_ros.report.trajectory_errors import rotation_error_deg, translation_error_m

PAIRS_PER_BATCH = 3
"""Neighbouring pairs given to a process at once: they share frames, whose features it keeps."""


@dataclass(frozen=True, slots=True)
class EvaluationPlan:
    """What to run."""

    subject: str
    """What the pairs are taken from; results of another subject are left alone."""
    pairs: Sequence[FramePair]
    methods: Sequence[str]
    """By name, see ``catalogue.find_method``."""
    config: Config
    within_view: bool = False
    refine_truth: bool = False

    def keys(self) -> dict[tuple[str, str], str]:
        """Of each method and pair, by their names, the key of the result: it changes with all that it depends on."""
        conditions = f"{self.subject} {self.within_view} {self.refine_truth}".encode()
        prints = {name: find_method(name).fingerprint(self.config) for name in self.methods}
        pairs = {
            pair.name: hashlib.sha256(conditions + pair.T_target_source.tobytes()).hexdigest()[:16]
            for pair in self.pairs
        }
        return {(name, pair): f"{prints[name]} {pairs[pair]} {pair}" for name in self.methods for pair in pairs}


@dataclass(frozen=True, slots=True)
class Batch:
    """Some pairs of a plan, and which methods are still to be run on each."""

    plan: EvaluationPlan
    pairs: Sequence[tuple[FramePair, Sequence[str]]]


def count_missing(plan: EvaluationPlan, file: ResultFile) -> int:
    """How many results of the plan are not in the file yet."""
    return sum(file.get(key) is None for key in plan.keys().values())


def run_plan(plan: EvaluationPlan, file: ResultFile, *, jobs: int, step: Callable[[], None]) -> list[PairResult]:
    """All results in the order of methods and pairs; each new one is appended to the file, then step is called.

    Each process keeps to one core, which makes the times of methods comparable and the answers of libraries
    repeatable. Raises ViggError when a process died.
    """
    keys = plan.keys()
    batches = list(_batches(plan, lambda names: file.get(keys[names]) is None))
    if batches:
        for result, names in _answered(batches, jobs):
            file.add(keys[names], result)
            step()
    found = [file.get(key) for key in keys.values()]
    return [result for result in found if result is not None]


def _batches(plan: EvaluationPlan, is_missing: Callable[[tuple[str, str]], bool]) -> Iterator[Batch]:
    """The missing results, pairs with the same source next to each other."""
    order = {name: i for i, name in enumerate(dict.fromkeys(pair.source.name for pair in plan.pairs))}
    todo = []
    for pair in sorted(plan.pairs, key=lambda pair: order[pair.source.name]):
        methods = [name for name in plan.methods if is_missing((name, pair.name))]
        if methods:
            todo.append((pair, methods))
    rest = iter(todo)
    while batch := list(islice(rest, PAIRS_PER_BATCH)):
        yield Batch(replace(plan, pairs=()), batch)


def _answered(batches: Sequence[Batch], jobs: int) -> Iterator[tuple[PairResult, tuple[str, str]]]:
    # Spawned, not forked: the libraries have threads by now. Their number is settled when they are loaded.
    context = multiprocessing.get_context("spawn")
    cores = context.Queue()
    available = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
    for number in range(jobs):
        cores.put(available[number % len(available)])
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=keep_to_core, initargs=(cores,))
    with one_thread_each(), pool:
        futures: list[Future[list[tuple[PairResult, tuple[str, str]]]]] = []
        try:
            futures = [pool.submit(run_batch, batch) for batch in batches]
            for future in as_completed(futures):
                yield from future.result()
        except BrokenProcessPool as error:
            raise ViggError("a process died, perhaps for want of memory; what is done is kept: run it again") from error
        finally:
            for future in futures:
                future.cancel()


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Processes started inside the block load their linear algebra for one thread."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ[name] for name in names if name in os.environ}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name in names:
            del os.environ[name]
        os.environ.update(before)


def keep_to_core(cores: multiprocessing.Queue[int]) -> None:
    """Let this process use one core of the queue, where the system can do that."""
    core = cores.get()
    cv2.setNumThreads(1)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})


_caches: dict[bool, FrameCache] = {}
"""Of this process, by whether scans are clipped: kept from batch to batch."""


def run_batch(batch: Batch) -> list[tuple[PairResult, tuple[str, str]]]:
    """The results of some pairs, with the names of method and pair."""
    plan = batch.plan
    if not _caches:
        # The first use of everything loads and compiles; it is not what is to be measured.
        pair, methods = batch.pairs[0]
        run_pair(pair, methods, plan, FrameCache(within_view=plan.within_view))
    cache = _caches.setdefault(plan.within_view, FrameCache(within_view=plan.within_view))
    done = []
    starter = multiprocessing.parent_process()
    for pair, methods in batch.pairs:
        if starter is not None and not starter.is_alive():
            break  # nobody waits for the rest
        results = run_pair(pair, methods, plan, cache)
        done += [(result, (result.method, pair.name)) for result in results]
    return done


def run_pair(pair: FramePair, methods: Sequence[str], plan: EvaluationPlan, cache: FrameCache) -> list[PairResult]:
    """What the methods answer; a frame that cannot be used costs its pairs, not the run."""
    try:
        for frame in (pair.target, pair.source):
            cache.frame(frame)
        true = refine_truth(Task(pair, cache, plan.config)) if plan.refine_truth else pair
        return [_measured(name, true, find_method(name).answer(Task(true, cache, plan.config))) for name in methods]
    except DataError as error:
        code = error.code
    except BagError:
        code = "UNREADABLE"
    return [_measured(name, pair, MethodAnswer(None, code, {})) for name in methods]


def _measured(method: str, pair: FramePair, answer: MethodAnswer) -> PairResult:
    T_truth, T_answer = pair.T_target_source, answer.T_target_source
    errors, squared = (math.inf, math.inf), math.nan
    if T_answer is not None:
        errors = rotation_error_deg(T_truth, T_answer), translation_error_m(T_truth, T_answer)
        if answer.covariance is not None:
            squared = nees(T_truth, T_answer, answer.covariance)
    timings_ms = {name: round(ms, 2) for name, ms in answer.timings_ms.items()}
    names = pair.target.name, pair.source.name
    return PairResult(method, pair.group, *names, answer.reason, *errors, pair.overlap, squared, timings_ms)
