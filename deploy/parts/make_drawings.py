#!/usr/bin/env python3
"""Writes the DXF drawings beside this file, as a CAD program would: entities in no order, layers, blocks.

slotted_plate.dxf   a plate of loose lines and arcs, slots as polylines with bulges, a pattern of holes as one arrayed
                    insertion, centre lines on a layer of their own, a scribed line
mixed_nest.dxf      an ellipse with a bore, a spline cam, a bracket inserted twice (turned, mirrored and scaled), a ring with
                    a small part in its window
cover/cover.dxf     a small plate with a bore, the same as cover.ngc and cover.cldata beside it

    make_drawings.py [FOLDER]      writes into FOLDER (default: beside this file)
"""
import math
import pathlib
import random
import sys


def group(code, value):
    return "%3d\n%s\n" % (code, ("%.9f" % value).rstrip("0").rstrip(".") if isinstance(value, float) else value)


SUBCLASS = {"LINE": "AcDbLine", "ARC": "AcDbCircle", "CIRCLE": "AcDbCircle", "ELLIPSE": "AcDbEllipse",
            "LWPOLYLINE": "AcDbPolyline", "SPLINE": "AcDbSpline", "INSERT": "AcDbBlockReference"}
handles = iter(range(0x100, 0xFFFF))


def entity(kind, layer, *groups):
    text = group(0, kind) + group(5, "%X" % next(handles)) + group(100, "AcDbEntity") + group(8, layer)
    text += group(100, SUBCLASS[kind])
    for code, value in groups:
        if kind == "ARC" and code == 50:
            text += group(100, "AcDbArc")
        text += group(code, value)
    return text


def line(layer, a, b):
    return entity("LINE", layer, (10, float(a[0])), (20, float(a[1])), (11, float(b[0])), (21, float(b[1])))


def arc(layer, center, radius, start_deg, end_deg):
    return entity("ARC", layer, (10, float(center[0])), (20, float(center[1])), (40, float(radius)), (50, float(start_deg)),
                  (51, float(end_deg)))


def circle(layer, x, y, radius):
    return entity("CIRCLE", layer, (10, float(x)), (20, float(y)), (40, float(radius)))


def ellipse(layer, x, y, a, b, turn_deg=0.0):
    t = math.radians(turn_deg)
    return entity("ELLIPSE", layer, (10, float(x)), (20, float(y)), (30, 0.0), (11, a * math.cos(t)), (21, a * math.sin(t)),
                  (31, 0.0), (40, b / a), (41, 0.0), (42, 2.0 * math.pi))


def polyline(layer, vertices, closed=True):
    """(x, y, bulge of the edge that begins there)"""
    groups = [(90, len(vertices)), (70, 1 if closed else 0)]
    for x, y, bulge in vertices:
        groups += [(10, float(x)), (20, float(y))] + ([(42, float(bulge))] if bulge else [])
    return entity("LWPOLYLINE", layer, *groups)


def slot(layer, x, y, length, width, turn_deg):
    a = math.radians(turn_deg)
    u, n = (math.cos(a) * length / 2, math.sin(a) * length / 2), (-math.sin(a) * width / 2, math.cos(a) * width / 2)
    p, q = (x - u[0], y - u[1]), (x + u[0], y + u[1])
    return polyline(layer, [(p[0] - n[0], p[1] - n[1], 0), (q[0] - n[0], q[1] - n[1], 1), (q[0] + n[0], q[1] + n[1], 0),
                            (p[0] + n[0], p[1] + n[1], 1)])


def closed_spline(layer, points):
    """Uniform periodic cubic: the first three control points stand again at the end."""
    n = len(points)
    wrapped = points + points[:3]
    groups = [(70, 11), (71, 3), (72, n + 7), (73, n + 3), (74, 0)]
    groups += [(40, float(k)) for k in range(n + 7)]
    for x, y in wrapped:
        groups += [(10, float(x)), (20, float(y)), (30, 0.0)]
    return entity("SPLINE", layer, *groups)


def insert(layer, block, x, y, scale=(1.0, 1.0), turn_deg=0.0, columns=1, rows=1, step=(0.0, 0.0)):
    return entity("INSERT", layer, (2, block), (10, float(x)), (20, float(y)), (41, float(scale[0])), (42, float(scale[1])),
                  (50, float(turn_deg)), (70, columns), (71, rows), (44, float(step[0])), (45, float(step[1])))


def rounded_rectangle(layer, x, y, width, height, radius):
    r, right, top = radius, x + width, y + height
    return [line(layer, (x + r, y), (right - r, y)), line(layer, (right, y + r), (right, top - r)),
            line(layer, (right - r, top), (x + r, top)), line(layer, (x, top - r), (x, y + r)),
            arc(layer, (right - r, y + r), r, 270, 360), arc(layer, (right - r, top - r), r, 0, 90),
            arc(layer, (x + r, top - r), r, 90, 180), arc(layer, (x + r, y + r), r, 180, 270)]


def drawing(entities, blocks=()):
    text = group(999, "Written by make_drawings.py; millimetres in W, the corner of the sheet")
    text += group(0, "SECTION") + group(2, "HEADER") + group(9, "$ACADVER") + group(1, "AC1015")
    text += group(9, "$INSUNITS") + group(70, 4) + group(0, "ENDSEC")
    text += group(0, "SECTION") + group(2, "BLOCKS")
    for name, content in blocks:
        text += group(0, "BLOCK") + group(5, "%X" % next(handles)) + group(100, "AcDbEntity") + group(8, "0")
        text += group(100, "AcDbBlockBegin") + group(2, name) + group(70, 0) + group(10, 0.0) + group(20, 0.0) + group(30, 0.0)
        text += "".join(content) + group(0, "ENDBLK") + group(5, "%X" % next(handles)) + group(100, "AcDbEntity")
        text += group(8, "0") + group(100, "AcDbBlockEnd")
    text += group(0, "ENDSEC") + group(0, "SECTION") + group(2, "ENTITIES") + "".join(entities) + group(0, "ENDSEC")
    return text + group(0, "EOF")


def slotted_plate():
    x, y = 200.0, 150.0
    entities = rounded_rectangle("CUT", x, y, 360.0, 220.0, 14.0)
    random.Random(4).shuffle(entities)  # a drawing's entities stand in the order in which someone drew them
    entities += [slot("CUT", x + 70, y + 60, 70, 14, 0), slot("CUT", x + 70, y + 110, 70, 14, 0), slot("CUT", x + 290, y + 110, 110, 18, 90),
                 slot("CUT", x + 180, y + 110, 90, 12, 35), insert("CUT", "HOLE", x + 30, y + 180, columns=6, rows=1, step=(40, 0))]
    entities += [line("CENTRE", (x - 10, y + 110), (x + 370, y + 110)), line("CENTRE", (x + 180, y - 10), (x + 180, y + 230)),
                 line("SCRIBE", (x + 30, y + 25), (x + 330, y + 25))]
    return drawing(entities, [("HOLE", [circle("0", 0, 0, 7)])])


def mixed_nest():
    bracket = rounded_rectangle("0", 0, 0, 110.0, 60.0, 8.0) + [circle("0", 18, 30, 8), ellipse("0", 70, 30, 22, 10)]
    cam = [(430 + r * math.cos(a), 215 + r * math.sin(a))
           for r, a in ((55 + 14 * math.cos(2 * math.pi * k / 10) + 6 * math.cos(4 * math.pi * k / 10), 2 * math.pi * k / 10)
                        for k in range(10))]
    entities = [ellipse("CUT", 235, 215, 85, 52, 20), circle("CUT", 235, 215, 20), closed_spline("CUT", cam), circle("CUT", 430, 215, 16),
                insert("CUT", "BRACKET", 150, 330), insert("CUT", "BRACKET", 300, 470, (1.0, -1.2), 10.0),
                circle("CUT", 560, 400, 75), circle("CUT", 560, 400, 58), slot("CUT", 560, 400, 50, 34, 30), circle("CUT", 560, 400, 9)]
    return drawing(entities, [("BRACKET", bracket)])


def cover():
    bulge = math.tan(math.radians(90.0) / 4.0)  # a quarter turn, counter-clockwise
    outline = polyline("CUT", [(376, 280, 0), (424, 280, bulge), (430, 286, 0), (430, 314, bulge), (424, 320, 0), (376, 320, bulge),
                               (370, 314, 0), (370, 286, bulge)])
    return drawing([outline, line("CENTRE", (385, 300), (415, 300)), line("CENTRE", (400, 285), (400, 315)), circle("CUT", 400, 300, 10)])


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    (folder / "slotted_plate.dxf").write_text(slotted_plate())
    (folder / "mixed_nest.dxf").write_text(mixed_nest())
    (folder / "cover").mkdir(exist_ok=True)
    (folder / "cover" / "cover.dxf").write_text(cover())


if __name__ == "__main__":
    main()
