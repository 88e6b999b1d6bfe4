#!/usr/bin/env python3
"""Fetches models that others wrote, for `asid explore` and the example `motions`.

    python3 sysid/examples/motions/fetch.py DIR

Wheels are pinned by version and hash and are not kept. Models are made plain by withheld/models/fetch.py: what is only to be
looked at goes, files that are included are put in, defaults are written out, and sensors are those of joints and free bodies.
The time step stays as its authors chose it. Besides, this script takes out what is not the machine (`drop`) and shapes that
are meshes, whose bodies have their inertia written down, and writes a first keyframe: the posture that a motion begins in.
"""

import pathlib
import sys
import tempfile
import xml.etree.ElementTree as ET
import zipfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "withheld" / "models"))
import fetch  # noqa: E402

# Wheels: package, version, SHA-256.
GYMNASIUM = ("gymnasium", "1.2.1", "85cd1c16351db0b89f73be54e952ddfece97b56d1e5400d2dcd59f58b7707963")
DM_CONTROL = ("dm_control", "1.0.34", "0ecb93d28c43f7dd1b20182df2bcd3caea413d6e945669470649b49fc13cc1c5")
GYM_ALOHA = ("gym_aloha", "0.1.5", "1794dd9a1146268a9b56f4a4931bcba69ca27714c2ac9ac146e471801bf0c7b3")
ROBOTICS = ("gymnasium_robotics", "1.4.2", "a1743530431cb377e6b3b956d284bc96436fc68bac1648ef205054c178e7dc4b")

# Name, wheel, file in it, what is dropped by name, joints that do not begin at zero (rad, m).
MODELS = [
    # It begins hanging.
    ("cart-pole", DM_CONTROL, "dm_control/suite/cartpole.xml", [], {"hinge_1": 3.141592653589793}),
    # Seven joints driven by motors, without gravity, over a table; the elbow begins away from its stop.
    (
        "pusher",
        GYMNASIUM,
        "gymnasium/envs/mujoco/assets/pusher_v5.xml",
        ["object", "goal"],
        {"r_elbow_flex_joint": -1.0, "r_wrist_flex_joint": -0.5},
    ),
    # The left one of two arms, in the posture of the authors' keyframe.
    (
        "viperx",
        GYM_ALOHA,
        "gym_aloha/assets/bimanual_viperx_transfer_cube.xml",
        ["vx300s_right", "box", "table", "midair"],
        {
            "vx300s_left/shoulder": -0.96,
            "vx300s_left/elbow": 1.16,
            "vx300s_left/wrist_angle": -0.3,
            "vx300s_left/left_finger": 0.024,
            "vx300s_left/right_finger": -0.024,
        },
    ),
    # Half closed, the thumb aside.
    (
        "shadow-hand",
        ROBOTICS,
        "gymnasium_robotics/envs/assets/hand/reach.xml",
        [],
        {
            **{f"robot0:{finger}FJ{joint}": 0.5 for finger in "FMRL" for joint in "12"},
            **{f"robot0:{finger}FJ0": 0.57 for finger in "FMRL"},
            "robot0:LFJ4": 0.2,
            "robot0:THJ3": 0.4,
            "robot0:THJ0": -0.3,
        },
    ),
    # On flat ground, without walls and ball.
    (
        "quadruped",
        DM_CONTROL,
        "dm_control/suite/quadruped.xml",
        ["ball", "wall_px", "wall_py", "wall_nx", "wall_ny", "terrain"],
        {},
    ),
]

# Sections whose elements name others, by these attributes.
SECTIONS = ("actuator", "sensor", "tendon", "equality", "contact")
REFERENCES = ("joint", "joint1", "joint2", "objname", "body1", "body2", "geom1", "geom2")


def take_out(element, dropped):
    """Takes out elements by name, and shapes that are meshes or height fields."""
    for child in list(element):
        if child.get("name") in dropped or (child.tag == "geom" and (child.get("mesh") or child.get("hfield"))):
            element.remove(child)
        else:
            take_out(child, dropped)


def take_out_references(root):
    """Takes out elements that name what is not there."""
    names = {e.get("name") for e in root.find("worldbody").iter()} | {"world"}
    for section in (s for tag in SECTIONS for s in root.findall(tag)):
        for child in list(section):
            if any(child.get(key, "world") not in names for key in REFERENCES):
                section.remove(child)


def posture(root, joints):
    """The first keyframe: positions by joint, zero elsewhere, and commands of servos that hold them."""
    qpos, at = [], {}
    for body in root.find("worldbody").iter("body"):
        for joint in body:
            if joint.tag == "freejoint" or (joint.tag == "joint" and joint.get("type") == "free"):
                qpos += [float(x) for x in body.get("pos", "0 0 0").split()] + [1.0, 0.0, 0.0, 0.0]
            elif joint.tag == "joint":
                at[joint.get("name")] = joints.get(joint.get("name"), 0.0)
                qpos.append(at[joint.get("name")])
    missing = set(joints) - set(at)
    if missing:
        raise SystemExit(f"no such joints: {missing}")
    ctrl = []
    for actuator in root.iterfind("actuator/*"):
        gear = float(actuator.get("gear", "1").split()[0])
        ctrl.append(gear * at[actuator.get("joint")] if actuator.tag == "position" else 0.0)
    text = {"qpos": qpos, "ctrl": ctrl}
    key = {name: " ".join(f"{x:.10g}" for x in values) for name, values in text.items()}
    ET.SubElement(ET.SubElement(root, "keyframe"), "key", {"name": "begin", **key})


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    out = pathlib.Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    fetch.LARGEST_STEP = float("inf")
    with tempfile.TemporaryDirectory() as folder:
        wheels = {}
        for name, source, path, dropped, joints in MODELS:
            if source not in wheels:
                wheels[source] = fetch.wheel(*source, folder)
            with zipfile.ZipFile(wheels[source]) as archive:
                root = ET.fromstring(fetch.machine(archive.read, path, name))
            take_out(root.find("worldbody"), set(dropped))
            take_out_references(root)
            posture(root, joints)
            ET.indent(root)
            file = out / f"{name}.xml"
            file.write_text(ET.tostring(root, encoding="unicode") + "\n")
            print(file)


main()
