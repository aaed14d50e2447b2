"""A simulated touch, played on real topics, is seen by a listener as the command line sees it in the bag."""

import csv
import math
import struct

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, WrenchStamped
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Bool
from support import JOINTS, LATCHED, PARTICLES, SAMPLES, URDF, palpate, play
from visualization_msgs.msg import Marker, MarkerArray

LINK, LINK_INDEX = "lbr_link_4", 4
# What /diagnostics always tells.
TOLD = {
    "position messages", "torque messages", "samples used", "positions, Hz", "torques, Hz", "samples used, Hz",
    "samples lost, filter too slow", "torques without position", "positions without torque",
    "refused, joint missing", "refused, wrong length", "refused, unreadable", "refused, not measured",
    "refused, not finite", "refused, too large", "refused, stamp not after", "time started anew",
    "age of the newest sample, s", "position stamps behind now, s", "torque stamps behind now, s",
    "torque stamps behind positions', s", "status", "step p50, ms", "step p99, ms", "step max, ms", "particles",
    "effective sample size", "spread of the particles, m", "seed", "age of the tare, s",
}  # fmt: skip


@pytest.fixture(scope="session")
def replayed(bag, parameters, tmp_path_factory):
    """Rows of the command line's estimates, by stamp."""
    out = tmp_path_factory.mktemp("replay") / "estimates.csv"
    palpate("replay", bag, "--urdf", URDF, "--config", parameters, "--estimates", out)
    with open(out) as rows:
        return {int(row["stamp_ns"]): row for row in csv.DictReader(rows)}


@pytest.mark.parametrize("options", [[], ["--best-effort"]], ids=["reliable", "best_effort"])
def test_a_touch_is_located_drawn_and_counted(peer, domain, start, bag, parameters, replayed, options):
    start("--ros-args", "--params-file", parameters, **{"robot.description_file": URDF})
    poses = peer.listen(PoseWithCovarianceStamped, "palpate/contact_pose", SAMPLES)
    wrenches = peer.listen(WrenchStamped, "palpate/contact_wrench", SAMPLES)
    detected = peer.listen(Bool, "palpate/contact_detected", LATCHED)
    clouds = peer.listen(PointCloud2, "palpate/particles")
    pictures = peer.listen(MarkerArray, "palpate/markers")
    residuals = peer.listen(JointState, "palpate/residual", SAMPLES)
    probabilities = peer.listen(JointState, "palpate/link_probabilities", SAMPLES)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    player = play(bag, domain, *options)
    peer.wait_until(lambda: player.poll() is not None, "the player to end", limit_secs=60.0)
    assert player.returncode == 0
    counts = lambda: peer.counts(diagnostics)
    peer.wait_until(lambda: counts()["samples used"] == str(SAMPLES), "every sample to be used", limit_secs=60.0)

    assert [message.data for message in detected][:2] == [False, True]
    assert len(poses) == len(wrenches) > 400
    assert all(is_finite_pose(message) for message in poses)
    assert all(math.isfinite(value) for message in wrenches for value in force(message))
    assert math.hypot(*force(wrenches[-1])) > 1.0
    check_cloud(clouds[-1])
    check_markers(pictures[-1])
    assert any(len(colours(picture)) > 1 for picture in pictures), "the particles' likelihoods do not show"
    frames = {message.header.frame_id for message in [*poses, *wrenches, *clouds]}
    assert frames == {"lbr_link_0"}
    for message in poses:
        row = replayed[stamp_ns(message)]
        assert row["link"], row
        position = message.pose.pose.position
        assert math.dist((position.x, position.y, position.z), [float(row[axis]) for axis in "xyz"]) < 1e-5, row
    check_details(residuals, probabilities)
    check_figures(peer.counts(diagnostics))
    check_health(diagnostics)
    late = peer.listen(Bool, "palpate/contact_detected", LATCHED)
    peer.wait_until(lambda: late, "a late listener to be told")
    assert [message.data for message in late] == [detected[-1].data]
    # Both see the contact for as long.
    assert len(poses) == sum(row["status"] != "none" for row in replayed.values())


def check_details(residuals, probabilities):
    assert all(message.name == JOINTS for message in residuals)
    assert len(residuals) == len(probabilities) == SAMPLES
    assert math.hypot(*residuals[-1].effort) < 0.5, "the contact found does not explain the torques"
    assert sum(probabilities[0].position) == 0.0
    at_the_end = dict(zip(probabilities[-1].name, probabilities[-1].position))
    assert max(at_the_end, key=at_the_end.get) == LINK and sum(at_the_end.values()) <= 1.0 + 1e-9


def check_figures(counts):
    assert counts["particles"] == str(PARTICLES) and counts["seed"] == "5"
    assert 1.0 <= float(counts["effective sample size"]) <= PARTICLES
    assert 0.0 < float(counts["spread of the particles, m"]) < 0.5
    assert counts["age of the tare, s"] == "none"


def check_health(diagnostics):
    stamps = [stamp_ns(message) for message in diagnostics]
    assert all(later - earlier > 900_000_000 for earlier, later in zip(stamps, stamps[1:])), stamps
    seconds = [{value.key: value.value for value in message.status[0].values} for message in diagnostics]
    busy = [values for values in seconds if float(values.get("samples used, Hz", 0.0)) > 0.0]
    assert busy and all(TOLD <= values.keys() for values in busy), busy
    assert all(0.0 < float(values["step p50, ms"]) <= float(values["step p99, ms"]) for values in busy), busy


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def is_finite_pose(message):
    pose = message.pose.pose
    position, turn = pose.position, pose.orientation
    values = [position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w, *message.pose.covariance]
    unit = math.hypot(turn.x, turn.y, turn.z, turn.w)
    return all(math.isfinite(value) for value in values) and abs(unit - 1.0) < 1e-6


def force(message):
    vector = message.wrench.force
    return vector.x, vector.y, vector.z


def check_cloud(cloud):
    assert [field.name for field in cloud.fields] == [
        "x", "y", "z", "normal_x", "normal_y", "normal_z", "weight", "force", "stiffness", "link",
    ]  # fmt: skip
    assert cloud.width == PARTICLES and cloud.height == 1
    assert len(cloud.data) == cloud.width * cloud.point_step
    points = list(struct.iter_unpack("<9fI", bytes(cloud.data)))
    assert all(math.isfinite(value) for point in points for value in point)
    assert abs(sum(point[6] for point in points) - 1.0) < 1e-3
    on_link = sum(point[6] for point in points if point[9] == LINK_INDEX)
    assert on_link > 0.5, f"weight on {LINK}: {on_link}"


def check_markers(picture):
    first, *markers = picture.markers
    assert first.action == Marker.DELETEALL
    spheres = [marker for marker in markers if marker.type == Marker.SPHERE_LIST]
    arrows = [marker for marker in markers if marker.type == Marker.ARROW]
    labels = [marker for marker in markers if marker.type == Marker.TEXT_VIEW_FACING]
    assert len(spheres) == 1 and len(arrows) >= 1 and len(labels) == 1
    assert len(spheres[0].points) == len(spheres[0].colors) == PARTICLES
    assert all(len(arrow.points) == 2 for arrow in arrows)
    assert labels[0].text.startswith(LINK), labels[0].text
    assert {marker.header.frame_id for marker in markers} == {"lbr_link_0"}


def colours(picture):
    """The different colours of a picture's particles."""
    return {(colour.r, colour.g) for marker in picture.markers for colour in marker.colors}
