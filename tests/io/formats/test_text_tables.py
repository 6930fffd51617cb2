"""Clouds as text, as other programs write them."""

import numpy as np
import pytest

from glsk_o3d import read_cloud, read_tensor_cloud
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats.text_tables import holds_points
from glsk_o3d.io.scans import read_scan

XYZ = [[1.5, 2, 3], [4, 5.25, 6]]

ROWS = ["1.5 2 3 255 0 51 0.5 0 0 1", "4 5.25 6 0 255 0 7 0 1 0"]
LAYOUTS = {  # the ending, the line of names, and the delimiter
    "CloudCompare": (".asc", "//X Y Z R G B Scalar_field Nx Ny Nz\n2", " "),
    "CloudCompare, csv": (".csv", "//X,Y,Z,R,G,B,Scalar field,Nx,Ny,Nz", ","),
    "pandas": (".csv", "x,y,z,red,green,blue,Scalar field,nx,ny,nz", ","),
    "R, quoted": (".csv", '"X","Y","Z","R","G","B","Scalar field","nx","ny","nz"', ","),
    "a map": (".txt", "easting northing height red green blue Scalar_field nx ny nz", "\t"),
}


RANDOM = np.random.default_rng(4)


@pytest.mark.parametrize("program", LAYOUTS)
def test_named_columns(tmp_path, program):
    ending, names, delimiter = LAYOUTS[program]
    name = f"c{ending}"
    names = names.replace(" ", "\t") if delimiter == "\t" else names
    (tmp_path / name).write_text("\n".join([names, *(row.replace(" ", delimiter) for row in ROWS), ""]))
    scan = read_scan(tmp_path / name)
    np.testing.assert_array_equal(scan.positions, XYZ)
    np.testing.assert_allclose(scan.colors, [[1, 0, 0.2], [0, 1, 0]])
    np.testing.assert_array_equal(scan.normals, [[0, 0, 1], [0, 1, 0]])
    assert {key: values.tolist() for key, values in scan.attributes.items()} == {"Scalar_field": [0.5, 7]}
    assert holds_points(tmp_path / name)


@pytest.mark.parametrize("line", ["1 2 3", "1, 2, 3", "P1 1 2 3"])
def test_columns_without_names(tmp_path, line):
    (tmp_path / "c.xyz").write_text(f"3\n{line}\n{line}\n")  # a count of points is no point
    scan = read_scan(tmp_path / "c.xyz")
    np.testing.assert_array_equal(scan.positions, [[1, 2, 3]] * 2)
    assert (scan.colors, scan.normals, scan.attributes) == (None, None, {})


def test_all_digits_stay(tmp_path):
    place = [471234.56789012345, 5612345.678901234, 1234.5678901234567]
    for name, text in (("c.csv", "{!r},{!r},{!r}\n"), ("c.xyz", "{!r} {!r} {!r}\n")):
        (tmp_path / name).write_text(text.format(*place))
        np.testing.assert_array_equal(np.asarray(read_cloud(tmp_path / name).points), [place])


def test_lines_that_are_not_like_the_others(tmp_path, caplog):
    (tmp_path / "c.csv").write_text("x,y,z,label\n1,2,3,4\n\n# pause\n5,6\n7,8,9,\n1,2,oak,4\n10,11,12,13,14\n")
    scan = read_scan(tmp_path / "c.csv")
    np.testing.assert_array_equal(scan.positions, [[1, 2, 3], [7, 8, 9], [10, 11, 12]])
    np.testing.assert_array_equal(scan.attributes["label"], [4, np.nan, 13])
    assert "c.csv: 2 of 5 lines hold no point" in caplog.text


def test_a_last_line_that_breaks_off_is_no_point(tmp_path, caplog):
    """Its last number may have been longer; with an end, or all its columns, it is as it was meant."""
    for last, points in (("7,8,1", 2), ("7,8,1\n", 3), ("7,8,1,4", 3), ("7,8,1,", 3)):
        (tmp_path / "c.csv").write_text(f"x,y,z,i\n1,2,3,4\n2,3,4,5\n{last}")
        assert len(read_scan(tmp_path / "c.csv").positions) == points
    assert caplog.text.count("c.csv: 1 of 3 lines hold no point") == 1


def test_attributes_become_those_of_a_tensor_cloud(tmp_path):
    (tmp_path / "c.csv").write_text("x,y,z,Tree ID,x,7,class,height\n1,2,3,4,5.5,6,oak,0\n4,5,6,7,8.5,9,ash,1\n")
    point = read_tensor_cloud(tmp_path / "c.csv").point
    assert {key: point[key].numpy().ravel().tolist() for key in point if key != "positions"} == {
        "Tree_ID": [4, 7],
        "x_2": [5.5, 8.5],
        "column_7": [6, 9],
        "height": [0, 1],
    }
    assert str(point.Tree_ID.dtype) == "Int32"


@pytest.mark.parametrize(
    ("text", "noun"),
    [
        ("these are\nwords alone, and no more\n", "three numbers"),
        ("x;y;z\n" + 2 * "1.234,5;2.345,6;3.456,7\n", "three numbers"),
        ("0 0 0\n" + 2 * "a b c\n", "2 of 3 lines hold no point"),
        ("x,y,z\n1,5,2,5,3,5\n", "commas"),
        ("x,y,z,label\n1,64,1,27,1,04,7\n", "commas"),
        ("x,y,z\n0,0,0\n" + 9 * "1,25,0,33,1,5\n", "commas"),
        ("1,64,1,27,1,40\n1,64,-1,07,1,04\n", "commas"),
        (2 * '"1,5","2,5","3,5"\n', "2 of 2 lines hold no point; commas"),
        ("ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3 4\n", "grid of heights"),
        ("length,radius,angle\n1,2,3\n", "length, radius, angle"),
    ],
)
def test_text_that_is_no_cloud(tmp_path, text, noun):
    (tmp_path / "c.csv").write_text(text)
    assert holds_points(tmp_path / "c.csv") == ("hold no point" in noun)
    with pytest.raises(FileFormatError, match=rf"c\.csv: no points could be read: .*{noun}"):
        read_cloud(tmp_path / "c.csv")


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z,\n1,2,3,\n4,5,6,\n",
        "x,y,z\n1.5,2,3,7\n4.5,5,6,7\n",
        "1,2,3,0,10,007\n" * 2,
        "1,2,3\n01,02,03\n",
        "# x,y,z\n1,2,3,4\n4,5,6,7\n",
    ],
)
def test_commas_that_part_columns_alone(tmp_path, text):
    (tmp_path / "c.csv").write_text(text)
    np.testing.assert_array_equal(np.floor(read_scan(tmp_path / "c.csv").positions[0]), [1, 2, 3])


@pytest.mark.parametrize("delimiter", [";", " ; ", "\t", "  "])
@pytest.mark.parametrize("head", ["", "x y z label\n", "0 0 0 0\n"], ids=["bare", "names", "whole"])
@pytest.mark.parametrize("form", ["{:.17f}", "{:+.16e}"])
def test_decimal_commas(tmp_path, delimiter, head, form):
    rows = [*RANDOM.normal(size=(5, 3)) * 1000]
    lines = [delimiter.join([*(form.format(value).replace(".", ",") for value in row), "7"]) for row in rows]
    (tmp_path / "c.csv").write_text(head.replace(" ", delimiter) + "\n".join(lines) + "\n")
    assert holds_points(tmp_path / "c.csv")
    scan = read_scan(tmp_path / "c.csv")
    np.testing.assert_allclose(scan.positions[-5:], rows, rtol=1e-15)
    np.testing.assert_array_equal(scan.attributes["label" if "x" in head else "column_4"][-5:], 7)


@pytest.mark.parametrize(
    "head", ["# exported by CloudCompare\n", "my scan\n", "X,Y,Z\n[m],[m],[m]\n", "// 1 of 3\n", "Höhe über Null\n"]
)
def test_what_may_stand_above_the_points(tmp_path, head):
    delimiter = "," if "," in head else " "
    text = head + "".join(delimiter.join(("1.5", "2", str(i))) + "\n" for i in range(3))
    (tmp_path / "c.txt").write_bytes(text.encode("latin-1"))
    assert holds_points(tmp_path / "c.txt")
    np.testing.assert_array_equal(read_scan(tmp_path / "c.txt").positions, [[1.5, 2, i] for i in range(3)])
