"""Flat parts as DXF drawings in millimetres: a layer per operation, a group per part."""

from __future__ import annotations

import io
import re
import uuid
from typing import TYPE_CHECKING

import numpy as np

from gso.pattern import Bend, Zone
from gso.workshop.part import Drawing, Label
from gso.workshop.writers import strokes
from gso.workshop.writers.layers import Layer
from gso.workshop.writers.strokes import Line

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document
    from ezdxf.entities.dxfgfx import DXFGraphic
    from ezdxf.layouts.layout import Modelspace

SUFFIX = ".dxf"
PACKAGE = "ezdxf"
APPLICATION = "GSO"
"""Name of the application under which bends have extended data: a string, ``mountain`` or
``valley``; a real (1040), the angle in degrees; a distance (1041), the radius, if there is one;
and for lines of zones a string such as ``roll R 1500, 180 deg down``."""

_MILLIMETRES = 4
# Line width in hundredths of a millimetre.
_WIDTH = 25
# The first of January 2000 as a Julian date, for files that do not depend on the clock.
_DATE = "2451544.5"
_NO_GUID = "{00000000-0000-0000-0000-000000000000}"


def content(
    drawing: Drawing,
    layers: dict[str, Layer],
    *,
    bend_text: bool = False,
) -> bytes:
    """Return parts as a DXF drawing (R2010) at the scale 1:1, in millimetres.

    Everything is in the modelspace: outlines and holes as closed polylines, bends as lines,
    labels as texts. Each part is a group of its name. Bends have their direction, angle in
    degrees and radius as extended data of the application ``GSO``. The border of the sheet is
    on a layer that is not plotted. Equal drawings give equal files.

    Parameters
    ----------
    drawing : Drawing
    layers : dict of Layer
        Layers by kind of line, from :func:`gso.workshop.writers.layers.layer_set`.
    bend_text : bool
        Also write the direction, angle and radius beside each bend.

    Examples
    --------
    >>> from gso.workshop.part import Part
    >>> from gso.workshop.writers.layers import layer_set
    >>> plate = Part("plate", np.array([[0.0, 0], [80, 0], [80, 50], [0, 50]]))
    >>> import ezdxf
    >>> text = content(Drawing((plate,)), layer_set("operations")).decode()
    >>> [(e.dxftype(), e.dxf.layer) for e in ezdxf.read(io.StringIO(text)).modelspace()]
    [('LWPOLYLINE', 'CUT')]
    """
    document = _document(drawing)
    for layer in dict.fromkeys(layers.values()):
        own = document.layers.add(layer.name, color=layer.aci, lineweight=_WIDTH)
        own.dxf.plot = int(layer.plotted)
    space = document.modelspace()
    for border in strokes.sheet(drawing):
        _line(space, border, layers["sheet"].name)
    for part, name in zip(drawing.parts, strokes.identifiers(drawing.parts), strict=True):
        made = [
            _line(space, line, layers[line.kind].name)
            for line in strokes.lines(part)
            if line.kind in layers
        ]
        made += [_text(space, t, layers["text"].name) for t in strokes.texts(part, bend_text)]
        group = document.groups.new(name, description=strokes.title(part))
        group.extend(made)
    stream = io.StringIO()
    document.write(stream)
    encoded: bytes = document.encode(_without_clock(stream.getvalue()))
    return encoded


def _document(drawing: Drawing) -> Document:
    """Make an empty document whose view shows the whole drawing."""
    from ezdxf.filemanagement import new

    document = new("R2010", units=_MILLIMETRES)
    document.header["$MEASUREMENT"] = 1
    document.header["$LWDISPLAY"] = 1
    document.appids.new(APPLICATION)
    low, high = drawing.bounds
    space = document.modelspace()
    space.reset_extents((*low.tolist(), 0.0), (*high.tolist(), 0.0))
    space.reset_limits(tuple(low.tolist()), tuple(high.tolist()))
    tall = 1.1 * float(max(high[1] - low[1], 0.5 * (high[0] - low[0])))
    document.set_modelspace_vport(tall, center=tuple((0.5 * (low + high)).tolist()))
    return document


def _line(space: Modelspace, line: Line, layer: str) -> DXFGraphic:
    if len(line.points) > 2:
        return space.add_lwpolyline(
            line.points.tolist(), format="xy", close=line.closed, dxfattribs={"layer": layer}
        )
    start, end = line.points.tolist()
    made = space.add_line(start, end, dxfattribs={"layer": layer})
    if line.bend is not None:
        made.set_xdata(APPLICATION, _data(line.bend, line.zone))
    return made


def _data(bend: Bend, zone: Zone | None) -> list[tuple[int, str | float]]:
    data: list[tuple[int, str | float]] = [
        (1000, "mountain" if bend.angle > 0 else "valley"),
        (1040, float(abs(np.degrees(bend.angle)))),
    ]
    data += [(1041, float(bend.radius))] if np.isfinite(bend.radius) else []
    return data if zone is None else [*data, (1000, zone.in_words())]


def _text(space: Modelspace, text: Label, layer: str) -> DXFGraphic:
    from ezdxf.enums import TextEntityAlignment

    made = space.add_text(
        text.text,
        height=text.height,
        rotation=float(np.degrees(text.angle)),
        dxfattribs={"layer": layer},
    )
    return made.set_placement(text.at.tolist(), align=TextEntityAlignment.MIDDLE_CENTER)


def _without_clock(text: str) -> str:
    """Replace the dates and random identifiers of a file, so that equal drawings are equal files.

    The new identifiers are made from the content.
    """
    text = re.sub(r"(\n\$TDU?(?:CREATE|UPDATE)\n *40\n)[^\n]*", rf"\g<1>{_DATE}", text)
    text = re.sub(r"(\n\$(?:FINGERPRINT|VERSION)GUID\n *2\n)[^\n]*", rf"\g<1>{_NO_GUID}", text)
    text = re.sub(r"(\n *1\n[\w.]+) @ \d{4}-\d\d-\d\dT[^\n]*(?=\n)", r"\g<1>", text)
    own = str(uuid.uuid5(uuid.NAMESPACE_OID, text)).upper()
    return text.replace(_NO_GUID, f"{{{own}}}", 2)
