"""Muon: steps of the same size in every direction of a weight matrix."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor, nn

#: The polynomial whose iterates take singular values close to one.
_QUINTIC = (3.4445, -4.7750, 2.0315)
_ITERATIONS = 5
#: Root mean square of AdamW's steps, over its rate: with it both take the same rates.
_RMS = 0.2
#: Layers with fewer channels than that on either side are left to AdamW, as the first and the last
#: of the published nets.
_LEAST = 8


class Muon(torch.optim.Optimizer):
    """Momentum whose steps are made orthogonal (Jordan et al. 2024, Liu et al. 2025).

    The kernels of a convolution count as a matrix with one row per output. Unlike
    ``torch.optim.Muon`` it takes them as they are, and computes in their own precision, which
    processors without bfloat16 need.

    Parameters
    ----------
    weights : iterable of Tensor
        Weights of two or more dimensions.
    lr : float
        Rate, on the scale of AdamW's.
    weight_decay, momentum : float
        Share of the weights, over the rate, that each step takes away; share of the old steps
        in each.

    Examples
    --------
    >>> layer = nn.Conv2d(8, 16, 3)
    >>> muon = Muon([layer.weight], lr=0.1)
    >>> layer(torch.ones(1, 8, 3, 3)).sum().backward()
    >>> muon.step()
    """

    def __init__(
        self,
        weights: Iterable[Tensor],
        lr: float = 1e-3,
        *,
        weight_decay: float = 1e-2,
        momentum: float = 0.95,
    ):
        super().__init__(weights, {"lr": lr, "weight_decay": weight_decay, "momentum": momentum})

    @torch.no_grad()
    def step(self, closure: Any = None) -> None:  # type: ignore[override]
        """Take a step along the gradients that the weights hold."""
        for group in self.param_groups:
            rate, keep = group["lr"], group["momentum"]
            weights = [weight for weight in group["params"] if weight.grad is not None]
            if not weights:
                continue
            for weight in weights:
                if not self.state[weight]:
                    self.state[weight]["momentum"] = torch.zeros_like(weight)
            gradients = [weight.grad for weight in weights]
            means = [self.state[weight]["momentum"] for weight in weights]
            torch._foreach_lerp_(means, gradients, 1.0 - keep)
            ahead = torch._foreach_lerp(gradients, means, keep)
            torch._foreach_mul_(weights, 1.0 - rate * group["weight_decay"])
            # On a GPU those of one shape go together: starting its kernels takes longest.
            alike: dict[object, list[int]] = {}
            for k, gradient in enumerate(ahead):
                alike.setdefault(gradient.shape if gradient.is_cuda else k, []).append(k)
            for members in alike.values():
                some = torch.stack([ahead[k].flatten(1) for k in members])
                along, size = orthogonal(some), _RMS * max(some.shape[1:]) ** 0.5
                steps = [a.view_as(weights[k]) for a, k in zip(along, members, strict=True)]
                torch._foreach_add_([weights[k] for k in members], steps, alpha=-rate * size)


def orthogonal(matrices: Tensor) -> Tensor:
    """The nearest matrices (B, n, m) with orthonormal rows (or columns, if fewer), roughly.

    >>> values = torch.linalg.svdvals(orthogonal(torch.randn(3, 20, 50)))
    >>> bool((values > 0.5).all() and (values < 1.5).all())
    True
    """
    a, b, c = _QUINTIC
    tall = matrices.shape[-2] > matrices.shape[-1]
    x = matrices.mT if tall else matrices
    x = x / x.norm(dim=(-2, -1), keepdim=True).clamp_min(1e-12)
    # Of the iterates p(x x') x only the small factors before x are computed.
    square = x @ x.mT
    before = torch.eye(x.shape[-2], dtype=x.dtype, device=x.device)
    one = a * before
    for _ in range(_ITERATIONS):
        step = torch.baddbmm(torch.add(one, square, alpha=b), square, square, alpha=c)
        before = step @ before
        square = step @ square @ step
    x = before @ x
    return x.mT if tall else x


def optimisers(net: nn.Module, kind: str, weight_decay: float) -> list[torch.optim.Optimizer]:
    """What trains a net: Muon its matrices and AdamW the rest, or AdamW everything."""
    matrices: list[Tensor] = []
    rest: list[Tensor] = []
    for weight in net.parameters():
        wide = weight.ndim > 1 and min(weight.shape[:2]) >= _LEAST
        (matrices if wide and kind == "muon" else rest).append(weight)
    kinds = ((Muon, matrices), (torch.optim.AdamW, rest))
    return [make(some, weight_decay=weight_decay) for make, some in kinds if some]
