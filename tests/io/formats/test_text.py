from glsk_o3d.io.formats.text import line, text, words_by_line


def test_numbers_come_back_as_they_were():
    numbers = [0.1 + 0.2, 1e-300, -0.0, 5e300, 1 / 3]
    (words,) = words_by_line(text([line(*numbers)]))
    assert [float(word).hex() for word in words] == [number.hex() for number in numbers]


def test_comments_and_empty_lines_are_left_out():
    assert words_by_line(b"# x\n\n a  b # c\r\n\t\n1") == [["a", "b"], ["1"]]
