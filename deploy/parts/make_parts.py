#!/usr/bin/env python3
"""Writes the part programs and their drawings, each pair from one geometry.

A part is a list of closed outlines in W (mm, the sheet's corner), counter-clockwise, of lines and arcs. The drawing is the
outline itself. The program is the centreline of the jet: the outline offset by half a kerf to the waste side, sharp corners
rolled, with a quarter-circle lead-in from a pierce in the waste and a quarter-circle lead-out in which the jet goes off on
the fly. Holes are cut before the outline around them.

    make_parts.py [FOLDER]      writes into FOLDER (default: beside this file)
"""
import math
import pathlib
import sys

KERF_MM = 0.8
TOLERANCE_MM = 0.15
LEAD_MM = 4.0


def unit(v):
    n = math.hypot(*v)
    return (v[0] / n, v[1] / n)


class Line:
    def __init__(self, a, b):
        self.a, self.b = a, b

    def start(self):
        return self.a

    def end(self):
        return self.b

    def length(self):
        return math.dist(self.a, self.b)

    def at(self, share):
        point = tuple(p + share * (q - p) for p, q in zip(self.a, self.b))
        return point, unit((self.b[0] - self.a[0], self.b[1] - self.a[1]))

    def split(self, share):
        point, _ = self.at(share)
        return Line(self.a, point), Line(point, self.b)

    def offset_left(self, d):
        t = self.at(0.0)[1]
        n = (-t[1] * d, t[0] * d)
        return Line((self.a[0] + n[0], self.a[1] + n[1]), (self.b[0] + n[0], self.b[1] + n[1]))

    def drawing(self):
        return "line: [%s]" % ", ".join(number(v) for v in self.a + self.b)


class Arc:
    """sweep_deg counter-clockwise positive."""

    def __init__(self, center, radius, start_deg, sweep_deg):
        self.center, self.radius, self.start_deg, self.sweep_deg = center, radius, start_deg, sweep_deg

    def point(self, degrees):
        a = math.radians(degrees)
        return (self.center[0] + self.radius * math.cos(a), self.center[1] + self.radius * math.sin(a))

    def start(self):
        return self.point(self.start_deg)

    def end(self):
        return self.point(self.start_deg + self.sweep_deg)

    def length(self):
        return abs(math.radians(self.sweep_deg)) * self.radius

    def at(self, share):
        degrees = self.start_deg + share * self.sweep_deg
        a, turn = math.radians(degrees), math.copysign(1.0, self.sweep_deg)
        return self.point(degrees), (-turn * math.sin(a), turn * math.cos(a))

    def split(self, share):
        first = self.sweep_deg * share
        return (Arc(self.center, self.radius, self.start_deg, first),
                Arc(self.center, self.radius, self.start_deg + first, self.sweep_deg - first))

    def offset_left(self, d):
        radius = self.radius - math.copysign(d, self.sweep_deg) * 1.0 if d >= 0 else \
            self.radius + math.copysign(-d, self.sweep_deg)
        if radius <= 0:
            raise ValueError("an arc of radius %g is smaller than the jet" % self.radius)
        return Arc(self.center, radius, self.start_deg, self.sweep_deg)

    def drawing(self):
        if abs(self.sweep_deg) >= 360.0:
            return "circle: {center: [%s, %s], radius: %s}" % (number(self.center[0]), number(self.center[1]),
                                                               number(self.radius))
        return "arc: {center: [%s, %s], radius: %s, start_deg: %s, sweep_deg: %s}" % tuple(
            number(v) for v in (*self.center, self.radius, self.start_deg, self.sweep_deg))


def number(value):
    text = "%.6f" % value
    text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def rounded(vertices):
    """Closed outline through (x, y, fillet radius); radius 0 leaves the corner sharp."""
    n = len(vertices)
    trims = []
    for i in range(n):
        p, q, r = (vertices[(i + k - 1) % n] for k in range(3))
        u, v = unit((q[0] - p[0], q[1] - p[1])), unit((r[0] - q[0], r[1] - q[1]))
        turn = math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
        t = q[2] * math.tan(abs(turn) / 2)
        trims.append((u, v, turn, t))
    outline = []
    for i in range(n):
        (x, y, radius), (u, v, turn, t) = vertices[i], trims[i]
        if radius > 0:
            side = math.copysign(1.0, turn)
            begin = (x - u[0] * t, y - u[1] * t)
            center = (begin[0] - side * u[1] * radius, begin[1] + side * u[0] * radius)
            start = math.degrees(math.atan2(begin[1] - center[1], begin[0] - center[0]))
            outline.append(Arc(center, radius, start, math.degrees(turn)))
            here = outline[-1].end()
        else:
            here = (x, y)
        nx, ny, _ = vertices[(i + 1) % n]
        nu, _, _, nt = trims[(i + 1) % n]
        to = (nx - nu[0] * nt, ny - nu[1] * nt)
        if math.dist(here, to) > 1e-9:
            outline.append(Line(here, to))
    return outline


def circle(x, y, radius):
    return [Arc((x, y), radius, 0.0, 360.0)]


def slot(x, y, length, width, angle_deg=0.0):
    """Round-ended slot, length between the end centres."""
    a = math.radians(angle_deg)
    u = (math.cos(a) * length / 2, math.sin(a) * length / 2)
    n = (-math.sin(a) * width / 2, math.cos(a) * width / 2)
    p, q = (x - u[0], y - u[1]), (x + u[0], y + u[1])
    return [Line((p[0] - n[0], p[1] - n[1]), (q[0] - n[0], q[1] - n[1])), Arc(q, width / 2, angle_deg - 90.0, 180.0),
            Line((q[0] + n[0], q[1] + n[1]), (p[0] + n[0], p[1] + n[1])), Arc(p, width / 2, angle_deg + 90.0, 180.0)]


def moved(outline, dx, dy):
    out = []
    for e in outline:
        if isinstance(e, Line):
            out.append(Line((e.a[0] + dx, e.a[1] + dy), (e.b[0] + dx, e.b[1] + dy)))
        else:
            out.append(Arc((e.center[0] + dx, e.center[1] + dy), e.radius, e.start_deg, e.sweep_deg))
    return out


class Feature:
    def __init__(self, name, outline, hole, feed_mm_per_s):
        self.name, self.outline, self.hole, self.feed = name, outline, hole, feed_mm_per_s

    def centreline(self):
        """The offset outline, corners rolled, starting in the middle of its longest element."""
        d = KERF_MM / 2 if self.hole else -KERF_MM / 2
        path = []
        n = len(self.outline)
        for i, element in enumerate(self.outline):
            path.append(element.offset_left(d))
            following = self.outline[(i + 1) % n].offset_left(d)
            if math.dist(path[-1].end(), following.start()) > 1e-6:
                corner = element.end()
                u, v = element.at(1.0)[1], self.outline[(i + 1) % n].at(0.0)[1]
                turn = math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
                if turn * d > 0:
                    raise ValueError("%s: a jet cannot cut a sharp inner corner at %r" % (self.name, corner))
                begin = path[-1].end()
                start = math.degrees(math.atan2(begin[1] - corner[1], begin[0] - corner[0]))
                path.append(Arc(corner, abs(d), start, math.degrees(turn)))
        longest = max(range(len(path)), key=lambda i: path[i].length())
        head, tail = path[longest].split(0.5)
        return [tail] + path[longest + 1:] + path[:longest] + [head]


def gcode_arc(arc, origin):
    end, begin = arc.end(), arc.start()
    return "G%d X%.4f Y%.4f I%.4f J%.4f" % (3 if arc.sweep_deg > 0 else 2, end[0] - origin[0], end[1] - origin[1],
                                            arc.center[0] - begin[0], arc.center[1] - begin[1])


def gcode_move(element, origin):
    if isinstance(element, Line):
        return "G1 X%.4f Y%.4f" % (element.b[0] - origin[0], element.b[1] - origin[1])
    return gcode_arc(element, origin)


def leads(point, tangent, waste_left, radius):
    """Quarter circles into and out of a point; the second split where the jet goes off."""
    side = 1.0 if waste_left else -1.0
    n = (-tangent[1] * side, tangent[0] * side)
    center = (point[0] + n[0] * radius, point[1] + n[1] * radius)
    at_point = math.degrees(math.atan2(-n[1], -n[0]))
    lead_in = Arc(center, radius, at_point - side * 90.0, side * 90.0)
    lead_out = Arc(center, radius, at_point, side * 90.0)
    return lead_in, lead_out


class Part:
    def __init__(self, name, features, work_offset=(0.0, 0.0)):
        self.name, self.features, self.work_offset = name, features, work_offset

    def program(self):
        origin = self.work_offset
        text = ["%", "(%s: kerf %.2f mm, centreline of the jet)" % (self.name, KERF_MM), "G21 G90 G17 G40 G94",
                "G10 L2 P1 X%.3f Y%.3f" % origin, "G54", "G64"]
        for feature in self.features:
            path = feature.centreline()
            radius = LEAD_MM
            if feature.hole:
                radius = min(LEAD_MM, 0.5 * min(e.radius for e in path if isinstance(e, Arc)))
            lead_in, lead_out = leads(*path[0].at(0.0), feature.hole, radius)
            before_off, after_off = lead_out.split(0.6)
            pierce = lead_in.start()
            text += ["(%s)" % feature.name, "G0 X%.4f Y%.4f" % (pierce[0] - origin[0], pierce[1] - origin[1]), "M3",
                     "F%.0f" % (60.0 * feature.feed), gcode_arc(lead_in, origin)]
            text += [gcode_move(e, origin) for e in path]
            text += [gcode_arc(before_off, origin), "M5", gcode_arc(after_off, origin)]
        return "\n".join(text + ["M2", "%"]) + "\n"

    def drawing(self):
        text = ["# Finished geometry of deploy/parts/%s.ngc, mm, in W. Written by make_parts.py." % self.name,
                "name: %s" % self.name, "kerf_width_mm: %s" % number(KERF_MM), "features:"]
        for f in self.features:
            text += ["  - name: %s" % f.name, "    kind: %s" % ("hole" if f.hole else "contour"),
                     "    side: %s" % ("inside" if f.hole else "outside"), "    tolerance_mm: %s" % number(TOLERANCE_MM),
                     "    outline:"]
            text += ["      - {%s}" % e.drawing() for e in f.outline]
        return "\n".join(text) + "\n"


def bracket():
    x, y = 230.0, 170.0
    outer = rounded([(0, 0, 12), (340, 0, 12), (340, 90, 12), (110, 90, 25), (110, 250, 12), (0, 250, 12)])
    holes = [circle(30, 30, 9), circle(310, 30, 9), circle(310, 64, 6), circle(30, 220, 9), circle(80, 220, 6),
             slot(55, 140, 50, 14, 90)]
    features = [Feature("hole_%d" % (i + 1), moved(h, x, y), True, 45) for i, h in enumerate(holes)]
    return Part("bracket", features + [Feature("outline", moved(outer, x, y), False, 80)], (x, y))


def flange():
    x, y = 400.0, 300.0
    holes = [circle(x + 100 * math.cos(math.radians(45 * i + 22.5)), y + 100 * math.sin(math.radians(45 * i + 22.5)), 9)
             for i in range(8)]
    features = [Feature("bolt_hole_%d" % (i + 1), h, True, 45) for i, h in enumerate(holes)]
    features.append(Feature("bore", circle(x, y, 62), True, 80))
    return Part("flange", features + [Feature("rim", circle(x, y, 130), False, 100)])


def gear():
    x, y, teeth, root, tip = 400.0, 300.0, 18, 96.0, 112.0
    vertices = []
    for i in range(teeth):
        for share, radius, fillet in ((0.0, root, 3.0), (0.16, tip, 1.0), (0.42, tip, 1.0), (0.58, root, 3.0)):
            a = 2 * math.pi * (i + share) / teeth
            vertices.append((x + radius * math.cos(a), y + radius * math.sin(a), fillet))
    holes = [circle(x + 58 * math.cos(math.radians(60 * i)), y + 58 * math.sin(math.radians(60 * i)), 14)
             for i in range(6)]
    features = [Feature("web_hole_%d" % (i + 1), h, True, 50) for i, h in enumerate(holes)]
    features.append(Feature("bore", circle(x, y, 25), True, 60))
    return Part("gear", features + [Feature("teeth", rounded(vertices), False, 60)])


def plate():
    x, y = 200.0, 150.0
    outer = rounded([(0, 0, 0), (430, 0, 0), (380, 120, 0), (330, 230, 0), (210, 300, 0), (60, 260, 0)])
    holes = [slot(120, 90, 80, 16, 0), slot(250, 90, 60, 16, 90), slot(160, 190, 90, 12, 35), circle(270, 215, 20)]
    features = [Feature("window_%d" % (i + 1), moved(h, x, y), True, 50) for i, h in enumerate(holes)]
    return Part("sharp_plate", features + [Feature("outline", moved(outer, x, y), False, 90)], (x, y))


def nest():
    features = []
    for i, (x, y) in enumerate([(170, 170), (300, 170)]):
        features.append(Feature("washer_%d_bore" % (i + 1), circle(x, y, 25), True, 50))
        features.append(Feature("washer_%d_rim" % (i + 1), circle(x, y, 48), False, 80))
    link = slot(530, 170, 150, 70, 0)
    features.append(Feature("link_eye_1", circle(455, 170, 18), True, 50))
    features.append(Feature("link_eye_2", circle(605, 170, 18), True, 50))
    features.append(Feature("link_outline", link, False, 90))
    tile = rounded([(130, 280, 8), (330, 280, 8), (330, 420, 8), (130, 420, 8)])
    features.append(Feature("tile_window", rounded([(180, 320, 10), (280, 320, 10), (280, 380, 10), (180, 380, 10)]), True, 70))
    features.append(Feature("tile_outline", tile, False, 90))
    return Part("nest", features)


def slender():
    x, y = 90.0, 270.0
    outer = rounded([(0, 0, 6), (300, 0, 60), (620, 20, 6), (620, 60, 6), (300, 40, 60), (0, 40, 6)])
    holes = [circle(22, 20, 8), circle(598, 40, 8), slot(150, 20, 120, 10, 0), slot(450, 29.4, 120, 10, math.degrees(math.atan2(20, 320)))]
    features = [Feature("hole_%d" % (i + 1), moved(h, x, y), True, 45) for i, h in enumerate(holes)]
    return Part("slender", features + [Feature("outline", moved(outer, x, y), False, 110)], (x, y))


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    for part in (bracket(), flange(), gear(), plate(), nest(), slender()):
        (folder / (part.name + ".ngc")).write_text(part.program())
        (folder / (part.name + ".drawing.yaml")).write_text(part.drawing())


if __name__ == "__main__":
    main()
