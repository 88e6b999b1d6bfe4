"""Writes the first published tosses of the ContactNets elbow as episodes.

usage: convert.py FILE, where FILE is the table of all tosses (README.md says how it is made from the published tensors).
Writes the CSV files into this script's folder.
"""

import pathlib
import sys

import numpy as np

TRAIN, TEST = 20, 10  # the first 20 tosses train, the next 10 test
ROWS = 60  # of 121: the flight and the first impacts, 0.4 s
STEP_S = 0.0068
COLUMNS = ["pose_pos.0", "pose_pos.1", "pose_pos.2"] + [f"pose_quat.{i}" for i in range(4)] + ["hinge_angle"]
HERE = pathlib.Path(__file__).parent


def main():
    table = np.genfromtxt(sys.argv[1], delimiter=",", names=True)
    for toss in range(TRAIN + TEST):
        rows = table[table["toss"] == toss][:ROWS]
        # The published angle is wrapped into ±pi; a hinge's reading is not.
        angle = np.unwrap(rows["th"])
        lines = ["time," + ",".join(COLUMNS)]
        for row, theta in zip(rows, angle, strict=True):
            place = ",".join(f"{row[c]:.6f}" for c in ("px", "py", "pz"))
            turn = ",".join(f"{row[c]:.6f}" for c in ("qw", "qx", "qy", "qz"))
            lines.append(f"{row['step'] * STEP_S:.4f},{place},{turn},{theta:.5f}")
        name = f"train_{toss:02d}" if toss < TRAIN else f"test_{toss:02d}"
        (HERE / f"{name}.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
