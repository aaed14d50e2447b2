"""What the tests against a real ROS 2 share: the node as a process, and a peer that listens and speaks."""

import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState

ROOT = Path(__file__).resolve().parents[2]
NODE = Path(os.environ["PALPATE_NODE"])
URDF = ROOT / "urdf" / "iiwa14.urdf"
JOINTS = [f"lbr_A{number}" for number in range(1, 8)]
LIMIT_SECS = 30.0
# Of the tests with a simulated bag.
PARTICLES = 200
SAMPLES = 600

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)

_domains = itertools.count(os.getpid())


def new_domain():
    """A ROS domain of one test's own, so that tests do not hear each other."""
    return 1 + next(_domains) % 100


class PalpateNode:
    """The node, or another program, as a process. Its log is kept, for the tests to read."""

    def __init__(self, domain, log, *arguments, parameters=None, program=NODE, environment=None):
        command = [program, *arguments, "--ros-args"]
        for name, value in (parameters or {}).items():
            command += ["-p", f"{name}:={value}"]
        self.log_path = log
        environment = dict(environment or os.environ, ROS_DOMAIN_ID=str(domain), NO_COLOR="1")
        with open(log, "w") as stderr:
            self.process = subprocess.Popen(command, stderr=stderr, env=environment)

    def log(self):
        return self.log_path.read_text()

    def end(self, by=signal.SIGTERM):
        """Asks the node to end, and gives its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(by)
        return self.wait()

    def wait(self):
        try:
            return self.process.wait(LIMIT_SECS)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


class Peer:
    """An rclpy node in the same domain as the node under test."""

    def __init__(self, domain):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("peer", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def listen(self, kind, topic, qos=10):
        """A list that grows with each message."""
        heard = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        return heard

    def wait_until(self, condition, what, limit_secs=LIMIT_SECS):
        """Spins until `condition()` holds."""
        end = time.monotonic() + limit_secs
        while not condition():
            assert time.monotonic() < end, f"waited {limit_secs} s in vain for {what}"
            self.executor.spin_once(0.02)

    def call(self, kind, name, **fields):
        """What a service answers."""
        future = self.ask(kind, name, **fields)
        self.wait_until(future.done, f"an answer from {name}")
        return future.result()

    def ask(self, kind, name, **fields):
        """Calls a service, and gives what will hold its answer."""
        client = self.node.create_client(kind, name)
        self.wait_until(client.service_is_ready, f"the service {name}")
        return client.call_async(kind.Request(**fields))

    def counts(self, diagnostics):
        """The newest values on /diagnostics, by name."""
        seen = len(diagnostics)
        self.wait_until(lambda: len(diagnostics) > seen, "diagnostics")
        return {value.key: value.value for value in diagnostics[-1].status[0].values}


class Arm:
    """A driver's two topics, with the arm at rest unless told otherwise."""

    def __init__(self, peer, qos=10, namespace=""):
        self.peer = peer
        self.positions = peer.node.create_publisher(JointState, f"{namespace}joint_states", qos)
        self.torques = peer.node.create_publisher(JointState, f"{namespace}external_torque", qos)
        # What the driver's clock is ahead by, and its last stamp.
        self.offset_ns = 0
        self.stamp_ns = 0

    def is_heard(self):
        return bool(self.positions.get_subscription_count() and self.torques.get_subscription_count())

    def wait_until_heard(self):
        self.peer.wait_until(self.is_heard, "the node to subscribe")

    def send(self, positions=None, torques=None, names=JOINTS, stamp_ns=None, torque_ahead_ns=0):
        """Sends one message on each topic, stamped now unless told otherwise."""
        if stamp_ns is None:
            self.stamp_ns = stamp_ns = time.time_ns() + self.offset_ns
        zeros = [0.0] * len(names)
        state = joint_state(stamp_ns, names)
        state.position = zeros if positions is None else positions
        self.positions.publish(state)
        effort = joint_state(stamp_ns + torque_ahead_ns, names)
        effort.effort = zeros if torques is None else torques
        self.torques.publish(effort)

    def send_until(self, condition, what, **message):
        """Keeps sending the same message until `condition()` holds."""
        def sent():
            self.send(**message)
            return condition()
        self.peer.wait_until(sent, what)


def joint_state(stamp_ns, names):
    message = JointState(name=list(names))
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    return message


def palpate(*arguments):
    """Runs the command line, which must succeed."""
    subprocess.run([os.environ["PALPATE"], *arguments, "--quiet"], check=True)


def play(bag, domain, *options):
    """Starts a process that plays a bag's samples on the node's topics."""
    command = [sys.executable, Path(__file__).with_name("play_bag.py"), bag, *options]
    return subprocess.Popen(command, env=dict(os.environ, ROS_DOMAIN_ID=str(domain)))
