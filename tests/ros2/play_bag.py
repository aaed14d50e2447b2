"""Plays the joint states and external torques of a bag on the topics that the node subscribes, at the bag's speed."""

import argparse
import time
from pathlib import Path

import rclpy
from rclpy.qos import qos_profile_sensor_data, qos_profile_system_default
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState

TOPICS = {"/joint_states": "joint_states", "/external_torques": "external_torque"}


def read(bag):
    """The bag's samples in order: time in ns, topic to publish on, message."""
    with AnyReader([bag]) as reader:
        connections = [connection for connection in reader.connections if connection.topic in TOPICS]
        for connection, time_ns, raw in reader.messages(connections):
            old = reader.deserialize(raw, connection.msgtype)
            new = JointState(name=list(old.name))
            new.header.stamp.sec, new.header.stamp.nanosec = old.header.stamp.sec, old.header.stamp.nanosec
            new.position, new.effort = list(old.position), list(old.effort)
            yield time_ns, TOPICS[connection.topic], new


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("bag", type=Path)
    arguments.add_argument("--best-effort", action="store_true", help="publish as sensors do")
    arguments = arguments.parse_args()

    rclpy.init()
    node = rclpy.create_node("player")
    qos = qos_profile_sensor_data if arguments.best_effort else qos_profile_system_default
    publishers = {topic: node.create_publisher(JointState, topic, qos) for topic in TOPICS.values()}
    while not all(publisher.get_subscription_count() for publisher in publishers.values()):
        time.sleep(0.05)
    messages = list(read(arguments.bag))
    begin = time.monotonic()
    for time_ns, topic, message in messages:
        due = begin + (time_ns - messages[0][0]) * 1e-9
        time.sleep(max(0.0, due - time.monotonic()))
        publishers[topic].publish(message)
    # What is on its way is lost when the publisher goes.
    time.sleep(0.5)
    print(f"played {len(messages)} messages in {time.monotonic() - begin:.1f} s")
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
