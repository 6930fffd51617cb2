"""A sheet for raters, and how far two of them agree: by hand, and what is refused."""

import csv

import numpy as np
import pytest
from glsk_bench import draw_sheet, kappa, rates
from matplotlib.image import imread

from glsk_o3d.errors import FileFormatError, InvalidParameterError

WORDS = ("accept", "edit", "reject")


def answered(path, answers, first="number,cloud,answer"):
    path.write_text(f"{first}\n" + "".join(f"{i},c{i},{word}\n" for i, word in enumerate(answers, 1)))
    return path


def pairs(counts):
    """Answers of two raters of which so many are of each pair of words."""
    places = [(i, j) for i, row in enumerate(counts) for j, n in enumerate(row) for _ in range(n)]
    return [[WORDS[place[side]] for place in places] for side in (0, 1)]


class TestKappa:
    @pytest.mark.parametrize(
        ("counts", "expected"),
        [  # (agree - chance) / (1 - chance)
            ([[20, 5], [10, 15]], (0.7 - 0.5) / (1 - 0.5)),
            ([[45, 15], [25, 15]], (0.6 - 0.54) / (1 - 0.54)),
            ([[4, 1, 0], [1, 2, 1], [0, 0, 1]], (0.7 - (0.5 * 0.5 + 0.4 * 0.3 + 0.1 * 0.2)) / (1 - 0.39)),
            ([[0, 3], [3, 0]], -1.0),
            ([[5, 0], [0, 5]], 1.0),
        ],
    )
    def test_closed_forms(self, counts, expected):
        assert kappa(*pairs(counts)) == pytest.approx(expected, abs=1e-12)

    def test_independent_raters_agree_as_by_chance(self):
        rng = np.random.default_rng(0)
        first, second = (rng.choice(WORDS, 20_000, p=p) for p in ([0.7, 0.2, 0.1], [0.5, 0.2, 0.3]))
        assert abs(kappa(first, second)) < 0.02  # four standard errors are .02

    def test_any_one_answer_says_nothing(self):
        assert kappa(["edit"] * 3, ["edit"] * 3) is None

    @pytest.mark.parametrize("said", [([], []), (["edit"], ["edit", "edit"])])
    def test_unequal_numbers_are_refused(self, said):
        with pytest.raises(InvalidParameterError, match="as many answers"):
            kappa(*said)


class TestRates:
    def test_two_tables(self, tmp_path):
        first = answered(tmp_path / "a.csv", ["accept", "Accept ", "edit", "reject"])
        lines = answered(tmp_path / "b.csv", ["accept", "edit", "edit", "edit"]).read_text().splitlines()
        second = tmp_path / "c.csv"  # the order of the rows, and what a spreadsheet puts first, do not count
        second.write_text("\n".join([lines[0], *lines[:0:-1]]), encoding="utf-8-sig")
        found = rates(first, second)
        assert (found["clouds"], found["both"], found["agree"]) == (4, 0.25, 0.5)
        assert [found[word] for word in WORDS] == [[0.5, 0.25], [0.25, 0.75], [0.25, 0.0]]
        assert found["kappa"] == pytest.approx((0.5 - (0.5 * 0.25 + 0.25 * 0.75)) / (1 - 0.3125))

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("", "not the table of a sheet"),
            ("a,b\n1,2\n", "not the table of a sheet"),
            ("number,cloud,answer\n1,c1,\n", "the answer to c1 is none of accept, edit, reject"),
            ("number,cloud,answer\n1,c1\n", "the answer to c1 is none of"),
            ("number,cloud,answer\n1,c1,edit\n2,c1,edit\n", "twice"),
        ],
    )
    def test_what_is_no_table_is_told(self, tmp_path, text, message):
        (tmp_path / "a.csv").write_text(text)
        with pytest.raises(FileFormatError, match=f"a.csv: .*{message}"):
            rates(tmp_path / "a.csv", tmp_path / "a.csv")

    def test_other_clouds_are_refused(self, tmp_path):
        one, two = answered(tmp_path / "a.csv", ["edit"]), answered(tmp_path / "b.csv", ["edit", "edit"])
        with pytest.raises(InvalidParameterError, match="different clouds"):
            rates(one, two)


def test_a_sheet_has_the_clouds_that_its_seed_takes(small, perfect, tmp_path):
    names = {cloud.name for cloud in small.scored}
    clouds = draw_sheet(small, perfect, tmp_path / "a.png", n=5, seed=3)
    assert len({*clouds} & names) == 5
    with (tmp_path / "a.csv").open() as stream:
        rows = [*csv.DictReader(stream)]
    assert [(row["number"], row["cloud"], row["answer"]) for row in rows] == [
        (str(i), name, "") for i, name in enumerate(clouds, 1)
    ]
    assert draw_sheet(small, perfect, tmp_path / "b.png", n=5, seed=3) == clouds
    assert draw_sheet(small, perfect, tmp_path / "c.png", n=5, seed=4) != clouds
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert {*draw_sheet(small, perfect, tmp_path / "all.png", n=99)} == names
    height, width, _ = imread(tmp_path / "a.png").shape  # two rows of four, each of two pictures
    assert width > 3 * height


def test_a_cloud_without_an_answer_is_drawn_alone(small, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "tubes_100_clean.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    assert len(draw_sheet(small, tmp_path / "mine", tmp_path / "a.png", n=99)) == len(small.scored)
    for n in (0, 101):
        with pytest.raises(InvalidParameterError, match=f"n = {n}"):
            draw_sheet(small, tmp_path / "mine", tmp_path / "b.png", n=n)
    assert not (tmp_path / "b.png").exists()
