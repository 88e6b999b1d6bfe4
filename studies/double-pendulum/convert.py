"""Cuts the published records of a double pendulum into episodes of 1.6 s.

usage: convert.py FOLDER, where FOLDER is data/experiment_records of dfki-ric-underactuated-lab/double_pendulum.
Writes the CSV files into this script's folder.
"""

import pathlib
import sys

import numpy as np

ROWS = 400  # of an episode, after decimation: 1.6 s
STEP = 2  # every second row: 4 ms between rows, as sent at 500 Hz
STARTS = [1.0, 4.0, 7.0]  # s into a recording, the same in all
# Recordings and the names of their episodes: trained on those of one day, tested on those of another.
RECORDS = [
    ("design_A.0/20220815/sys_id/trajectory_00.csv", "train_a"),
    ("design_A.0/20220815/sys_id/trajectory_01.csv", "train_b"),
    ("design_A.0/20220815/sys_id/trajectory_02.csv", "train_c"),
    ("design_A.0/20220815/sys_id/trajectory_03.csv", "train_d"),
    ("design_A.0/20220812/sys_id/20220812-055640-PM_measured.csv", "test_e"),
    ("design_A.0/20220812/sys_id/20220812-055903-PM_measured.csv", "test_f"),
]
# Ours: what the two days call it.
COLUMNS = {
    "ctrl.shoulder": ("tau_con1", "tau1"),
    "ctrl.elbow": ("tau_con2", "tau2"),
    "shoulder_angle": ("pos_meas1", "pos1"),
    "elbow_angle": ("pos_meas2", "pos2"),
    "shoulder_speed": ("vel_meas1", "vel1"),
    "elbow_speed": ("vel_meas2", "vel2"),
}
DIGITS = {"time": 5, "ctrl.shoulder": 5, "ctrl.elbow": 5, "shoulder_angle": 6, "elbow_angle": 6}
HERE = pathlib.Path(__file__).parent


def main():
    for path, name in RECORDS:
        source = pathlib.Path(sys.argv[1]) / path
        with open(source) as f:
            head = [name.strip() for name in f.readline().split(",")]
        table = np.loadtxt(source, delimiter=",", skiprows=1)
        time = table[:, head.index("time")]
        for start in STARTS:
            first = int(np.searchsorted(time, start))
            rows = slice(first, first + ROWS * STEP, STEP)
            columns = {"time": time[rows] - time[first]}
            for ours, theirs in COLUMNS.items():
                columns[ours] = table[rows, head.index(next(t for t in theirs if t in head))]
            lines = [",".join(columns)]
            for i in range(len(columns["time"])):
                lines.append(",".join(f"{v[i]:.{DIGITS.get(k, 4)}f}" for k, v in columns.items()))
            (HERE / f"{name}_{start:.0f}s.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
