"""
Many scans at once, with Dask
=============================

Many scans, a cluster, a ledger: finished scans are skipped, and one bad file does not stop the others. It needs the
extra ``cluster``.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import open3d as o3d
from distributed import Client, LocalCluster

import glsk_o3d as glsk
from glsk_o3d.apps.batch import run_batch
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
# The cluster. On one machine ``run_batch(scans, results)`` is simpler and needs no Dask. These workers are two
# threads of this process, so that the page needs no ports and no new processes. For real work leave
# ``processes=False`` out, and put the rest under ``if __name__ == "__main__":``, because every process imports the
# script; or give the address of a scheduler.

cluster = LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0")
client = Client(cluster)
first = run_batch(scans, results, scheduler=client, formats=["json"])
again = run_batch(scans, results, scheduler=client, formats=["json"])
client.close()
cluster.close()
for run in (first, again):
    print(f"done {run.done}, skipped {run.skipped}, failed {run.failed}")

# %%
# The ledger has a row for each, also for what failed.

for name, row in first.rows.items():
    facts = (
        row["error"]
        if row["status"] == "failed"
        else f"{row['vertices']} vertices, {row['loops']} loops"
    )
    print(f"{name:10} {row['status']:6} {row['seconds']:6.2f} s  {facts}")

# %%
# The folder of results.

figure = plt.figure(figsize=(10, 6.5), layout="constrained")
done = [row for row in first.rows.values() if row["status"] == "done"]
for place, row in enumerate(done, start=1):
    axes = figure.add_subplot(2, 3, place, projection="3d")
    glsk.plot_skeleton(
        glsk.read_skeleton(results / row["outputs"][0]), axes, color="branch"
    ).set_title(row["name"])
plt.show()
folder.cleanup()
