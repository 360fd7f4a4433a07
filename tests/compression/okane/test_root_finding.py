import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.compression.okane.root_finding import Ranking, fewest


@given(
    errors=st.lists(st.floats(0, 1e6), min_size=1, max_size=300),
    allowed=st.floats(0, 1e6),
    data=st.data(),
)
def test_finds_what_a_linear_search_finds(errors, allowed, data):
    errors = sorted(errors, reverse=True)
    most = len(errors) - 1
    least = data.draw(st.integers(0, most))
    expected = next((n for n in range(least, most + 1) if errors[n] <= allowed), None)
    assert fewest(lambda count: errors[count], allowed, most, least=least) == expected


@given(errors=st.lists(st.floats(0, 10), min_size=1, max_size=100), allowed=st.floats(0, 10))
def test_where_the_error_wobbles_the_answer_is_still_allowed(errors, allowed):
    count = fewest(lambda n: errors[n], allowed, len(errors) - 1)
    if count is None:
        assert errors[-1] > allowed
    else:
        assert errors[count] <= allowed


def test_slack_stops_close_above_the_answer():
    tested = []

    def error(count):
        tested.append(count)
        return 1e4 / (count + 1)

    exact = fewest(error, 1.0, 10**6)
    n_exact = len(tested)
    tested.clear()
    rough = fewest(error, 1.0, 10**6, slack=0.01)
    assert exact == 10**4 - 1
    assert exact <= rough <= exact * 1.011
    assert len(tested) < n_exact < 40


def test_one_threshold_for_the_whole_matrix():
    matrix = np.array([[5.0, 0.1], [-4.0, 0.2], [3.0, 6.0]])
    ranking = Ranking(matrix)
    expected = np.array([[5.0, 0.0], [-4.0, 0.0], [0.0, 6.0]])
    np.testing.assert_array_equal(ranking.largest(3), expected)
    np.testing.assert_array_equal(ranking.largest(0), np.zeros((3, 2)))
    np.testing.assert_array_equal(ranking.largest(6), matrix.astype(np.float32))


@pytest.mark.parametrize("shape", [(0, 3), (3, 0)])
def test_an_empty_matrix_has_nothing_to_rank(shape):
    assert len(Ranking(np.zeros(shape))) == 0
    assert Ranking(np.zeros(shape)).largest(0).shape == shape


@pytest.mark.parametrize(("answer", "second"), [(1100, 1150), (900, 850)])
def test_near_a_guess_counts_are_tested_first(answer, second):
    """Then 15 % above or below it, whichever is on the other side of the answer."""
    tested = []

    def error(count):
        tested.append(count)
        return 1.0 if count < answer else 0.0

    assert fewest(error, 0.5, 10**6, guess=1000) == answer
    assert tested[:2] == [1000, second]
