"""The robot's description comes from a parameter, a file or a topic."""

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Bool, String
from support import LATCHED, ROOT, URDF, Arm


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


def test_one_that_comes_late_changes_and_breaks_is_followed(peer, start):
    node = start()
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    status = lambda: diagnostics[-1].status[0] if diagnostics else None
    peer.wait_until(lambda: status() and status().message == "waiting for the robot's description", "the wait to be told")
    publisher = peer.node.create_publisher(String, "robot_description", LATCHED)
    arm = Arm(peer)

    def works_with(name):
        return lambda: status().message == "working" and status().hardware_id == name

    publisher.publish(String(data=URDF.read_text()))
    arm.send_until(works_with("iiwa14"), "the node to work")
    publisher.publish(String(data=URDF.read_text().replace('<robot name="iiwa14"', '<robot name="changed"')))
    arm.send_until(works_with("changed"), "the other robot to be taken")
    publisher.publish(String(data="<robot name='broken'"))
    refused = lambda: any(value.key == "description refused" for value in status().values)
    arm.send_until(refused, "the broken description to be told")
    arm.send_until(works_with("changed"), "the node to go on as before")
    assert node.log().count("the robot stays as it was") == 1, node.log()


def test_the_shipped_parameters_are_taken(peer, start):
    start("--ros-args", "--params-file", ROOT / "config" / "palpate.yaml", **{"robot.description_file": URDF})
    Arm(peer).wait_until_heard()


def test_names_follow_the_namespace(peer, start):
    start("--ros-args", "-r", "__ns:=/lbr", **{"robot.description_file": URDF})
    names = lambda: [name for name, _ in peer.node.get_topic_names_and_types()]
    wanted = ["/lbr/joint_states", "/lbr/external_torque", "/lbr/palpate/contact_pose", "/lbr/palpate/markers"]
    peer.wait_until(lambda: set(wanted) <= set(names()), f"the topics {wanted}")
    services = lambda: [name for name, _ in peer.node.get_service_names_and_types()]
    wanted_services = ["/lbr/palpate/reset", "/lbr/palpate/set_parameters"]
    peer.wait_until(lambda: set(wanted_services) <= set(services()), f"the services {wanted_services}")


def test_two_robots_side_by_side(peer, start):
    detected = {}
    for namespace in ("left", "right"):
        start("--ros-args", "-r", f"__ns:=/{namespace}", **{"robot.description_file": URDF})
        detected[namespace] = peer.listen(Bool, f"/{namespace}/palpate/contact_detected", LATCHED)
    left, right = Arm(peer, namespace="/left/"), Arm(peer, namespace="/right/")

    def sent():
        left.send(torques=[0.0] * 6 + [5.0])
        right.send()
        return detected["left"] and detected["left"][-1].data and detected["right"]
    peer.wait_until(sent, "the left robot's contact")
    assert [message.data for message in detected["right"]] == [False]
