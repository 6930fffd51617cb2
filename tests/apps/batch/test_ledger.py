"""The ledger as a file, and its lock."""

import hashlib
import json
import os
import subprocess
import sys

import pytest

from glsk_o3d import BatchError
from glsk_o3d.apps.batch.ledger import Ledger, file_hash, locked


def row(name, **values):
    return {"name": name, "input": f"/in/{name}.ply", "status": "done", "outputs": [f"{name}.ply"]} | values


def lines(folder):
    return [json.loads(line) for line in (folder / "ledger.jsonl").read_bytes().splitlines()]


def test_rows_are_in_the_file_at_once_and_the_last_of_a_name_counts(tmp_path):
    ledger = Ledger(tmp_path)
    for item in (row("b", status="failed"), row("a"), row("b")):
        ledger.add(item)
        assert lines(tmp_path)[-1] == item
    ledger.rewrite()
    assert lines(tmp_path) == [row("a"), row("b")]
    assert Ledger(tmp_path).rows == ledger.rows


@pytest.mark.parametrize(
    "end", [b'{"name": "c", "inp', b'{"name": "c"}', b"\xff\xfe", b"[1]", b"[" * 100_000], ids=range(5)
)
def test_a_broken_end_is_mended(tmp_path, end, caplog):
    ledger = Ledger(tmp_path)
    ledger.add(row("a"))
    ledger.path.write_bytes(ledger.path.read_bytes() + end)
    again = Ledger(tmp_path)
    assert list(again.rows) == ["a"]
    assert "line 2: broken, passed over" in caplog.text
    again.rewrite()
    again.add(row("c"))
    assert lines(tmp_path) == [row("a"), row("c")]


@pytest.mark.parametrize(
    "harm",
    [dict(outputs=["a.ply", "../keep.me"]), dict(outputs="a.ply"), dict(name=""), dict(input=None), dict(status="?")],
    ids=str,
)
def test_a_line_that_no_batch_wrote_is_passed_over(tmp_path, harm):
    (tmp_path / "ledger.jsonl").write_text(f"{json.dumps(row('a') | harm)}\n{json.dumps(row('b'))}\n")
    assert list(Ledger(tmp_path).rows) == ["b"]


def test_hash(tmp_path):
    data = os.urandom((1 << 20) + 17)
    (tmp_path / "a").write_bytes(data)
    assert file_hash(tmp_path / "a") == hashlib.sha256(data).hexdigest()
    os.mkfifo(tmp_path / "pipe.ply")
    with pytest.raises(OSError, match=r"pipe\.ply: is no file"):
        file_hash(tmp_path / "pipe.ply")


def test_the_lock_dies_with_its_owner(tmp_path):
    code = "import sys; from pathlib import Path; from glsk_o3d.apps.batch.ledger import locked\n"
    code += "with locked(Path(sys.argv[1])):\n    print('mine', flush=True)\n    sys.stdin.read()"
    pipe = subprocess.PIPE
    owner = subprocess.Popen([sys.executable, "-c", code, tmp_path], stdin=pipe, stdout=pipe, text=True)
    assert owner.stdout.readline() == "mine\n"
    with pytest.raises(BatchError, match="another batch writes there"), locked(tmp_path):
        pytest.fail("two hold it")
    owner.kill()
    owner.communicate()
    with locked(tmp_path):
        pass
