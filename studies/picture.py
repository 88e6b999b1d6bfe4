"""Draws signals of a diagnosis, one above the other: the machine, and the model as given, identified and refined.

    python3 picture.py RESULT/trace.json EPISODE SIGNAL... > picture.svg

RESULT is a folder that `asid diagnose` wrote; EPISODE is one of the held-out logs in it, SIGNAL a sensor of it.
"""

import json
import sys

WIDTH, PANEL, GAP = 760, 190, 26
LEFT, RIGHT, TOP = 62, 14, 40
# Colours that also differ in lightness.
CURVES = [
    ("nominal", "model as given", "#9a9a9a", 1.4, "2 3"),
    ("identified", "identified (parameters fitted)", "#d08a1d", 1.6, "7 4"),
    ("refined", "refined (with the effects)", "#1f6fb5", 2.0, ""),
    ("real", "machine", "#111111", 1.4, ""),
]


def ticks(low, high, n):
    """Round numbers within a range, about n of them."""
    raw = (high - low) / n
    for power in (10.0**k for k in range(-6, 7)):
        for m in (1, 2, 5):
            step = m * power
            if step >= raw:
                first = int(low // step) + (low % step > 1e-9 * step)
                last = int(high // step + 1e-9)
                return [k * step for k in range(first, last + 1)]
    return []


def panel(signal, y0, last):
    """One signal over time."""
    series = [[x for x in signal[name] if x is not None] for name, *_ in CURVES]
    real = series[3]
    middle, half = (max(real) + min(real)) / 2, (max(real) - min(real)) / 2 or 1.0
    # A model that runs away does not flatten the rest: three times the machine's own range is shown.
    low = max(min(map(min, series)), middle - 3 * half)
    high = min(max(map(max, series)), middle + 3 * half)
    low, high = low - 0.04 * (high - low), high + 0.04 * (high - low)
    time = signal["time"]
    x = lambda t: LEFT + (t - time[0]) / (time[-1] - time[0]) * (WIDTH - LEFT - RIGHT)
    y = lambda v: y0 + PANEL * (high - min(max(v, low), high)) / (high - low)
    out = []
    for v in ticks(low, high, 4):
        out.append(f'<path d="M{LEFT} {y(v):.1f}H{WIDTH - RIGHT}" stroke="#e4e4e4"/>')
        out.append(f'<text x="{LEFT - 6}" y="{y(v) + 4:.1f}" text-anchor="end">{v:g}</text>')
    if last:
        for t in ticks(time[0], time[-1], 6):
            out.append(f'<text x="{x(t):.1f}" y="{y0 + PANEL + 16}" text-anchor="middle">{t:g}</text>')
        out.append(f'<text x="{WIDTH - RIGHT}" y="{y0 + PANEL + 32}" text-anchor="end">time (s)</text>')
    unit = f' ({signal["unit"]})' if signal["unit"] else ""
    name = signal["signal"].replace("_", " ")
    for key, _, colour, width, dash in CURVES:
        points = " ".join(f"{x(t):.1f},{y(v):.1f}" for t, v in zip(time, signal[key]) if v is not None)
        style = f' stroke-dasharray="{dash}"' if dash else ""
        out.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"{style}/>')
    out.append(f'<text x="{LEFT + 6}" y="{y0 + 14}" font-weight="bold">{name}{unit}</text>')
    out.append(f'<rect x="{LEFT}" y="{y0}" width="{WIDTH - LEFT - RIGHT}" height="{PANEL}" fill="none" stroke="#888"/>')
    return out


def main(path, episode, names):
    trace = json.load(open(path))
    found = {s["signal"]: s for s in trace["signals"] if s["episode"] == episode}
    missing = [n for n in names if n not in found]
    if missing:
        known = sorted({(s["episode"], s["signal"]) for s in trace["signals"]})
        sys.exit(f"{path} has no {missing} of {episode}; it has {known}")
    height = TOP + len(names) * (PANEL + GAP) + 14
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="12">',
        f"<title>{episode}: machine and models</title>",
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    at = LEFT
    for _, text, colour, width, dash in reversed(CURVES):
        style = f' stroke-dasharray="{dash}"' if dash else ""
        out.append(f'<path d="M{at} 20h24" stroke="{colour}" stroke-width="{width}"{style}/>')
        out.append(f'<text x="{at + 29}" y="24">{text}</text>')
        at += 52 + 6.1 * len(text)
    for i, name in enumerate(names):
        out += panel(found[name], TOP + i * (PANEL + GAP), i + 1 == len(names))
    print("\n".join([*out, "</svg>"]))


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
