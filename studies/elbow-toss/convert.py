"""Writes published tosses of the ContactNets elbow as episodes.

usage: convert.py FILE            the first 30 tosses, into this script's folder
       convert.py FILE flights    the flight of every toss, as a study in the folder `flights`

FILE is the table of all tosses (README.md says how it is made from the published tensors).
"""

import pathlib
import sys

import numpy as np

TRAIN, TEST = 20, 10  # the first 20 tosses train, the next 10 test
ROWS = 60  # of 121: the flight and the first impacts, 0.4 s
STEP_S = 0.0068
COLUMNS = ["pose_pos.0", "pose_pos.1", "pose_pos.2"] + [f"pose_quat.{i}" for i in range(4)] + ["hinge_angle"]
HERE = pathlib.Path(__file__).parent


CLEAR_M = 0.012  # a flight ends where a corner comes as low as that
FLIGHT_ROWS = (7, 20)  # shorter flights tell too little


def turned(quaternion, vectors):
    """Vectors turned by a quaternion w x y z."""
    w, axis = quaternion[0], quaternion[1:]
    return vectors + 2 * np.cross(axis, np.cross(axis, vectors) + w * vectors)


def lowest(row, angle):
    """Height of the lowest corner of both bars."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    first = signs * [0.05, 0.025, 0.025]
    about = np.array([np.cos(angle / 2), 0, np.sin(angle / 2), 0])
    second = turned(about, first + [0.035, 0, 0]) + [-0.035, 0.06, 0]
    pose = np.array([row[c] for c in ("qw", "qx", "qy", "qz")])
    return row["pz"] + turned(pose, np.vstack([first, second]))[:, 2].min()


def write(path, rows, angle):
    lines = ["time," + ",".join(COLUMNS)]
    for row, theta in zip(rows, angle, strict=True):
        place = ",".join(f"{row[c]:.6f}" for c in ("px", "py", "pz"))
        turn = ",".join(f"{row[c]:.6f}" for c in ("qw", "qx", "qy", "qz"))
        lines.append(f"{row['step'] * STEP_S:.4f},{place},{turn},{theta:.5f}")
    path.write_text("\n".join(lines) + "\n")


def write_tosses(table):
    for toss in range(TRAIN + TEST):
        rows = table[table["toss"] == toss][:ROWS]
        # The published angle is wrapped into ±pi; a hinge's reading is not.
        name = f"train_{toss:02d}" if toss < TRAIN else f"test_{toss:02d}"
        write(HERE / f"{name}.csv", rows, np.unwrap(rows["th"]))


def write_flights(table, folder):
    folder.mkdir()
    study = (HERE / "study.toml").read_text()
    # Nothing is touched, so that there is no friction of the board to fit.
    head, noise = study[: study.index("[[parameter]]")], study[study.index("[noise]") :]
    (folder / "study.toml").write_text(head + noise)
    scene = (HERE / "nominal.xml").read_text().splitlines()
    (folder / "nominal.xml").write_text("\n".join(line for line in scene if 'name="board"' not in line) + "\n")
    for toss in np.unique(table["toss"]).astype(int):
        rows = table[table["toss"] == toss]
        angle = np.unwrap(rows["th"])
        low = [lowest(row, theta) < CLEAR_M for row, theta in zip(rows, angle, strict=True)]
        end = min(low.index(True) - 1 if True in low else len(rows), FLIGHT_ROWS[1])
        if end >= FLIGHT_ROWS[0]:
            kind = "test" if toss % 3 == 2 else "train"
            write(folder / f"{kind}_{toss:03d}.csv", rows[:end], angle[:end])


def main():
    table = np.genfromtxt(sys.argv[1], delimiter=",", names=True)
    if sys.argv[2:] == ["flights"]:
        write_flights(table, pathlib.Path("flights"))
    else:
        write_tosses(table)


if __name__ == "__main__":
    main()
