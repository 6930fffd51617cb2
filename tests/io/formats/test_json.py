import json

import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.skeletons import read_skeleton


def test_json_is_strict_and_says_what_it_is(tree, tmp_path):
    tree.save(tmp_path / "s.json")

    def refuse(word):
        raise AssertionError(word)

    values = json.loads((tmp_path / "s.json").read_text(), parse_constant=refuse)
    assert (values["format"], values["format_version"]) == ("glsk-o3d skeleton", 1)
    assert values["points"][0] == [None] * 3
    assert values["points"][1] == ["Infinity", "-Infinity", -0.0]
    numbers = [*values["report"]["iterations"][0].values()]
    assert None in numbers
    assert "Infinity" in numbers


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "[" * 100_000,
        "{",
    ],
)
def test_damaged_files(tmp_path, text):
    (tmp_path / "s.json").write_text(text, encoding="latin-1")
    with pytest.raises(FileFormatError, match=r"s\.json"):
        read_skeleton(tmp_path / "s.json")
