"""Cores and threads at hand."""

import os
import subprocess
import sys
import threading

import pytest

from glsk_o3d.geometry.cores import cores, in_threads, threads


def test_cores_are_those_that_may_be_used():
    assert cores() == len(os.sched_getaffinity(0))
    one = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})"
    code = f"{one}; from glsk_o3d.geometry.cores import cores; print(cores())"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "1\n"


@pytest.mark.parametrize(
    ("said", "expected"),
    [("1", 1), ("7", 7), (" 3 ", 3), ("4,2", 4), ("", None), ("0", None), ("-2", None), ("all", None)],
)
def test_threads_are_as_many_as_openmp_may_use(said, expected, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", said)
    assert threads() == (expected or cores())


@pytest.mark.parametrize("n", [1, 3])
def test_threads_give_results_in_order_and_take_few_items_ahead(n, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", str(n))
    taken = []

    def items():
        for number in range(20):
            taken.append(number)
            yield number

    for k, made in enumerate(in_threads(lambda number: number**2, items())):
        assert made == k**2
        assert len(taken) <= k + 1 + (n if n > 1 else 0)
    assert len(taken) == 20


@pytest.mark.parametrize("n", [1, 3])
def test_an_error_in_a_thread_is_raised(n, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", str(n))
    results = in_threads(lambda number: 6 // number, [3, 0, 1])
    assert next(results) == 2
    with pytest.raises(ZeroDivisionError):
        next(results)


def test_an_interpreter_that_ends_goes_on_without_threads():
    code = (
        "import atexit; from glsk_o3d.geometry.cores import in_threads\n"
        "atexit.register(lambda: print(*in_threads(abs, [-1, -2])))"
    )
    env = os.environ | {"OMP_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env)
    assert (done.stdout, done.stderr) == ("1 2\n", "")


@pytest.mark.parametrize("n", [1, 3])
def test_a_caller_that_stops_early_does_not_wait_for_tasks_that_have_not_begun(n, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", str(n))
    begun, go_on = [], threading.Event()

    def wait(number):
        begun.append(number)
        if number:
            go_on.wait(10)
        return number

    results = in_threads(wait, range(20), 2)
    assert next(results) == 0
    go_on.set()
    results.close()
    assert len(begun) <= 4


def test_threads_are_no_more_than_asked_for(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "5")
    names = set(in_threads(lambda _: threading.current_thread().name, range(50), 2))
    assert len(names) <= 2
    assert set(in_threads(lambda _: threading.current_thread(), range(3), 1)) == {threading.current_thread()}
