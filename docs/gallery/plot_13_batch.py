"""
Many scans at once
==================

Many scans, a ledger: finished scans are skipped, and one bad file does not stop the others. Shards divide the work
between machines.
"""

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import open3d as o3d

import glsk_o3d as glsk
from glsk_o3d.samples import SAMPLES

# %%
# A folder of scans, one of them broken.

folder = TemporaryDirectory()
scans, results = Path(folder.name, "scans"), Path(folder.name, "skeletons")
scans.mkdir()
for name in ("sauropod", "tube", "torus", "helix", "y_junction", "two_rings"):
    cloud = o3d.geometry.PointCloud(
        o3d.utility.Vector3dVector(SAMPLES[name](n=3000, noise=0.002, seed=1).points)
    )
    o3d.io.write_point_cloud(str(scans / f"{name}.ply"), cloud)
(scans / "broken.ply").write_text("this is no cloud")

# %%
# Two shards, as on two machines: each takes every second scan, and writes into a folder of its own. In Python,
# ``run_batch(scans, results / "1", shard=(1, 2), formats=["json"])`` does the same, below
# ``if __name__ == "__main__":``, because every worker process imports the script.


def glsk_batch(shard: int) -> dict:
    """What ``glsk batch scans -o results/1 --shard 1/2`` prints as JSON."""
    options = ["--shard", f"{shard}/2", "--format", "json", "--workers", "1", "--json"]
    words = ["batch", scans, "-o", results / str(shard), *options]
    run = subprocess.run([sys.executable, "-m", "glsk_o3d", *words], capture_output=True)
    return json.loads(run.stdout)


for shard in (1, 2, 1):
    done = glsk_batch(shard)
    print(f"shard {shard}: {done['done']} done, {done['skipped']} skipped, {done['failed']} failed")


# %%
# The ledgers together have a row for each scan, also for one that failed.

lines = [line for path in results.glob("*/ledger.jsonl") for line in path.read_text().splitlines()]
rows = {row["name"]: row for row in map(json.loads, lines)}
for name, row in sorted(rows.items()):
    facts = (
        row["error"]
        if row["status"] == "failed"
        else f"{row['vertices']} vertices, {row['loops']} loops"
    )
    print(f"{name:10} {row['status']:6} {row['seconds']:6.2f} s  {facts}")

# %%
# The folders of results.

figure = plt.figure(figsize=(10, 6.5), layout="constrained")
skeletons = [path for path in results.glob("*/*.json") if path.stem in rows]
for place, path in enumerate(skeletons, start=1):
    axes = figure.add_subplot(2, 3, place, projection="3d")
    glsk.plot_skeleton(glsk.read_skeleton(path), axes, color="branch").set_title(path.stem)
plt.show()
folder.cleanup()
