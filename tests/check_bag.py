#!/usr/bin/env python3
"""Opens a bag with the `rosbags` package and decodes every message: check_bag.py BAG

BAG is a rosbag2 folder or a lone .mcap. Prints the topics with their types and counts. Ends with 1 and a reason if the
bag cannot be read, a definition is not that of ROS 2 Jazzy, a message does not decode, or a marker is not finite.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


class Wrong(Exception):
    """What is wrong with the bag."""


def check(path: Path) -> None:
    """Reads all of the bag."""
    jazzy = get_typestore(Stores.ROS2_JAZZY)
    with Reader(path) as reader:
        stores = {c.id: carried_types(c, jazzy) for c in reader.connections}
        counts = Counter()
        for connection, stamp, data in reader.messages():
            store = stores[connection.id]
            message = store.deserialize_cdr(data, connection.msgtype)
            # Written anew it has the same bytes, so no field was skipped or misread.
            again = store.serialize_cdr(message, connection.msgtype)
            if bytes(again) != bytes(data):
                raise Wrong(f"{connection.topic} at {stamp}: {len(data)} bytes, {len(again)} when written anew")
            check_message(connection.topic, stamp, message)
            counts[connection.id] += 1
        for connection in reader.connections:
            found, expected = counts[connection.id], connection.msgcount
            print(f"{connection.topic}  {connection.msgtype}  {found}")
            if found != expected:
                raise Wrong(f"{connection.topic}: {found} messages, the bag promises {expected}")
        if sum(counts.values()) == 0:
            raise Wrong("no messages")


def carried_types(connection, jazzy):
    """The types that the bag carries for a topic; they must be those of Jazzy."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    found, expected = store.hash_rihs01(connection.msgtype), jazzy.hash_rihs01(connection.msgtype)
    if found != expected:
        raise Wrong(f"definition of {connection.msgtype}: hash {found}, in Jazzy {expected}")
    return store


def check_message(topic: str, stamp: int, message) -> None:
    """Checks what viewers are strict about."""
    for marker in getattr(message, "markers", []):
        numbers = [xyz(marker.scale), xyz(marker.pose.position), *map(xyz, marker.points)]
        if not np.isfinite(numbers).all():
            raise Wrong(f"{topic} at {stamp}: marker {marker.ns} {marker.id} is not finite")
        if marker.colors and len(marker.colors) != len(marker.points):
            raise Wrong(f"{topic} at {stamp}: {len(marker.colors)} colours for {len(marker.points)} points")
    if hasattr(message, "point_step"):
        expected = message.width * message.height * message.point_step
        if len(message.data) != expected:
            raise Wrong(f"{topic} at {stamp}: {len(message.data)} bytes of points, expected {expected}")
        last = max(field.offset + 4 for field in message.fields)
        if last > message.point_step:
            raise Wrong(f"{topic} at {stamp}: a field ends at {last}, beyond {message.point_step}")


def xyz(value) -> tuple[float, float, float]:
    """The three numbers of a point or vector."""
    return value.x, value.y, value.z


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: check_bag.py BAG")
    try:
        check(Path(sys.argv[1]))
    except Exception as error:  # whatever the reader says is the reason
        print(f"{sys.argv[1]}: {type(error).__name__}: {error}", file=sys.stderr)
        sys.exit(1)
