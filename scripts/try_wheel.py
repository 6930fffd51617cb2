"""Installs the wheel alone, with each extra and with the benchmark, in folders of their own, and runs every command.

With the benchmark it also makes ten clouds, which must be to the last bit what is kept, and scores ten answers.

    python scripts/try_wheel.py [EXTRA ...]

Prints a table: what was installed, how many seconds and megabytes it took, and which extras commands asked for. A
command may succeed, or end with a message that names an extra; anything else is an error.
"""

import gzip
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
USERS = ("pictures", "crosscheck", "meshlab", "las", "e57", "graph", "full")
BENCH = "bench"  # the wheel beside it, with glsk-bench
TEN = ROOT / "benchmarks" / "v3" / "ten.json.gz"
ROUNDING = 1e-12
TABLE = "x,y,z,tree\n" + "".join(f"{x},{y},{z},{x % 2}\n" for x in range(40) for y in (0, 1, 2) for z in (0, 1, 2))
RING = "".join(  # clean and dense, so that a mesh closes around it
    f"{(3 + math.cos(v)) * math.cos(u)} {(3 + math.cos(v)) * math.sin(u)} {math.sin(v)}\n"
    for i in range(72)
    for j in range(24)
    for u, v in [(math.pi * (i / 36 + j % 2 / 72), math.pi * j / 12)]
)
COMMANDS = """\
demo
filters
info demo/cloud.ply
skeletonize demo/cloud.ply -o s.json -o s.vtp -o s.ply --where z>-9
info s.json
skeletonize demo/cloud.ply --pipeline tree -o t.json
skeletonize demo/cloud.ply -o r.json --preview r.png --report r.html
batch demo/cloud.ply -o many
skeletonize scan.csv -o tree.ply --where tree==1
branches s.json -o branches.csv
tree t.json --unit 1 --cylinders cylinders.csv
grasps s.json --opening 0.3 -o grasps.json
rig s.json -o rig.glb --cut-loops
convert s.json s.obj
edit t.json -o e.json --prune-order 1
convert t.json t.swc t.glb t.urdf
evaluate s.json demo/cloud.ply
benchmark make bench --families tubes --seeds 100:101 --variants clean
benchmark run bench ours
benchmark score bench ours -o ours.json
benchmark table ours.json
skeletonize demo/cloud.ply --pipeline s.json -o again.json
run glskeleton demo/cloud.ply -o g.ply
run scan_cleanup demo/cloud.ply -o c.ply
crosscheck ring.xyz
info scan.las
info scan.e57
"""
"""What is run; the last two files are none, so that what is missing shows."""


def pip(python, *words):
    subprocess.run([python, "-m", "pip", "--disable-pip-version-check", "-qq", *words], check=True)


def try_extra(wheel: Path, bench: Path, extra: str, folder: Path) -> tuple[float, float, list[str], list[str]]:
    """Seconds and megabytes of an installation, the extras that commands asked for, and what went wrong."""
    venv.create(folder / "venv", with_pip=True)
    binaries = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    before, start = size(folder), time.perf_counter()
    wheels = [wheel, bench] if extra == BENCH else [f"{wheel}[{extra}]" if extra else wheel]
    pip(binaries / "python", "install", *wheels)
    seconds, here = time.perf_counter() - start, folder / "work"
    here.mkdir()
    megabytes = (size(folder) - before) / 1e6
    (here / "scan.csv").write_text(TABLE)
    (here / "ring.xyz").write_text(RING)
    for name in ("scan.las", "scan.e57"):
        (here / name).write_bytes(b"none")
    asked, wrong = [], []
    for line in COMMANDS.splitlines():
        done = run(binaries / "glsk", here, *line.split())
        said = done.stderr.strip().splitlines()[-1:] or [""]
        if wants := re.search(r'pip install (?:"glsk-o3d\[|\./)(\w+)', done.stderr):
            asked.append(wants[1])
        elif done.returncode and not (line.startswith("info scan") and "not a valid" in said[0]):
            wrong.append(f"glsk {line}: {said[0]}")
    if extra == BENCH:
        wrong += try_ten(binaries / "glsk", here)
    return seconds, megabytes, sorted(set(asked)), wrong


def is_rounding(found: object, value: object) -> bool:
    """Whether two numbers differ by what processors do in another order."""
    return isinstance(found, float) and isinstance(value, float) and math.isclose(found, value, rel_tol=ROUNDING)


def try_ten(glsk: Path, here: Path) -> list[str]:
    """Make ten clouds and score ten answers that are kept; gives what differs, of clouds in any bit.

    Of scores another processor may round the last one.
    """
    kept = json.loads(gzip.decompress(TEN.read_bytes()))
    words = {name: name.split("_") for name in kept}
    families, seeds, variants = (",".join(dict.fromkeys(it)) for it in zip(*words.values(), strict=True))
    (here / "answers").mkdir()
    for name, it in kept.items():
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in it["vertices"]] + [f"l {a + 1} {b + 1}" for a, b in it["edges"]]
        (here / "answers" / f"{name}.obj").write_text("\n".join(lines))
    choice = ("--version", "v3", "--families", families, "--seeds", seeds, "--variants", variants)
    made = json.loads(run(glsk, here, "benchmark", "make", "ten", *choice, "--json", check=True).stdout)
    run(glsk, here, "benchmark", "score", "ten", "answers", "-o", "ten.json", "-q", check=True)
    rows = {f"{row['shape']}_{row['variant']}": row for row in json.loads((here / "ten.json").read_text())["clouds"]}
    wrong = [] if made["sameness"]["bits"] == len(kept) else [f"clouds that are not the same: {made['sameness']}"]
    for name, it in kept.items():
        scores = ((score, value, rows[name][score]) for score, value in it["scores"].items())
        differ = [score for score, value, found in scores if found != value and not is_rounding(found, value)]
        wrong += [f"{name}: other scores: {', '.join(differ)}"] if differ else []
    return wrong


def run(glsk: Path, here: Path, *words: str, check: bool = False) -> subprocess.CompletedProcess:
    """Run a command in a folder, with nothing of a clone on its path."""
    bare = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return subprocess.run([glsk, *words], cwd=here, env=bare, capture_output=True, text=True, check=check)


def size(folder: Path) -> int:
    """Bytes of all files below a folder."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file())


def main() -> int:
    """Try the wheel alone and with the extras that are named, by default all for users."""
    extras, failed = sys.argv[1:] or ["", *USERS, BENCH], 0
    with tempfile.TemporaryDirectory() as place:
        pip(sys.executable, "wheel", "--no-deps", "-w", place, ROOT, ROOT / "benchmarks")
        (wheel,), (bench,) = Path(place).glob("glsk_o3d*.whl"), Path(place).glob("glsk_bench*.whl")
        print("| installed | s | MB | commands that ask for more |\n|---|--:|--:|---|", flush=True)
        for extra in extras:
            with tempfile.TemporaryDirectory() as folder:
                seconds, megabytes, asked, wrong = try_extra(wheel, bench, extra, Path(folder))
            print(
                f"| {extra or 'alone'} | {seconds:.0f} | {megabytes:.0f} | {', '.join(asked) or 'none'} |", flush=True
            )
            failed += len(wrong)
            print(*wrong, sep="\n", end="\n" * bool(wrong), file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
