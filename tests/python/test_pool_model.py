# SPDX-License-Identifier: GPL-3.0-or-later
"""A model of the thread pool (native/sinew/base/thread_pool.cpp): tries every order in which its threads
can take their steps, for a caller that runs a few jobs and ends the threads in between.

It answers whether a wake-up can be lost, so that a thread sleeps forever. It can not with a wait that
compares and falls asleep in one step, as C++ defines std::atomic::wait. It can with libstdc++ 12 where there
is no futex, such as under mingw: this compares first, and then locks the mutex of the condition variable
that it sleeps on (docs/install.md describes the other faults there).

One step is one access to shared memory. Memory orders, which make writes visible to other threads, are not
in the model: the thread sanitizer checks them, in ./dev test.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

CHUNKS = 2  # of every job


class Worker(NamedTuple):
    """at: the next step. seen: value of the bell; last_job: as in serve()."""

    at: str = "none"
    seen: int = 0
    last_job: int = 0


class State(NamedTuple):
    """caller: its next step; phase: index into the plan; came, done_seen: locals of run()."""

    workers: tuple[Worker, ...]
    caller: str = "begin"
    phase: int = 0
    came: int = 0
    done_seen: int = 0
    job: int = 0
    slots: int = 0
    bell: int = 0
    done: int = 0
    left: int = 0
    ending: bool = False


class BrokenError(Exception):
    pass


END = 0


# One case for each step of the pool.
def caller_steps(  # noqa: C901, PLR0912
    state: State, plan: tuple[int, ...], is_one_step: bool
) -> Iterator[State]:
    """plan: for each call the number of helpers, or END for end_threads()."""
    if state.phase == len(plan):
        return
    helpers = plan[state.phase]
    match state.caller:
        case "begin" if helpers == END:
            yield state._replace(caller="ring", ending=True)
        case "begin":
            if any(worker.at in ("chunks", "count") for worker in state.workers):
                raise BrokenError("a worker is still in the last job")
            if state.left:
                raise BrokenError("a job ended with chunks that nobody took")
            workers = [
                Worker("look") if worker.at == "none" and index < helpers else worker
                for index, worker in enumerate(state.workers)
            ]
            yield state._replace(workers=tuple(workers), caller="open", left=CHUNKS, done=0)
        case "open":
            yield state._replace(caller="ring", job=state.job + 1, slots=helpers)
        case "ring":
            yield state._replace(caller="wake", bell=state.bell + 1)
        case "wake":
            woken = [w._replace(at="look") if w.at == "asleep" else w for w in state.workers]
            yield state._replace(caller="join" if helpers == END else "chunks", workers=tuple(woken))
        case "join":
            if all(worker.at in ("gone", "none") for worker in state.workers):
                none = tuple(Worker() for _ in state.workers)
                yield state._replace(caller="begin", phase=state.phase + 1, ending=False, workers=none)
        case "chunks" if state.left:
            yield state._replace(left=state.left - 1)
        case "chunks":
            yield state._replace(caller="close")
        case "close":
            yield state._replace(caller="count", came=helpers - state.slots, slots=0)
        case "count" if state.done == state.came:
            yield state._replace(caller="begin", phase=state.phase + 1, came=0, done_seen=0)
        case "count":
            yield state._replace(caller="wait", done_seen=state.done)
        case "wait" if state.done != state.done_seen:
            yield state._replace(caller="count")
        case "wait":
            yield state._replace(caller="asleep" if is_one_step else "falls asleep")
        case "falls asleep":
            yield state._replace(caller="asleep")


def worker_steps(state: State, index: int, is_one_step: bool) -> Iterator[State]:  # noqa: C901
    worker = state.workers[index]

    def become(at: str, **changes: int) -> State:
        own = {name: changes.pop(name) for name in ("seen", "last_job") if name in changes}
        after = worker._replace(at=at, **own)
        return state._replace(workers=(*state.workers[:index], after, *state.workers[index + 1 :]), **changes)

    match worker.at:
        case "look":
            yield become("slot", seen=state.bell)
        case "slot" if state.slots and state.job != worker.last_job:
            yield become("chunks", slots=state.slots - 1, last_job=state.job)
        case "slot":
            yield become("ending")
        case "chunks" if state.left:
            yield become("chunks", left=state.left - 1)
        case "chunks":
            yield become("count")
        case "count":
            yield become("wake", done=state.done + 1)
        case "wake":
            woken = {"caller": "wait"} if state.caller == "asleep" else {}
            yield become("ending")._replace(**woken)
        case "ending":
            yield become("gone" if state.ending else "wait")
        case "wait" if state.bell != worker.seen:
            yield become("look")
        case "wait":
            yield become("asleep" if is_one_step else "falls asleep")
        case "falls asleep":
            yield become("asleep")


def explore(plan: tuple[int, ...], *, is_one_step: bool) -> tuple[int, list[State]]:
    """The number of reachable states, and those in which no thread can continue although the plan is not
    done."""
    start = State(tuple(Worker() for _ in range(max(plan))))
    seen, unvisited, stuck = {start}, [start], []
    while unvisited:
        state = unvisited.pop()
        after = list(caller_steps(state, plan, is_one_step))
        for index in range(len(state.workers)):
            after += worker_steps(state, index, is_one_step)
        if not after and state.phase < len(plan):
            stuck.append(state)
        for following in after:
            if following not in seen:
                seen.add(following)
                unvisited.append(following)
    return len(seen), stuck


# Several jobs, with the same number of helpers and with fewer; threads ended between jobs, and twice.
PLANS = ((1, 1, 1, END, 1, END, END), (2, 2, END), (2, 1), (1, 2, END, 1))


def test_no_order_of_steps_loses_a_wake_up():
    for plan in PLANS:
        count, stuck = explore(plan, is_one_step=True)
        assert count > 100
        assert not stuck, (plan, stuck[0])


def test_a_wait_of_two_steps_sleeps_for_ever():
    for plan in PLANS:
        _count, stuck = explore(plan, is_one_step=False)
        callers = {state.caller for state in stuck}
        # The caller sleeps although all are done, or waits for a worker that slept through the end.
        assert "asleep" in callers, plan
        assert ("join" in callers) == (END in plan)
