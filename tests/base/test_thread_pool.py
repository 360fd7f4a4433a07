"""Work is done once, by whoever comes first, and the results keep their order."""

import threading

import pytest

from mocapdb.base.thread_pool import ThreadPool


@pytest.mark.parametrize("size", [1, 2, 5])
@pytest.mark.parametrize("n", [0, 1, 100])
def test_every_item_once_and_in_order(size, n):
    done = []

    def work(item):
        done.append(item)
        return item * item

    assert ThreadPool(size).map(work, range(n)) == [item * item for item in range(n)]
    assert sorted(done) == list(range(n))


def test_others_take_part():
    meeting = threading.Barrier(3, timeout=120)

    def who(_):
        meeting.wait()
        return threading.get_ident()

    assert len(set(ThreadPool(3).map(who, range(3)))) == 3


def test_nobody_waits_for_a_thread_that_is_busy_with_other_work():
    pool, is_free = ThreadPool(2), threading.Event()
    pool._others.submit(is_free.wait, 120)
    assert pool.map(str, [1, 2, 3]) == ["1", "2", "3"]
    assert not is_free.is_set()
    is_free.set()


@pytest.mark.parametrize("size", [1, 3])
def test_a_problem_is_raised(size):
    with pytest.raises(ZeroDivisionError):
        ThreadPool(size).map(lambda item: 1 // item, [1, 1, 0, 1])


def test_searches_share_the_threads():
    assert ThreadPool.shared(2) is ThreadPool.shared(2)
