"""The default nets: displacements as coarse spline fields, refined in passes."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import interpolate

from gso.errors import OptionError
from gso.net.models import inputs
from gso.net.models.base import Net
from gso.net.models.blocks import Residual
from gso.net.models.convolution import Convolution
from gso.net.models.grid_geometry import Frame, planes, points
from gso.net.models.resampling import spline_field

#: Coefficients of the fields, or numbers where all are equal.
Fields = tuple[Tensor | float, ...]
#: Logarithmic odds of a net's confidence before it is trained: moves are nearly whole.
_CONFIDENT = 3.0


class CoarseNet(Net):
    """Displacements as bicubic B-splines with few coefficients: smooth by construction.

    The inputs are pose-invariant channels of the surface's shape and bending, and the result
    of the previous pass. Each pass adds to the coefficients. A U-Net, whose finest level has
    half the resolution of the vertices, predicts a coarser and a finer field. The coefficients
    are components along the surface's normals and grid lines (for flat images, along the axes
    of the rectangle), so the result is equivariant under rotations of the input.

    With `confidence` a third field says how far the net trusts its displacements: each vertex
    moves by the displacement times a number between 0 and 1, so that the input stays where the
    net has learned to leave it.

    Parameters
    ----------
    task : str
        Task of the net, one whose inputs have no noise.
    widths : sequence of 3 int
        Channels at 1/2, 1/4 and 1/8 of the resolution.
    depths : sequence of 3 int
        Residual blocks at these levels; the first two levels have them on the way down, and
        one more on the way up.
    passes : int
        How often the net is applied, with the same weights, to its previous result.
    confidence : bool
        Whether displacements are multiplied by a confidence per vertex.

    Raises
    ------
    OptionError
        A setting is out of range.

    Examples
    --------
    >>> net = CoarseNet(widths=(8, 8, 8), depths=(1, 1, 1))
    >>> flat = torch.stack(torch.meshgrid(*[torch.linspace(-0.7, 0.7, 64)] * 2, indexing="ij"))
    >>> surface = torch.cat([flat, 0 * flat[:1]]).movedim(0, -1)[None]
    >>> net(surface).shape, bool((net(surface) == surface).all())  # it begins with no change
    (torch.Size([1, 64, 64, 3]), True)
    """

    def __init__(
        self,
        task: str = "developable",
        *,
        widths: tuple[int, int, int] = (32, 64, 128),
        depths: tuple[int, int, int] = (1, 1, 4),
        passes: int = 3,
        confidence: bool = False,
    ):
        sound = len(widths) == len(depths) == 3 and all(4 <= w <= 512 for w in widths)
        if not sound or not all(0 <= d <= 32 for d in depths) or not 1 <= passes <= 8:
            raise OptionError(
                f"widths {widths}, depths {depths}, passes {passes}: take three widths from 4 to "
                "512, three depths up to 32, 1 to 8 passes"
            )
        settings = {"widths": list(widths), "depths": list(depths), "passes": passes}
        super().__init__(task, **settings, confidence=bool(confidence))
        if self.kind.noisy:
            raise OptionError("a coarse field cannot follow noise; take kind 'gsonet'")
        self.passes, self.unit = passes, self.kind.displacement
        dim = self.kind.components
        state = inputs.STRETCHING if self.kind.flat else inputs.BENDING
        w, d = widths, depths

        def blocks(width: int, depth: int) -> nn.Sequential:
            return nn.Sequential(*(Residual(width) for _ in range(depth)))

        seen = inputs.SHAPE + inputs.BENDING + state + dim
        self.stem = Convolution(seen, w[0], 4, stride=2, padding=1)
        self.fine_in = blocks(w[0], d[0])
        self.to_middle = Convolution(w[0], w[1], 2, stride=2)
        self.middle_in = blocks(w[1], d[1])
        self.to_body = Convolution(w[1], w[2], 2, stride=2)
        self.body = blocks(w[2], d[2])
        self.from_body = nn.Conv2d(w[2], w[1], 1)
        self.middle_out = blocks(w[1], d[1] + 1)
        self.from_middle = nn.Conv2d(w[1], w[0], 1)
        self.fine_out = blocks(w[0], d[0] + 1)
        self.coarse_head, self.fine_head = (Convolution(n, dim, 3, padding=1) for n in (w[1], w[0]))
        heads = [self.coarse_head, self.fine_head]
        if confidence:
            self.confidence_head = Convolution(w[1], 1, 3, padding=1)
            heads.append(self.confidence_head)
            self.EXPORTED_OUTPUTS = (*self.EXPORTED_OUTPUTS, "confidence")
        self.confident = bool(confidence)
        for head in heads:
            nn.init.zeros_(head.weight)
            nn.init.zeros_(head.bias)  # type: ignore[arg-type]

    def copy_weights_from(self, other: Net) -> None:
        new = {k: v for k, v in self.state_dict().items() if k.startswith("confidence_head")}
        self.load_state_dict(
            {**new, **other.state_dict()} if self.confident else other.state_dict()
        )

    def coefficients(
        self, surface: Tensor, frame: Frame, passes: int | None = None, *, unrolled: bool = False
    ) -> tuple[Tensor, ...]:
        """Compute the coefficients (B, d, n, m) of the fields after `passes` (by default all).

        They are those of the coarser and the finer field, and (B, 1, n, m) of the confidence, if
        the net has one: its logarithmic odds. Gradients flow through the last pass, or with
        `unrolled` through all.
        """
        passes = self.passes if passes is None else passes
        with torch.set_grad_enabled(unrolled and torch.is_grad_enabled()):
            seen, fields = self._seen(surface, frame, passes - 1)
        return _added(fields, self._fields(seen))

    @torch.no_grad()
    def confidence(self, surface: Tensor, *, passes: int | None = None) -> Tensor:
        """Return how far the net trusts its displacements (B, H, W): 0 to 1, at each vertex.

        It is 1 for nets without a confidence.
        """
        fields = self.coefficients(surface, Frame.of(planes(surface)), passes)
        if not self.confident:
            return surface.new_ones(surface.shape[:3])
        return torch.sigmoid(spline_field(fields[2], *surface.shape[1:3]))[:, 0]

    def _seen(self, surface: Tensor, frame: Frame, passes: int) -> tuple[Tensor, Fields]:
        """Return the net's input after some passes, and the sums of their coefficients."""
        p = planes(surface)
        bent = inputs.bending(p, frame)
        known = torch.stack([*inputs.shape(p, frame), *bent], dim=1)
        start = self.initial_geometry(surface)
        state = inputs.stretching(frame, planes(start)) if self.kind.flat else bent
        moved = known.new_zeros(known.shape[0], self.kind.components, *known.shape[2:])
        fields: Fields = (0.0, 0.0, _CONFIDENT)[: 2 + self.confident]
        for _ in range(passes):
            fields = found = _added(fields, self._fields(_joined(known, state, moved / self.unit)))
            moved = self._shares(found, *known.shape[2:])
            image = planes(start + self._vectors(moved, frame))
            if self.kind.flat:
                state = inputs.stretching(frame, image)
            else:
                state = inputs.bending(image, Frame.of(image))
        return _joined(known, state, moved / self.unit), fields

    EXPORTED_OUTPUTS: tuple[str, ...] = ("displacements", "coarse", "fine")

    def exported_outputs(
        self, surface: Tensor, sigma: Tensor | None = None, *, passes: int | None = None
    ) -> tuple[Tensor, ...]:
        frame = Frame.of(planes(surface))
        fields = self.coefficients(surface, frame, passes)
        moved = self._vectors(self._shares(fields, *surface.shape[1:3]), frame)
        return (moved, *(self.unit * field for field in fields[:2]), *fields[2:])

    def displacements(
        self,
        surface: Tensor,
        sigma: Tensor | None = None,
        *,
        passes: int | None = None,
        unrolled: bool = False,
    ) -> Tensor:
        frame = Frame.of(planes(surface))
        fields = self.coefficients(surface, frame, passes, unrolled=unrolled)
        return self._vectors(self._shares(fields, *surface.shape[1:3]), frame)

    def displacements_at(
        self,
        surface: Tensor,
        fine: Tensor,
        sigma: Tensor | None = None,
        *,
        passes: int | None = None,
    ) -> Tensor:
        own = Frame.of(planes(surface))
        fields = tuple(c.to(fine.dtype) for c in self.coefficients(surface, own, passes))
        shares = self._shares(fields, fine.shape[1], fine.shape[2])
        return self._vectors(shares, Frame.of(planes(fine)))

    def _fields(self, seen: Tensor) -> tuple[Tensor, ...]:
        x = seen.contiguous(memory_format=torch.channels_last)
        with self.autocast(x.device):
            fine = self.fine_in(self.stem(x))
            middle = self.middle_in(self.to_middle(fine))
            body = self.body(self.to_body(middle))
            middle = self.middle_out(middle + _enlarged(self.from_body(body), middle))
            fine = self.fine_out(fine + _enlarged(self.from_middle(middle), fine))
        # The heads run in single precision: curvature is sensitive to rounding here.
        middle, fine = middle.to(seen.dtype), fine.to(seen.dtype)
        found = self.coarse_head(middle), self.fine_head(fine)
        return (*found, self.confidence_head(middle)) if self.confident else found

    def _shares(self, fields: tuple[Tensor, ...], height: int, width: int) -> Tensor:
        """Evaluate the displacement (B, d, height, width) along the axes of the frames."""
        coarse, fine, *trust = (spline_field(field, height, width) for field in fields)
        moved = self.unit * (coarse + fine)
        return moved * torch.sigmoid(trust[0]) if trust else moved

    def _vectors(self, shares: Tensor, frame: Frame) -> Tensor:
        return shares.movedim(1, -1) if self.kind.flat else points(frame.vectors(*shares.unbind(1)))


def _added(fields: Fields, more: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
    return tuple(old + new for old, new in zip(fields, more, strict=True))


def _joined(known: Tensor, state: list[Tensor], moved: Tensor) -> Tensor:
    return torch.cat([known, torch.stack(state, dim=1), moved], dim=1)


def _enlarged(x: Tensor, target: Tensor) -> Tensor:
    return interpolate(x, size=target.shape[2:], mode="nearest")
