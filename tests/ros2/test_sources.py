"""With its preset, each driver's messages give the same estimate over ROS 2 as out of a bag."""

import csv
import dataclasses
import itertools
import math
import re
import time
from pathlib import Path

import pytest
from ament_index_python import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from drivers import DRIVERS, NAN
from geometry_msgs.msg import PoseWithCovarianceStamped
from play_bag import read
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import StoragePlugin, Writer
from sensor_msgs.msg import JointState
from support import PARTICLES, ROOT, URDF, palpate

# Of the simulated bag: a second without contact, and more than one with it.
USED = 250


@dataclasses.dataclass
class Sample:
    stamp_ns: int
    position: list
    torque: list


@pytest.fixture(scope="session")
def samples(bag):
    """The first samples of the simulated bag."""
    found = {}
    for _, topic, message in read(bag):
        stamp_ns = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        found.setdefault(stamp_ns, {})[topic] = message
    return [
        Sample(stamp_ns, list(both["joint_states"].position), list(both["external_torque"].effort))
        for stamp_ns, both in sorted(found.items())[:USED]
    ]


def write_parameters(path, driver):
    """The driver's preset; and few particles, and limits that a slow machine keeps."""
    preset = (ROOT / "config" / f"{driver.preset}.yaml").read_text()
    if driver.source:
        preset = re.sub(r"source: \w+", f"source: {driver.source}", preset)
    values = {
        "filter.palpate.hypotheses": PARTICLES,
        "input.max_wait_secs": 3600,
        "input.pairing_tolerance_secs": 0.5,
    }
    path.write_text(preset + "".join(f"    {name}: {value}\n" for name, value in values.items()))


def write_urdf(path, driver):
    """The arm that ships with the project, with the driver's joints."""
    text = URDF.read_text().replace("package://palpate", ROOT.as_uri())
    for number, joint in enumerate(driver.joints, 1):
        text = text.replace(f'"lbr_A{number}"', f'"{joint}"')
    path.write_text(text.replace("</robot>", f"{driver.extra_urdf}</robot>"))


def begin(start, driver, urdf, parameters):
    """Starts a node for the driver."""
    write_urdf(urdf, driver)
    write_parameters(parameters, driver)
    remapped = ["-r", f"external_torque:={driver.torque_topic}"]
    return start("--ros-args", "--params-file", parameters, *remapped, **{"robot.description_file": urdf})


def definition(type_name):
    """A message's definition with those of all that is nested in it, as rosbag2 writes it."""
    names, texts = [type_name], []
    for name in names:
        package, kind = name.split("/")
        text = (Path(get_package_share_directory(package)) / "msg" / f"{kind}.msg").read_text()
        texts.append(text if name == type_name else f"{'=' * 80}\nMSG: {name}\n{text}")
        for word in re.findall(r"^\s*([A-Z]\w*|\w+/\w+)(?:\[.*?\])?\s+\w", text, re.MULTILINE):
            nested = word if "/" in word else f"{package}/{word}"
            if nested not in names:
                names.append(nested)
    return "\n".join(texts)


def write_bag(path, messages, change=lambda raw: raw, change_definition=lambda text: text):
    """Writes a bag of (time in ns, topic, message)."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connections = {}
        for time_ns, topic, message in sorted(messages, key=lambda message: message[0]):
            if topic not in connections:
                package, kind = type(message).__module__.split(".")[0], type(message).__name__
                text = change_definition(definition(f"{package}/{kind}"))
                connections[topic] = bag.add_connection(topic, f"{package}/msg/{kind}", msgdef=text, rihs01="unknown")
            bag.write(connections[topic], time_ns, change(serialize_message(message)))


def replay(bag, urdf, parameters):
    """Rows of the command line's estimates, by stamp."""
    out = bag.with_suffix(".csv")
    palpate("replay", bag, "--urdf", urdf, "--config", parameters, "--estimates", out)
    with open(out) as rows:
        return {int(row["stamp_ns"]): row for row in csv.DictReader(rows)}


def newest(diagnostics):
    """The newest values that have come on /diagnostics, by name."""
    return {value.key: value.value for message in diagnostics[-1:] for value in message.status[0].values}


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


class Player:
    """Publishes as a driver does, and remembers what was sent as (time in ns, topic, message)."""

    def __init__(self, peer, driver, sample):
        self.peer, self.driver = peer, driver
        kinds = {topic: type(message) for topic, message in driver.messages(driver, sample).items()}
        create = peer.node.create_publisher
        self.publishers = {topic: create(kind, topic, driver.qos) for topic, kind in kinds.items()}
        self.sent = []

    def send(self, sample, topics=None):
        if not self.driver.is_stamped:
            sample = dataclasses.replace(sample, stamp_ns=time.time_ns())
        for topic, message in self.driver.messages(self.driver, sample).items():
            if topics is None or topic in topics:
                self.publishers[topic].publish(message)
                self.sent.append((sample.stamp_ns, topic, message))

    def start(self, first, is_heard):
        """Sends what a driver has at its start, NaN for torques, until the node hears it. Gives how many messages."""
        ticks = itertools.count(first.stamp_ns - 60_000_000_000, 10_000_000)

        def sent():
            self.send(Sample(next(ticks), first.position, NAN))
            return is_heard()

        self.peer.wait_until(sent, "the driver to be heard")
        return len(self.sent)

    def play(self, samples):
        for sample in samples:
            self.send(sample)
            self.peer.executor.spin_once(0.0)
            time.sleep(0.004 if self.driver.is_stamped else 0.01)
        # Bare torques wait until a later position has come.
        late = dataclasses.replace(samples[-1], stamp_ns=samples[-1].stamp_ns + 10_000_000)
        self.send(late, ["/joint_states"])


@pytest.mark.parametrize("name", DRIVERS)
def test_a_driver_gives_the_same_estimate_over_ros_2_as_out_of_a_bag(peer, start, samples, tmp_path, name):
    driver = DRIVERS[name]
    urdf, parameters = tmp_path / "arm.urdf", tmp_path / "parameters.yaml"
    begin(start, driver, urdf, parameters)
    poses = peer.listen(PoseWithCovarianceStamped, "palpate/contact_pose", 1000)
    residuals = peer.listen(JointState, "palpate/residual", 1000)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    player = Player(peer, driver, samples[0])
    unused = player.start(samples[0], lambda: int(newest(diagnostics).get("refused, not finite", 0)) > 0)
    player.play(samples)
    peer.wait_until(lambda: len(residuals) == USED, "every sample to be used")
    counts = peer.counts(diagnostics)

    # What has no stamp was stamped by the node, which a recorder at its place would have done alike.
    stamps = [stamp_ns(message) for message in residuals]
    sent = player.sent
    if not driver.is_stamped:
        arrivals = iter(stamps)
        sent[unused:] = [
            (next(arrivals) if topic == driver.torque_topic else at, topic, message)
            for at, topic, message in sent[unused:]
        ]
    write_bag(tmp_path / "bag", sent)
    replayed = replay(tmp_path / "bag", urdf, parameters)
    assert list(replayed) == stamps
    assert len(poses) == sum(row["status"] != "none" for row in replayed.values()) > 100
    for message in poses:
        row = replayed[stamp_ns(message)]
        position = message.pose.pose.position
        assert math.dist((position.x, position.y, position.z), [float(row[axis]) for axis in "xyz"]) < 1e-5, row

    if name == "lbr_state":
        check_fri_2(sent, replayed, urdf, parameters, tmp_path / "fri_2")
        assert float(counts["controller's clock behind now, s"]) > 1e8, counts


def check_fri_2(sent, replayed, urdf, parameters, bag):
    """The layout without commanded positions, in the bag and in its definition, gives the same."""
    def change(raw):
        assert len(raw) == 4 + 368
        raw = raw[:84] + raw[84 + 56:]
        assert len(raw) == 4 + 312
        return raw

    without = lambda text: text.replace("float64[7] commanded_joint_position\n", "")
    write_bag(bag, sent, change, without)
    assert replay(bag, urdf, parameters) == replayed


def without_external_torque(message):
    message.interface_values[3].interface_names[2] = "torque"


def without_values(message):
    message.interface_values.pop()


def without_names(message):
    message.tau_ext_hat_filtered.name = []


def too_few(message):
    message.data = message.data[:6]


def too_many(message):
    message.data.append(0.0)


@pytest.mark.parametrize(
    "name, spoil, counted",
    [
        ("iiwa_ros2", too_few, "refused, wrong length"),
        ("iiwa_ros2", too_many, "refused, wrong length"),
        ("lbr_dynamic", without_external_torque, "refused, joint missing"),
        ("lbr_dynamic", without_values, "refused, unreadable"),
        ("franka_state", without_names, "refused, joint missing"),
    ],
)
def test_what_a_driver_does_wrong_is_counted_and_survived(peer, start, samples, tmp_path, name, spoil, counted):
    driver = DRIVERS[name]
    node = begin(start, driver, tmp_path / "arm.urdf", tmp_path / "parameters.yaml")
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    count = lambda key: int(newest(diagnostics).get(key, 0))

    def spoiled(driver, sample):
        messages = DRIVERS[name].messages(driver, sample)
        spoil(messages[driver.torque_topic])
        return messages

    player = Player(peer, driver, samples[0])
    player.start(samples[0], lambda: count("refused, not finite") > 0)
    player.driver = dataclasses.replace(driver, messages=spoiled)
    stamps = itertools.count(samples[0].stamp_ns, 10_000_000)

    def sent():
        player.send(dataclasses.replace(samples[0], stamp_ns=next(stamps)))

    peer.wait_until(lambda: sent() or count(counted) > 0, f"the count of '{counted}' to rise")
    used = count("samples used")
    player.driver = driver
    peer.wait_until(lambda: sent() or count("samples used") > used, "good messages to be used")
    assert node.process.poll() is None


def test_a_source_that_is_none_is_refused_by_name(start):
    node = start(**{"robot.description_file": URDF, "input.source": "joint_states"})
    assert node.wait() == 2
    log = node.log()
    assert "parameter input.source" in log and "joint_states" in log and "lbr_state" in log, log
