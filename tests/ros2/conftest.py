"""Fixtures: a domain a test, a peer, and the node as a process that must end well."""

from pathlib import Path

import pytest
from support import NODE, PARTICLES, URDF, PalpateNode, Peer, new_domain, palpate


@pytest.fixture
def domain():
    return new_domain()


@pytest.fixture
def peer(domain):
    peer = Peer(domain)
    yield peer
    peer.close()


@pytest.fixture
def start(domain, tmp_path):
    """Starts nodes; those that still run at the end must end with exit code 0."""
    nodes = []

    def start_node(*arguments, program=NODE, environment=None, **parameters):
        log = tmp_path / f"node_{len(nodes)}.log"
        node = PalpateNode(domain, log, *arguments, parameters=parameters, program=program, environment=environment)
        nodes.append(node)
        return node

    yield start_node
    running = [node for node in nodes if node.process.poll() is None]
    codes = [node.end() for node in running]
    for node in nodes:
        print(node.log())
    assert codes == [0] * len(running)


@pytest.fixture
def node(start):
    """A node with the arm that ships with the project, and few particles."""
    return start(**{"robot.description_file": URDF, "filter.palpate.hypotheses": 100})


@pytest.fixture(scope="session")
def bag(tmp_path_factory):
    """A bag of the project's own simulator: see contact.yaml."""
    out = tmp_path_factory.mktemp("simulated") / "contact"
    palpate("simulate", Path(__file__).with_name("contact.yaml"), "--out", out)
    return out / "bag"


@pytest.fixture(scope="session")
def parameters(tmp_path_factory):
    """Few particles, for speed, and always as many; a wait so long that nothing is lost, however slow the machine is."""
    path = tmp_path_factory.mktemp("parameters") / "parameters.yaml"
    hypotheses = {"filter.palpate.hypotheses": PARTICLES, "filter.palpate.min_hypotheses": PARTICLES}
    values = {**hypotheses, "input.max_wait_secs": 3600, "seed": 5}
    lines = [f"    {name}: {value}" for name, value in values.items()]
    path.write_text("\n".join(["/**:", "  ros__parameters:", *lines]))
    return path
