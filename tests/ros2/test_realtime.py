"""Priority and cores that the system grants are had; what it refuses is a warning, and the node works on."""

import os
import sys
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from support import NODE, URDF, Arm

# Becomes the program that is named after it, without the right to raise its priority, even if it is root's.
POWERLESS = """
import ctypes, os, resource, sys
PR_CAPBSET_DROP, CAP_SYS_NICE = 24, 23
ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_SYS_NICE, 0, 0, 0)
resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
os.execv(sys.argv[1], sys.argv[1:])
"""


def wait_until_it_works(peer):
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    used = lambda: diagnostics and int(peer.counts(diagnostics)["samples used"]) > 0
    Arm(peer).send_until(used, "samples to be used")


def threads(node):
    """The thread ids of a node, by name."""
    tasks = Path(f"/proc/{node.process.pid}/task").iterdir()
    return {(task / "comm").read_text().strip(): int(task.name) for task in tasks}


def may_raise():
    """Whether this system grants real-time priority to the likes of this process."""
    tried = os.fork()
    if tried == 0:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        except OSError:
            os._exit(1)
        os._exit(0)
    return os.waitpid(tried, 0)[1] == 0


def test_what_the_system_refuses_is_a_warning(peer, start):
    asked = {"realtime.priority": 50, "realtime.cores": "[1000]"}
    node = start("-c", POWERLESS, NODE, program=sys.executable, **{"robot.description_file": URDF}, **asked)
    wait_until_it_works(peer)
    assert "the system refuses the real-time priority 50: Operation not permitted" in node.log()
    assert "the system refuses the cores [1000]" in node.log()
    estimation = threads(node)["estimation"]
    assert os.sched_getscheduler(estimation) == os.SCHED_OTHER
    assert os.sched_getaffinity(estimation) == os.sched_getaffinity(0)


def test_what_the_system_grants_is_had(peer, start):
    core = min(os.sched_getaffinity(0))
    asked = {"realtime.priority": 1, "realtime.cores": f"[{core}]"}
    node = start(**{"robot.description_file": URDF}, **asked)
    wait_until_it_works(peer)
    found = threads(node)
    for thread in (found["estimation"], node.process.pid):
        assert os.sched_getaffinity(thread) == {core}
        expected = os.SCHED_FIFO if may_raise() else os.SCHED_OTHER
        assert os.sched_getscheduler(thread) == expected
    assert ("refuses" in node.log()) != may_raise()
    # Pictures can wait.
    assert os.sched_getscheduler(found["drawing"]) == os.SCHED_OTHER
