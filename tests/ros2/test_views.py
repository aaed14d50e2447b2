"""The RViz view shows topics that there are, of the type that each display takes, with QoS that match."""

import pytest
import yaml
from rclpy.qos import DurabilityPolicy, QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible
from rosbags.highlevel import AnyReader
from support import NODE, ROOT, URDF

TYPES = {
    "rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray",
    "rviz_default_plugins/PointCloud2": "sensor_msgs/msg/PointCloud2",
    "rviz_default_plugins/PointStamped": "geometry_msgs/msg/PointStamped",
    "rviz_default_plugins/RobotModel": "std_msgs/msg/String",
}
# Published by robot_state_publisher.
DESCRIPTION = "robot_description"
SCENARIO = "{link: lbr_link_4, rate_hz: 100, duration_secs: 8, noise_floor: 0.05}"


@pytest.fixture(scope="module")
def shown():
    """What the view subscribes to: type and QoS by topic."""
    view = yaml.safe_load((ROOT / "config" / "palpate.rviz").read_text())
    topics = {}
    for display in view["Visualization Manager"]["Displays"]:
        topic = display.get("Topic") or display.get("Description Topic")
        if topic:
            topics[topic["Value"]] = TYPES[display["Class"]], qos(topic)
    return topics


def qos(topic):
    named = lambda policy: topic[policy].upper().replace(" ", "_")
    return QoSProfile(
        depth=topic["Depth"],
        reliability=ReliabilityPolicy[named("Reliability Policy")],
        durability=DurabilityPolicy[named("Durability Policy")],
    )


def test_the_view_shows_what_node_and_simulated_driver_publish(peer, start, tmp_path, shown):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(SCENARIO)
    start(**{"robot.description_file": URDF})
    start(program=NODE.with_name("palpate_simulated_driver"), scenario=scenario)
    live = {topic: how for topic, how in shown.items() if topic != DESCRIPTION and not topic.startswith("/")}
    assert set(live) == {"palpate/markers", "palpate/particles", "simulated_driver/truth"}
    for topic, (kind, wanted) in live.items():
        offers = lambda: peer.node.get_publishers_info_by_topic("/" + topic)
        peer.wait_until(offers, f"a publisher of {topic}")
        for offer in offers():
            assert offer.topic_type == kind
            compatibility, reason = qos_check_compatible(offer.qos_profile, wanted)
            # A warning is about what the view leaves open.
            assert compatibility != QoSCompatibility.ERROR, (topic, reason)


def test_the_view_shows_the_truth_of_a_simulated_bag(bag, shown):
    recorded = {topic: kind for topic, (kind, _) in shown.items() if topic.startswith("/")}
    assert recorded
    with AnyReader([bag]) as reader:
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
    for topic, kind in recorded.items():
        assert kinds.get(topic) == kind, topic
