"""Draws the report's pictures as SVG: the part with its deviation, bars, curves, histogram."""

import math

INK = "#1b2733"
GRID = "#d7dee5"
STAGE_COLOURS = {"as set up": "#b3261e", "identified": "#b36b00", "identified and compensated": "#1b7f4b"}


def _escape(text):
    return str(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _text(x, y, words, size=12, anchor="start", colour=INK, weight="normal"):
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" fill="{colour}" '
        f'font-weight="{weight}" font-family="sans-serif">{_escape(words)}</text>'
    )


def _svg(width, height, body):
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
        f'<rect width="{width}" height="{height}" fill="white"/>' + "".join(body) + "</svg>"
    )


def nice_step(span, wanted):
    """A step of 1, 2 or 5 times a power of ten that divides span into about `wanted` parts."""
    raw = max(span, 1e-12) / max(1, wanted)
    power = 10.0 ** math.floor(math.log10(raw))
    for factor in (1, 2, 5, 10):
        if raw <= factor * power:
            return factor * power
    return 10 * power


def colour_of(deviation_mm, full_mm):
    """Green at 0, yellow at half, red from full_mm on."""
    share = min(1.0, abs(deviation_mm) / full_mm)
    if share < 0.5:
        mix = share / 0.5
        low, high = (27, 127, 75), (230, 180, 30)
    else:
        mix = (share - 0.5) / 0.5
        low, high = (230, 180, 30), (179, 38, 30)
    return "#%02x%02x%02x" % tuple(round(a + (b - a) * mix) for a, b in zip(low, high))


def part(name, deviations, holes, magnification, full_mm):
    """deviations: (x, y, deviation, feature) along the outlines, positive where too much material is left; holes: the features
    with material outside. The cut edge is drawn off the drawing by magnification * deviation, coloured by |deviation|."""
    outlines = {}
    for x, y, deviation, feature in deviations:
        outlines.setdefault(feature, []).append((x, y, deviation))
    xs = [p[0] for line in outlines.values() for p in line]
    ys = [p[1] for line in outlines.values() for p in line]
    width, margin = 760, 60
    scale = (width - 2 * margin) / max(1e-9, max(max(xs) - min(xs), (max(ys) - min(ys)) * 1.2))
    height = (max(ys) - min(ys)) * scale + 2 * margin + 20

    def at(x, y):
        return margin + (x - min(xs)) * scale, height - margin - (y - min(ys)) * scale

    body = [_text(margin, 26, f"{name}: deviation drawn {magnification:g} times as large", 16, weight="bold")]
    for feature, line in outlines.items():
        points = " ".join("%.1f,%.1f" % at(x, y) for x, y, _ in line + line[:1])
        body.append(f'<polyline points="{points}" fill="none" stroke="{GRID}" stroke-width="3"/>')
        body += _deviation_strokes(line, at, magnification * _away_from_material(line, feature in holes), full_mm)
    body += _colour_key(margin, height - 22, full_mm)
    body += _scale_bar(width - margin, height - 22, scale)
    return _svg(width, round(height), body)


def _away_from_material(line, hole):
    """+1 where the normal left of the outline's direction points away from the material, else -1."""
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(line, line[1:] + line[:1]))
    return (1 if area > 0 else -1) * (1 if hole else -1)


def _deviation_strokes(line, at, magnification, full_mm):
    count = len(line)
    step = max(1, count // 900)
    picked = line[::step]
    shifted = []
    for i, (x, y, deviation) in enumerate(picked):
        before, after = picked[i - 1], picked[(i + 1) % len(picked)]
        tx, ty = after[0] - before[0], after[1] - before[1]
        length = math.hypot(tx, ty) or 1.0
        shifted.append((x - ty / length * deviation * magnification, y + tx / length * deviation * magnification, deviation))
    strokes = []
    for a, b in zip(shifted, shifted[1:]):
        (x1, y1), (x2, y2) = at(a[0], a[1]), at(b[0], b[1])
        if math.hypot(x2 - x1, y2 - y1) > 60:
            continue
        strokes.append(
            f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour_of(a[2], full_mm)}" stroke-width="1.8"/>'
        )
    return strokes


def _colour_key(x, y, full_mm):
    body = []
    for i in range(60):
        body.append(f'<rect x="{x + 2 * i}" y="{y - 9}" width="2" height="10" fill="{colour_of(full_mm * i / 59, full_mm)}"/>')
    body.append(_text(x, y + 14, "0"))
    body.append(_text(x + 120, y + 14, f"{full_mm:g} mm or more", anchor="middle"))
    return body


def _scale_bar(right, y, scale):
    length = nice_step(260 / scale, 2)
    return [
        f'<line x1="{right - length * scale:.1f}" y1="{y}" x2="{right}" y2="{y}" stroke="{INK}" stroke-width="2"/>',
        _text(right, y + 14, f"{length:g} mm on the part", anchor="end"),
    ]


def budget(stages):
    """stages: [(name, [(source, contribution_mm), …])], one group of bars a source."""
    sources = []
    for _, shares in stages:
        sources += [source for source, value in shares if value >= 0.001 and source not in sources]
    width, left, row = 760, 150, 16 * len(stages) + 14
    height = 70 + row * len(sources)
    largest = max([value for _, shares in stages for _, value in shares] + [1e-6])
    body = [_text(20, 26, "Error budget by source: 95 % of each alone, mm", 16, weight="bold")]
    body += _stage_key([name for name, _ in stages], 20, 46)
    for r, source in enumerate(sources):
        top = 62 + r * row
        body.append(_text(left - 8, top + row / 2, source.lower().replace("_", " "), anchor="end"))
        for s, (name, shares) in enumerate(stages):
            value = dict(shares).get(source, 0.0)
            length = (width - left - 80) * value / largest
            y = top + 16 * s
            body.append(f'<rect x="{left}" y="{y}" width="{max(length, 0.5):.1f}" height="13" fill="{STAGE_COLOURS.get(name, INK)}"/>')
            body.append(_text(left + length + 5, y + 11, f"{value:.3f}", 11))
    return _svg(width, height, body)


def _stage_key(names, x, y):
    body = []
    for name in names:
        body.append(f'<rect x="{x}" y="{y - 10}" width="12" height="12" fill="{STAGE_COLOURS.get(name, INK)}"/>')
        body.append(_text(x + 17, y, name))
        x += 35 + 7 * len(name)
    return body


def curves(title, unit, series, width=760, height=260):
    """series: [(name, colour, [(t, value), …])] over time in s."""
    left, right, top, bottom = 70, 20, 40, 40
    points = [p for _, _, line in series for p in line]
    if not points:
        return _svg(width, height, [_text(20, 26, title + ": nothing recorded", 16, weight="bold")])
    t0, t1 = min(p[0] for p in points), max(p[0] for p in points)
    v0, v1 = min(p[1] for p in points), max(p[1] for p in points)
    pad = 0.05 * (v1 - v0) or 1.0
    v0, v1 = v0 - pad, v1 + pad

    def at(t, v):
        return (
            left + (width - left - right) * (t - t0) / max(1e-9, t1 - t0),
            height - bottom - (height - top - bottom) * (v - v0) / (v1 - v0),
        )

    body = [_text(20, 26, title, 16, weight="bold")]
    body += _axes(at, (t0, t1), (v0, v1), unit, width, height, left, right, bottom)
    x = width - 20 - 110 * len(series)
    for name, colour, line in series:
        step = max(1, len(line) // 1500)
        path = " ".join("%.1f,%.1f" % at(t, v) for t, v in line[::step])
        body.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.3"/>')
        body.append(_text(x, 26, name, colour=colour, weight="bold"))
        x += 110
    return _svg(width, height, body)


def _axes(at, times, values, unit, width, height, left, right, bottom):
    body = []
    step = nice_step(values[1] - values[0], 5)
    value = math.ceil(values[0] / step) * step
    while value <= values[1]:
        _, y = at(times[0], value)
        body.append(f'<line x1="{left}" y1="{y:.1f}" x2="{width - right}" y2="{y:.1f}" stroke="{GRID}"/>')
        body.append(_text(left - 6, y + 4, f"{value:g}", 11, anchor="end"))
        value += step
    step = nice_step(times[1] - times[0], 8)
    time = math.ceil(times[0] / step) * step
    while time <= times[1]:
        x, _ = at(time, values[0])
        body.append(_text(x, height - bottom + 16, f"{time:g}", 11, anchor="middle"))
        time += step
    body.append(_text(width - right, height - 8, "time, s", 11, anchor="end"))
    body.append(_text(8, 44, unit, 11))
    return body


def histogram(title, values_mm, limits):
    """Histogram of |values| in micrometres; limits: [(label, mm)] drawn as lines."""
    width, height, left, bottom = 760, 260, 60, 44
    body = [_text(20, 26, title, 16, weight="bold")]
    if not values_mm:
        return _svg(width, height, body + [_text(left, 120, "no process event happened in motion")])
    sizes = sorted(abs(v) * 1000 for v in values_mm)
    edge = max(sizes[-1], max(mm for _, mm in limits) * 1000) * 1.08
    bins = [0] * 44
    for size in sizes:
        bins[min(len(bins) - 1, int(size / edge * len(bins)))] += 1
    tall = max(bins)
    plot_width, plot_height = width - left - 20, height - bottom - 50
    for i, count in enumerate(bins):
        bar = plot_height * count / tall
        x = left + plot_width * i / len(bins)
        body.append(f'<rect x="{x:.1f}" y="{height - bottom - bar:.1f}" width="{plot_width / len(bins) - 1:.1f}" height="{bar:.1f}" fill="#32608f"/>')
    for label, mm in limits:
        x = left + plot_width * mm * 1000 / edge
        body.append(f'<line x1="{x:.1f}" y1="44" x2="{x:.1f}" y2="{height - bottom}" stroke="#b3261e" stroke-dasharray="4 3"/>')
        late = x > width - 160
        body.append(_text(x - 4 if late else x + 4, 54, label, 11, "end" if late else "start", "#b3261e"))
    step = nice_step(edge, 8)
    for i in range(int(edge / step) + 1):
        body.append(_text(left + plot_width * i * step / edge, height - bottom + 16, f"{i * step:g}", 11, anchor="middle"))
    body.append(_text(width - 20, height - 8, "|deviation| along the path, µm", 11, anchor="end"))
    step = max(1, nice_step(tall, 4))
    for i in range(int(tall / step) + 1):
        y = height - bottom - plot_height * i * step / tall
        body.append(_text(left - 6, y + 4, f"{i * step:g}", 11, anchor="end"))
    body.append(_text(8, 40, "events", 11))
    return _svg(width, height, body)
