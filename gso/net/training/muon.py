"""The Muon optimiser: orthogonalised momentum steps for weight matrices."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor, nn

#: Coefficients of the polynomial whose iterates map singular values close to one.
_QUINTIC = (3.4445, -4.7750, 2.0315)
_ITERATIONS = 5
#: Root mean square of AdamW's steps divided by its rate; it makes the rates comparable.
_RMS = 0.2
#: Layers with fewer channels on either side are trained by AdamW, such as the first and the
#: last of the published nets.
_LEAST = 8


class Muon(torch.optim.Optimizer):
    """Momentum optimiser with orthogonalised steps (Jordan et al. 2024, Liu et al. 2025).

    The kernels of a convolution are treated as a matrix with one row per output channel.
    Unlike ``torch.optim.Muon``, it accepts tensors of more than two dimensions, and computes
    in their own precision, as processors without bfloat16 need.

    Parameters
    ----------
    weights : iterable of Tensor
        Weights of two or more dimensions.
    lr : float
        Learning rate, comparable to AdamW's.
    weight_decay, momentum : float
        Decoupled weight decay: each step multiplies weights by 1 - lr * weight_decay. Decay of
        the moving average of gradients.

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
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Take a step with the gradients stored in the weights."""
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
            # On a GPU, weights of equal shape are batched, because launching kernels dominates.
            alike: dict[object, list[int]] = {}
            for k, gradient in enumerate(ahead):
                alike.setdefault(gradient.shape if gradient.is_cuda else k, []).append(k)
            for members in alike.values():
                some = torch.stack([ahead[k].flatten(1) for k in members])
                along, size = orthogonal(some), _RMS * max(some.shape[1:]) ** 0.5
                steps = [a.view_as(weights[k]) for a, k in zip(along, members, strict=True)]
                torch._foreach_add_([weights[k] for k in members], steps, alpha=-rate * size)


def orthogonal(matrices: Tensor) -> Tensor:
    """Approximate the nearest matrices (B, n, m) with orthonormal rows (or columns, if fewer).

    >>> values = torch.linalg.svdvals(orthogonal(torch.randn(3, 20, 50)))
    >>> bool((values > 0.5).all() and (values < 1.5).all())
    True
    """
    a, b, c = _QUINTIC
    tall = matrices.shape[-2] > matrices.shape[-1]
    x = matrices.mT if tall else matrices
    x = x / x.norm(dim=(-2, -1), keepdim=True).clamp_min(1e-12)
    # Of the iterates p(x x') x, only the small square factors on the left of x are computed.
    square = x @ x.mT
    before = torch.eye(x.shape[-2], dtype=x.dtype, device=x.device)
    one = a * before
    for _ in range(_ITERATIONS):
        step = torch.baddbmm(torch.add(one, square, alpha=b), square, square, alpha=c)
        before = step @ before
        square = step @ square @ step
    x = before @ x
    nearest: Tensor = x.mT if tall else x
    return nearest


def optimisers(net: nn.Module, kind: str, weight_decay: float) -> list[torch.optim.Optimizer]:
    """Make the optimisers of a net: Muon for matrices and AdamW for the rest, or only AdamW."""
    matrices: list[Tensor] = []
    rest: list[Tensor] = []
    for weight in net.parameters():
        wide = weight.ndim > 1 and min(weight.shape[:2]) >= _LEAST
        (matrices if wide and kind == "muon" else rest).append(weight)
    kinds = ((Muon, matrices), (torch.optim.AdamW, rest))
    return [make(some, weight_decay=weight_decay) for make, some in kinds if some]
