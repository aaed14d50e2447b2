"""The robot's description comes from a parameter, a file or a topic."""

from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from support import ROOT, URDF, Arm, PalpateNode

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_from_a_file(peer, start):
    start(**{"robot.description_file": URDF})
    Arm(peer).wait_until_heard()


def test_from_a_parameter(peer, start, tmp_path):
    urdf = "".join(f"      {line}" for line in URDF.read_text().splitlines(keepends=True))
    parameters = tmp_path / "parameters.yaml"
    parameters.write_text(f"/**:\n  ros__parameters:\n    robot_description: |\n{urdf}")
    start("--ros-args", "--params-file", parameters)
    Arm(peer).wait_until_heard()


def test_from_the_topic_after_a_broken_one(peer, start):
    node = start()
    peer.wait_until(lambda: "waiting for the topic robot_description" in node.log(), "the node to say what it waits for")
    publisher = peer.node.create_publisher(String, "robot_description", LATCHED)
    publisher.publish(String(data="<robot name='broken'"))
    peer.wait_until(lambda: "ERROR" in node.log(), "the broken description to be refused")
    publisher.publish(String(data=URDF.read_text()))
    Arm(peer).wait_until_heard()


def test_the_shipped_parameters_are_taken(peer, start):
    start("--ros-args", "--params-file", ROOT / "config" / "palpate.yaml", **{"robot.description_file": URDF})
    Arm(peer).wait_until_heard()


def test_names_follow_the_namespace(peer, start):
    start("--ros-args", "-r", "__ns:=/lbr", **{"robot.description_file": URDF})
    names = lambda: [name for name, _ in peer.node.get_topic_names_and_types()]
    wanted = ["/lbr/joint_states", "/lbr/external_torque", "/lbr/palpate/contact_pose", "/lbr/palpate/markers"]
    peer.wait_until(lambda: set(wanted) <= set(names()), f"the topics {wanted}")
