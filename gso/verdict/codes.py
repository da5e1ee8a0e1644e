"""Codes of the reasons against results: what each means, its unit, its words, and what to do."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from gso.faults import PLEATED, SHORT
from gso.status import Status

#: Relative tolerance of the limits.
TIGHT = 1e-6


class Kind(enum.Enum):
    """What the value and the bound of a reason are; the value is their unit in tables."""

    COUNT = "number"
    LENGTH = "length"
    SHARE = "share"
    ANGLE = "degrees"
    FACTOR = "1"
    #: Nothing is measured.
    NONE = ""


@dataclass(frozen=True)
class CodeInfo:
    """Description of a code.

    Attributes
    ----------
    kind : Kind
        Kind of value and bound.
    meaning : str
        What is measured, and when it counts against a result.
    sentence : str
        The reason in words, with ``{value}``, ``{bound}`` and ``{detail}``; places follow.
    remedy : str
        What to do about it.
    limit : float or None
        The bound where none is given; None: then it is not checked.
    tolerance : float
        How far a value may be beyond its bound, relative to it.
    least : bool
        Whether the bound is the smallest good value, rather than the largest.
    """

    kind: Kind
    meaning: str
    sentence: str
    remedy: str
    limit: float | None = None
    tolerance: float = TIGHT
    least: bool = False


def _limit(
    value: str,
    kind: Kind,
    meaning: str,
    sentence: str,
    remedy: str,
    limit: float | None = None,
    tolerance: float = TIGHT,
    least: bool = False,
) -> tuple[str, CodeInfo]:
    """Describe a number that has a bound."""
    return value, CodeInfo(kind, meaning, sentence, remedy, limit, tolerance, least)


def _fault(value: str, meaning: str, sentence: str, remedy: str) -> tuple[str, CodeInfo]:
    """Describe what must not occur at all: the number is how often it does."""
    return value, CodeInfo(Kind.COUNT, meaning, sentence, remedy, limit=0.0)


def _stop(value: str, meaning: str, sentence: str, remedy: str) -> tuple[str, CodeInfo]:
    """Describe what is not measured."""
    return value, CodeInfo(Kind.NONE, meaning, sentence, remedy)


class Code(str, enum.Enum):
    """Why a result is not usable as what was asked for, the most severe first.

    First what leaves nothing to judge, then solves that stopped, faults of the surface, faults of
    the pattern, what a sheet cannot be, and at last limits and budgets that are missed. The
    description of each is its `info`.
    """

    info: CodeInfo

    def __new__(cls, value: str, info: CodeInfo) -> Code:
        code = str.__new__(cls, value)
        code._value_, code.info = value, info
        return code

    FAILED = _stop(
        "failed",
        "An error ended the work.",
        "{detail}",
        "do what its message says",
    )
    UNFINISHED = _stop(
        "unfinished",
        "The run goes on, or was ended before its end.",
        "the run has not ended",
        "start it again, and it goes on where it was",
    )
    NOT_FINITE = _fault(
        "not_finite",
        "Vertices whose coordinates are not finite.",
        "coordinates are not finite",
        "solve without a start (x0), or with other options",
    )
    CANCELLED = _stop(
        "cancelled",
        "The callback stopped the solve.",
        str(Status.CANCELLED),
        "let it run to its end",
    )
    CONSTRAINTS_MISSED = _stop(
        "constraints_missed",
        "A hard constraint is not met.",
        str(Status.CONSTRAINTS_MISSED),
        "loosen or drop them",
    )
    TARGET_MISSED = _stop(
        "target_missed",
        "The search for a bound or a target failed.",
        str(Status.TARGET_MISSED),
        "loosen the limits, or cut the design into pieces (gso pieces)",
    )
    FOLDED = _fault(
        "folded",
        "Faces at edges where the surface turns by more than 120 degrees; not those of the design.",
        "the surface is folded onto itself",
        "allow less distance (max_deviation), or hold fewer vertices",
    )
    CROSSES_ITSELF = _fault(
        "crosses_itself",
        "Faces that pass through others; where nothing is laid flat, not those of the design.",
        "the surface passes through itself",
        "take apart what crosses in the design; if nothing does, allow less distance "
        "(max_deviation), or hold fewer vertices",
    )
    COLLAPSED = _limit(
        "collapsed",
        Kind.SHARE,
        "Length of an edge over that in the design.",
        "edges of the surface keep {value} of their length, less than {bound}",
        "allow less distance (max_deviation), or take an evener mesh",
        limit=SHORT,
        least=True,
    )
    NO_PATTERN = _fault(
        "no_pattern",
        "Surfaces and pieces without a flat pattern, whose strain is therefore not known.",
        "there is no flat pattern, so the strain is not known",
        "cut the surface open (gso.cut) or into pieces (gso pieces)",
    )
    PATTERN_INVERTED = _fault(
        "pattern_inverted",
        "Faces of the pattern that are inverted, or the pieces that have some.",
        "the pattern is inverted",
        "cut the surface into pieces (gso pieces)",
    )
    PATTERN_OVERLAPS = _fault(
        "pattern_overlaps",
        "Faces of the pattern that lie on others, or the pieces that have some.",
        "the pattern lies on itself",
        "cut the surface into pieces (gso pieces)",
    )
    PATTERN_COLLAPSED = _limit(
        "pattern_collapsed",
        Kind.SHARE,
        "Length of an edge of the pattern over that of the surface.",
        "edges of the pattern keep {value} of their length, less than {bound}",
        "cut the surface into pieces (gso pieces)",
        limit=SHORT,
        least=True,
    )
    NOT_FLATTENED = _limit(
        "not_flattened",
        Kind.SHARE,
        "Strain with which no pattern fits a face: it is squeezed to a line, doubled or inverted.",
        "no pattern fits the surface: its lengths would change by {value}",
        "ask for less, or take a finer mesh there",
        limit=0.99,
    )
    RULINGS_CROSS = _fault(
        "rulings_cross",
        "Pairs of successive rulings that cross.",
        "pairs of successive rulings that cross: {value}",
        "allow more strips (strips)",
    )
    PLEATED = _limit(
        "pleated",
        Kind.ANGLE,
        "Size of a pleat: of two neighbouring bends of a strip in opposite directions, the smaller "
        "angle, less what the design turns there.",
        "strips are pleated: their bends go up and down in turn by {value}, more than {bound}, "
        "where the design does not",
        "allow more strips (strips), or less distance (max_deviation)",
        limit=PLEATED,
    )
    TOO_THICK = _limit(
        "too_thick",
        Kind.LENGTH,
        "Smallest radius of a part; its bound is the depth of the inner face below the surface, "
        "half the thickness for parts without bend lines.",
        "the sheet is too thick to be rolled to a radius of {value}, less than {bound}",
        "take a thinner sheet, or fold it along its bend lines (--bend-radius)",
        least=True,
    )
    TOOL_RADIUS = _limit(
        "tool_radius",
        Kind.LENGTH,
        "Inner radius of the folding tool; its bound is 0.4 of the sheet's thickness.",
        "a sheet of this thickness tears where it is folded to an inner radius of {value}, less "
        "than {bound}",
        "take a larger --bend-radius or a thinner sheet",
        least=True,
    )
    NEUTRAL_STRAIN = _limit(
        "neutral_strain",
        Kind.SHARE,
        "Strain of the sheet's neutral surface against the pattern of a part without bend lines.",
        "the pattern is that of the surface, as there are no bend lines, and the sheet's neutral "
        "surface is longer or shorter by up to {value}, more than {bound}",
        "take --face middle and --k-factor 0.5, or a thinner sheet",
    )
    BEND_ANGLE = _limit(
        "bend_angle",
        Kind.ANGLE,
        "Largest angle of a bend; its bound is the last one of the bend table.",
        "bends of up to {value} are beyond the end of the bend table, {bound}",
        "add larger angles to the table",
    )
    UNMARKED_FOLD = _limit(
        "unmarked_fold",
        Kind.ANGLE,
        "Angle between two faces of a part at an edge that no bend line lies on.",
        "parts are folded by {value} where no bend line is drawn, more than {bound}",
        "cut the design there (keep), or smooth it",
        limit=60.0,
    )
    BENDS_NEAR = _limit(
        "bends_near",
        Kind.LENGTH,
        "Distance of two bends of a part; its bound is the room that both need.",
        "two bends are {value} apart, and folded they need {bound}",
        "take a smaller --bend-radius or a thinner sheet",
        least=True,
    )
    BENDS_OVERLAP = _fault(
        "bends_overlap",
        "Parts whose pattern for the thickness of the sheet crosses itself.",
        "bends are too near each other for the sheet",
        "take a thinner sheet",
    )
    SEAM_SIDES = _limit(
        "seam_sides",
        Kind.LENGTH,
        "Difference in length of a seam's two sides; its bound is a tenth of the thickness more "
        "than the strain explains.",
        "the sides of a seam differ by {value} in a sheet of this thickness, more than {bound}",
        "take --face middle, or a thinner sheet",
    )
    SEAM_STRIP = _fault(
        "seam_strip",
        "Seams that cannot have the overlap or flange asked for: it would meet its part, be wider "
        "than the face beside it or be folded along a curve, or the design is changed.",
        "no overlap or flange of this width is possible on either side of seams",
        "take a narrower one (--seam-overlap, --seam-flange), or cut the design elsewhere",
    )
    HOLE_ACROSS_SEAM = _fault(
        "hole_across_seam",
        "Holes that lie on several parts.",
        "holes lie across a seam",
        "move them",
    )
    HOLE_CROSSES_ITSELF = _fault(
        "hole_crosses_itself",
        "Holes whose outline crosses itself or has no area.",
        "holes cross themselves or have no area",
        "draw them again",
    )
    HOLE_OUTSIDE = _fault(
        "hole_outside",
        "Holes that reach the outline of their part.",
        "holes are not inside their part",
        "move them inwards",
    )
    NOT_NESTED = _stop(
        "not_nested",
        "A part does not fit on the sheet.",
        "{detail}",
        "do what its message says",
    )
    DEVIATION = _limit(
        "deviation",
        Kind.LENGTH,
        "Largest distance between result and design, in both directions.",
        "the result is {value} away from the design, more than {bound}",
        "allow more distance (max_deviation), or more strips or pieces",
    )
    FAR = _limit(
        "far",
        Kind.SHARE,
        "The same over the design's size, twice the distance of its farthest vertex from the "
        "centroid. The bound is 5 % where no limit was given. What constraints ask for is added.",
        "the result has left the design by {value} of its size, more than {bound}",
        "make strips (gso strips) or pieces of it (gso pieces), or allow the distance "
        "(max_deviation)",
        limit=0.5,
    )
    SEAM_GAP = _limit(
        "seam_gap",
        Kind.LENGTH,
        "Largest distance between the two sides of a seam; its bound is max_deviation.",
        "the sides of seams are up to {value} apart, more than {bound}",
        "allow more distance (max_deviation), or more strips",
    )
    STRAIN = _limit(
        "strain",
        Kind.SHARE,
        "Largest strain of the pattern; its bound is 2 % where no limit is given, 0.5 % where only "
        "max_deviation is given, and for gso pieces 1 % where the shape stays, 0.1 % where it may "
        "change.",
        "the largest strain of the pattern is {value}, more than {bound}",
        "make strips (gso strips) or pieces of it (gso pieces), or allow more strain (max_strain) "
        "or distance (max_deviation)",
    )
    TARGET_CURVATURE = _limit(
        "target_curvature",
        Kind.FACTOR,
        "The metric ``loss_gc_worst``, more than 5 % above the target.",
        "loss_gc_worst is {value}, above the target of {bound}",
        "raise target_curvature, or cut the design into pieces (gso pieces)",
        tolerance=0.05,
    )
    CURVATURE_ROSE = _limit(
        "curvature_rose",
        Kind.FACTOR,
        "Mean absolute curvature, more than 1 % above that of the input.",
        "mean |K| is {value}, worse than the {bound} of the input",
        "hold fewer vertices, or take another formulation",
        tolerance=0.01,
    )
    NOTHING_DONE = _limit(
        "nothing_done",
        Kind.FACTOR,
        "Mean absolute curvature, less than 1 % below that of the input, which is not developable.",
        "nothing was done: mean |K| is {value}, as in the input",
        "hold fewer vertices, allow more distance (max_deviation), or use gso pieces",
        tolerance=-0.01,
    )
    ROUGHER = _limit(
        "rougher",
        Kind.FACTOR,
        "Roughness over that of the input.",
        "the result is {value} times as rough as the input",
        "hold fewer vertices, or take another formulation",
        limit=1.0,
        tolerance=0.01,
    )
    PIECES = _limit(
        "pieces",
        Kind.COUNT,
        "Number of pieces.",
        "there are {value} pieces, more than {bound}",
        "allow more pieces (max_pieces), strain or change of shape",
    )
    SEAM_LENGTH = _limit(
        "seam_length",
        Kind.FACTOR,
        "Length of all seams, over the root of the design's area.",
        "the seams are {value} times the root of the area long, more than {bound}",
        "allow longer seams (seam), more strain or change of shape",
    )
    NECK = _limit(
        "neck",
        Kind.LENGTH,
        "Width of a piece at its narrowest place.",
        "necks are {value} wide, less than {bound}",
        "allow more strain (max_strain), narrower necks (min_neck), or cut elsewhere",
        least=True,
    )
    SMALL = _limit(
        "small",
        Kind.SHARE,
        "Area of a part, over that of all parts. Parts without seams do not count.",
        "parts have only {value} of the area, less than {bound}",
        "cut along other lines, or allow more distance (max_deviation) or strain (max_strain)",
        limit=0.001,
        least=True,
    )
    NARROW = _limit(
        "narrow",
        Kind.SHARE,
        "Mean width of a part, over the design's size. Parts without seams do not count.",
        "parts are only {value} of the design's size wide, less than {bound}",
        "allow more distance (max_deviation) or strain (max_strain), for fewer parts",
        limit=0.003,
        least=True,
    )
    TOO_SHORT = _limit(
        "too_short",
        Kind.LENGTH,
        "Length of a pattern.",
        "patterns are only {value} long, less than {bound}",
        "allow shorter pieces (min_size) or more strain (max_strain)",
        least=True,
    )
    TOO_LONG = _limit(
        "too_long",
        Kind.LENGTH,
        "Length of a pattern; its bound is that of the sheet.",
        "patterns are up to {value} long, more than the {bound} of the sheet",
        "take larger sheets, or a finer mesh",
    )
    TOO_WIDE = _limit(
        "too_wide",
        Kind.LENGTH,
        "Width of a pattern; its bound is that of the sheet.",
        "patterns are up to {value} wide, more than the {bound} of the sheet",
        "take larger sheets, or a finer mesh",
    )
    BEND_RADIUS = _limit(
        "bend_radius",
        Kind.LENGTH,
        "Smallest radius that a part is bent to.",
        "parts are bent to a radius of {value}, less than {bound}",
        "allow a smaller radius (min_radius) or more distance (max_deviation)",
        least=True,
    )
