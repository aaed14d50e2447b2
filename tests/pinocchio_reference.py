#!/usr/bin/env python3
"""Writes what Pinocchio says of the dynamics of three robots, to compare crates/model with.

    python3 -m venv venv && venv/bin/pip install pin==4.1.0
    venv/bin/python tests/pinocchio_reference.py

The values are kept beside the URDFs, in crates/model/tests/dynamics/*.json; crates/model/tests/pinocchio.rs reads them, so
that the tests themselves need no Pinocchio. The same version gives the same files. Joints are in the order in which
`joints` names them; a matrix is a list of rows. C is the Coriolis matrix of computeCoriolisMatrix.
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin

ROOT = Path(__file__).resolve().parent.parent
TESTS = ROOT / "crates/model/tests/dynamics"
CASES = 4

# Name, URDF, gravity in the root frame, and the payload: link, mass, centre, inertia (xx, xy, xz, yy, yz, zz).
ROBOTS = [
    ("iiwa14", ROOT / "urdf/iiwa14.urdf", [0.0, 0.0, -9.81], None),
    (
        "iiwa14_on_the_wall",
        ROOT / "urdf/iiwa14.urdf",
        [9.81, 0.0, 0.0],
        ("lbr_link_7", 2.5, [0.02, -0.01, 0.12], [0.011, 0.001, -0.002, 0.013, 0.0005, 0.006]),
    ),
    ("tree", TESTS / "tree.urdf", [0.0, 0.0, -9.81], None),
    (
        "tree_with_a_load",
        TESTS / "tree.urdf",
        [1.5, -2.5, -9.0],
        ("tip", 1.3, [0.03, 0.04, -0.02], [0.002, 0.0, 0.0001, 0.003, 0.0, 0.0025]),
    ),
    ("gantry", TESTS / "gantry.urdf", [0.0, 0.0, -9.81], None),
]


def symmetric(six):
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def add_payload(model, payload):
    link, mass, centre, inertia = payload
    frame = model.frames[model.getFrameId(link)]
    body = pin.Inertia(mass, np.array(centre), symmetric(inertia))
    model.appendBodyToJoint(frame.parentJoint, body, frame.placement)


def configuration(model, q):
    """Pinocchio's own configuration: an endless joint has a cosine and a sine."""
    return pin.integrate(model, pin.neutral(model), q)


def case(model, data, random):
    q, v, a = (scale * random.uniform(-1, 1, model.nv) for scale in (1.2, 2.0, 4.0))
    at = configuration(model, q)
    mass = pin.crba(model, data, at).copy()
    mass = np.triu(mass) + np.triu(mass, 1).T
    coriolis = pin.computeCoriolisMatrix(model, data, at, v).copy()
    values = {
        "position": q,
        "velocity": v,
        "acceleration": a,
        "mass_matrix": mass,
        "gravity_torque": pin.computeGeneralizedGravity(model, data, at).copy(),
        "coriolis_torque": coriolis @ v,
        "coriolis_transpose": coriolis.T @ v,
        "momentum": mass @ v,
        "inverse_dynamics": pin.rnea(model, data, at, v, a).copy(),
    }
    return {name: value.tolist() for name, value in values.items()}


def main():
    for seed, (name, urdf, gravity, payload) in enumerate(ROBOTS):
        model = pin.buildModelFromUrdf(str(urdf))
        model.gravity.linear = np.array(gravity)
        if payload:
            add_payload(model, payload)
        random = np.random.default_rng(seed)
        reference = {
            "pinocchio": pin.__version__,
            "gravity": gravity,
            "payload": dict(zip(("link", "mass", "centre", "inertia"), payload)) if payload else None,
            "joints": list(model.names)[1:],
            "cases": [case(model, model.createData(), random) for _ in range(CASES)],
        }
        text = json.dumps(reference, indent=1)
        (TESTS / f"{name}.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
