"""The node's work on a bag, without ROS: ``python -m glsk_o3d_ros.bag in_bag out_bag --topic /points``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import Nodetype
from rosbags.rosbag2 import Writer, WriterError
from rosbags.typesys import Stores, get_typestore

from glsk_o3d import GlskError

from .messages import Make
from .parameters import PARAMETERS
from .skeletonizer import Skeletonizer

CLOUD = "sensor_msgs/msg/PointCloud2"
RESULTS = {"markers": "visualization_msgs/msg/MarkerArray", "poses": "geometry_msgs/msg/PoseArray", "labels": CLOUD}
PLAIN = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}  # what fields are by default; numbers are 0


def maker(types: Any) -> Make:
    """What makes messages of a rosbags ``Typestore``, whose classes have no defaults of their own."""

    def fill(shape, of, given):
        if shape is Nodetype.SEQUENCE and of[0][0] is Nodetype.BASE and of[0][1][0] != "string":
            return np.asarray(() if given is None else given, of[0][1][0])
        if given is not None:
            return given
        if shape is Nodetype.NAME:
            return make(of)
        return PLAIN.get(of[0], 0) if shape is Nodetype.BASE else []

    def make(kind: str, /, **fields: Any) -> Any:
        known = types.fielddefs[kind][1]
        return types.types[kind](**{field: fill(*what, fields.pop(field, None)) for field, what in known}, **fields)

    return make


def convert(source: Path, target: Path, topic: str, **options: Any) -> int:
    """Write a bag of markers, poses and labels for the clouds in another; gives how many there were.

    Parameters
    ----------
    source : Path
        A bag of ROS 2, or of ROS 1.
    target : Path
        A folder that is not there yet; the results have the times of their clouds.
    topic : str
    **options
        Of `Skeletonizer`.

    Raises
    ------
    GlskError, OSError, AnyReaderError, WriterError
    """
    types = get_typestore(Stores.ROS2_HUMBLE)  # later ones have the same clouds, markers and poses
    skeletonize = Skeletonizer(maker(types), **options)
    with AnyReader([source], default_typestore=types) as reader:
        sources = [connection for connection in reader.connections if connection.msgtype == CLOUD]
        clouds = [connection for connection in sources if connection.topic == topic]
        if not clouds:
            topics = ", ".join(sorted({connection.topic for connection in sources}))
            raise AnyReaderError(f"{source}: has no clouds on {topic}; there are some on {topics or 'no topic'}")
        done = 0
        with Writer(target, version=8) as writer:
            out = {
                name: writer.add_connection(f"/skeletonize_node/{name}", kind, typestore=types)
                for name, kind in RESULTS.items()
            }
            for connection, time, data in reader.messages(clouds):
                try:
                    results = skeletonize(reader.deserialize(data, connection.msgtype))
                except Exception as error:  # whatever is wrong with a cloud, the others are to be done
                    print(f"cloud at {time} left out: {error}", file=sys.stderr)
                    continue
                for warning in results.warnings:
                    print(f"cloud at {time}: {warning}", file=sys.stderr)
                for name, kind in RESULTS.items():
                    writer.write(out[name], time, types.serialize_cdr(getattr(results, name), kind))
                done += 1
    return done


def main(words: list[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m glsk_o3d_ros.bag", description=__doc__)
    parser.add_argument("source", type=Path, help="bag of ROS 2 (a folder) or ROS 1 (a file)")
    parser.add_argument("target", type=Path, help="bag to write: a folder that is not there yet")
    parser.add_argument("--topic", required=True, help="where the clouds are")
    for name, (default, meaning) in PARAMETERS.items():
        if name != "target_frame":  # a bag is read without tf2
            kind = dict(nargs=len(default), type=float) if isinstance(default, list) else dict(type=type(default))
            kind = dict(action="append") if name == "set" else kind
            parser.add_argument("--" + name.replace("_", "-"), default=default, help=meaning, **kind)
    options = vars(parser.parse_args(words))
    try:
        print(f"{convert(**options)} clouds skeletonised: {options['target']}")
    except (GlskError, OSError, AnyReaderError, WriterError) as error:
        sys.exit(f"{parser.prog}: {error}")


if __name__ == "__main__":
    main()
