"""Cuts the published logs of a Dynamixel XL330 that turns a pendulum into episodes.

usage: convert.py FOLDER, where FOLDER holds the processed logs (*.json) of Rhoban/bam.
Writes the CSV files into this script's folder.
"""

import json
import pathlib
import sys

WINDOW_S = 2.0
# Firmware P gains that have a model here: folder of the logs, relative to this script.
GAINS = {400: ".", 200: "gain-200"}
HERE = pathlib.Path(__file__).parent


def windows(log):
    """Pieces of WINDOW_S in which the torque is on throughout, as lists of entries."""
    length = round(WINDOW_S / log["dt"])
    entries = log["entries"]
    for k, start in enumerate(range(0, len(entries), length)):
        # The reading at the end of a piece counts as well, where there is one.
        piece = entries[start : start + length + 1]
        if len(piece) >= length and all(e["torque_enable"] for e in piece[:length]):
            yield k, piece[:length]


def write(path, piece):
    path.parent.mkdir(exist_ok=True)
    rows = ["time,ctrl.servo,angle"]
    for e in piece:
        time = e["timestamp"] - piece[0]["timestamp"]
        rows.append(f"{time:.3f},{e['goal_position']:.6f},{e['position']:.6f}")
    path.write_text("\n".join(rows) + "\n")


def main():
    for source in sorted(pathlib.Path(sys.argv[1]).glob("*.json")):
        log = json.loads(source.read_text())
        if log["kp"] not in GAINS:
            continue
        for k, piece in windows(log):
            # The middle third of every recording is held out.
            part = "test" if k == 1 else "train"
            name = log["trajectory"].replace("_", "-")
            write(HERE / GAINS[log["kp"]] / f"{part}_{name}_{k}.csv", piece)


if __name__ == "__main__":
    main()
