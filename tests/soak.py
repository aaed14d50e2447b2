"""The node beside a driver of 1 kHz, over real ROS 2 topics, for as long as you like: what was lost, how long estimates
took from the sample's stamp to a listener, memory and processor time.

    . tests/ros2_env.sh
    cargo build --release -p palpate-node --features ros2 --bins --example listener
    python3 tests/soak.py --minutes 10
    python3 tests/soak.py --minutes 10 -p filter.method:=paper -p filter.paper.rate_hz:=1000.0

Ends with 1 if samples were lost or the counts do not add up. Times are told, and judged by nobody here: they depend on
what else the machine does.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor

ROOT = Path(__file__).resolve().parents[1]
# A ball touches link 4 for ten seconds, forth and back, with two free ones between.
SCENARIO = """
link: lbr_link_4
obstacle: {kind: sphere, radius: 0.03}
rate_hz: %s
lead_in_secs: 2
duration_secs: 12
noise_floor: 0.02
seed: 3
"""
LOST = [
    "samples lost, filter too slow", "torques without position", "positions without torque", "refused, joint missing",
    "refused, wrong length", "refused, unreadable", "refused, not measured", "refused, not finite",
    "refused, too large", "refused, stamp not after",
]  # fmt: skip
LIMIT_SECS = 30.0


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=1000.0, help="samples a second, Hz (default 1000)")
    parser.add_argument("--programs", type=Path, default=ROOT / "target" / "release", help="folder of palpate_node")
    parser.add_argument("-p", dest="parameters", action="append", default=[], metavar="NAME:=VALUE", help="of the node")
    return parser.parse_args()


class Process:
    """A program in the soak's domain, and what the system says of it."""

    def __init__(self, program, *parameters):
        command = [program, "--ros-args"]
        for parameter in parameters:
            command += ["-p", parameter]
        environment = dict(os.environ, RUST_LOG=os.environ.get("RUST_LOG", "warn"))
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)

    def resident_mb(self):
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return next(int(line.split()[1]) / 1024 for line in status.splitlines() if line.startswith("VmRSS"))

    def processor_secs(self):
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self):
        """Ends it, and gives what it printed."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        out, _ = self.process.communicate(timeout=LIMIT_SECS)
        if self.process.returncode != 0:
            sys.exit(f"{self.process.args[0]} ended with {self.process.returncode}")
        return out


class Diagnostics:
    """What the node tells once a second."""

    def __init__(self):
        rclpy.init()
        self.node = rclpy.create_node("soak")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.told = []
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self.hear, 10)

    def hear(self, message):
        self.told.append({value.key: value.value for value in message.status[0].values})

    def spin(self, until, limit_secs):
        end = time.monotonic() + limit_secs
        while not until() and time.monotonic() < end:
            self.executor.spin_once(0.2)

    def next(self):
        seen = len(self.told)
        self.spin(lambda: len(self.told) > seen, LIMIT_SECS)
        if len(self.told) == seen:
            sys.exit(f"no diagnostics in {LIMIT_SECS} s")
        return self.told[-1]


def most(told, key):
    """The largest of what was told each second, without those of the seconds in which nothing came."""
    return max((float(values[key]) for values in told if values.get(key, "none") != "none"), default=float("nan"))


def particles(told):
    """Fewest and most that the node allowed itself, as told each second in which samples came."""
    counts = [int(values["particles"]) for values in told if float(values.get("samples used, Hz", 0.0)) > 0.0]
    return min(counts, default=0), max(counts, default=0)


def soak(options, folder):
    scenario = folder / "scenario.yaml"
    scenario.write_text(SCENARIO % options.rate)
    count = round(60.0 * options.minutes * options.rate)
    diagnostics = Diagnostics()
    urdf = f"robot.description_file:={ROOT / 'urdf' / 'iiwa14.urdf'}"
    node = Process(options.programs / "palpate_node", urdf, *options.parameters)
    listener = Process(options.programs / "examples" / "listener")
    diagnostics.next()
    driver = Process(options.programs / "palpate_simulated_driver", f"scenario:={scenario}", f"samples:={count}")
    begin, used_before = time.monotonic(), node.processor_secs()
    memory = []

    def look():
        passed = time.monotonic() - begin
        # The start is the first second with samples; then a look every hundredth of the time.
        if len(memory) <= 100 * passed / (60.0 * options.minutes) and len(diagnostics.told) > 3:
            memory.append(node.resident_mb())
        return driver.process.poll() is not None

    diagnostics.spin(look, 60.0 * (3.0 * options.minutes + 1.0))
    took = time.monotonic() - begin
    processor = (node.processor_secs() - used_before) / took
    driver.end()
    # What waits is used up, and told.
    diagnostics.next()
    last = diagnostics.next()
    memory.append(node.resident_mb())
    latency = json.loads(listener.end())
    node.end()
    return count, took, processor, memory, latency, diagnostics.told, last


def report(count, took, processor, memory, latency, told, last):
    received = int(last["torque messages"])
    used = int(last["samples used"])
    rows = [
        ("samples sent", f"{count} in {took:.1f} s, {count / took:.0f} Hz"),
        ("torques received", f"{received}"),
        ("lost on the way", f"{count - received}"),
        ("samples used", f"{used}"),
        *((cause, last[cause]) for cause in LOST if last[cause] != "0"),
        ("sample to listener, p50 · p99 · max, ms", " · ".join(milliseconds(latency[at]) for at in ("p50_ms", "p99_ms", "max_ms"))),
        ("… of so many contact poses", f"{latency['count']}"),
        ("step, largest p50 · p99 · max of a second, ms", " · ".join(f"{most(told, f'step {at}, ms'):.3f}" for at in ("p50", "p99", "max"))),
        ("particles, fewest · most", " · ".join(str(at) for at in particles(told))),
        ("memory at start · middle · end, MB", " · ".join(f"{at:.1f}" for at in (memory[0], memory[len(memory) // 2], memory[-1]))),
        ("share of one core", f"{100 * processor:.0f} %"),
    ]  # fmt: skip
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"{name:<{width}}  {value}")
    lost = sum(int(last[cause]) for cause in LOST if cause != "positions without torque")
    print()
    if used + lost != received:
        print(f"the counts do not add up: {used} used and {lost} lost are not {received} received")
    elif used != count:
        print(f"{count - used} samples lost")
    else:
        print("every sample used")
    return used == count


def milliseconds(value):
    return "none" if value is None else f"{value:.3f}"


def main():
    options = arguments()
    # A domain of its own, on this machine.
    os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    with tempfile.TemporaryDirectory() as folder:
        all_used = report(*soak(options, Path(folder)))
    sys.exit(0 if all_used else 1)


if __name__ == "__main__":
    main()
