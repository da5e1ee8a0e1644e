"""Export of nets to ONNX files, which run without PyTorch."""

from __future__ import annotations

import copy
import hashlib
import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from gso.errors import BackendError, OptionError
from gso.io.atomic import check_writable, write_bytes
from gso.io.json_file import write_json
from gso.net.catalogue import EXPORTED, FORMAT, SIZE, card_of, parts
from gso.net.models.base import Net
from gso.net.weights import kind_of, load
from gso.typing import AnyPath, Json

#: Version of the ONNX operators in the files.
OPSET = 18


class _Exported(nn.Module):
    """The function of a net that is exported."""

    def __init__(self, net: Net, passes: int):
        super().__init__()
        self.net, self.passes = net, passes

    def forward(self, surface: Tensor, sigma: Tensor | None = None) -> tuple[Tensor, ...]:
        return self.net.exported_outputs(surface, sigma, passes=self.passes)


def export(model: AnyPath | Net, path: AnyPath, *, passes: int | None = None) -> list[Path]:
    """Write a net as an ONNX file, with a card that describes it.

    The file has the input ``surface`` (batch, 64, 64, 3), grids of the unit ball in single
    precision; nets that are told the noise also have ``sigma`` (batch,). The output
    ``displacements`` (batch, 64, 64, d) is to be added to the surface, or to its Flatten-init
    (:func:`gso.parametrization.rectangle`, centred at the origin). A :class:`gso.net.CoarseNet`
    also has ``coarse`` (batch, d, 16, 16) and ``fine`` (batch, d, 32, 32), the coefficients of
    its spline fields, and with a confidence ``confidence`` (batch, 1, 16, 16), the coefficients of
    its logarithmic odds. The size of the batch is free. The operators are those of opset 18.

    :func:`gso.net.predict` takes the file as its `model`.

    Parameters
    ----------
    model : str, path or Net
        Name of a net that comes with the package, a .safetensors file, or a net.
    path : path
        The .onnx file; the card is ``path.json`` (``net.onnx.json`` of ``net.onnx``). Of a name
        that stands for several nets, each has a file: ``net-cf-1.onnx``, ``net-cf-2.onnx`` of
        ``net-cf.onnx``, in the order of application.
    passes : int, optional
        Number of passes; all of the net's by default.

    Returns
    -------
    list of Path
        The .onnx files; several are the `model` of :func:`gso.net.predict` as a list.

    Raises
    ------
    BackendError
        onnx or onnxscript is not installed, or the net has an operation without an ONNX form.
    MeshError
        The file cannot be written.
    OptionError
        The file's name or the number of passes is wrong.
    WeightsError
        There is no such net, or its file is damaged.

    Examples
    --------
    >>> from gso.net import GSONet
    >>> export(GSONet(channels=8, blocks=1), "net.doc")
    Traceback (most recent call last):
    gso.errors.OptionError: net.doc: an exported net is a .onnx file
    """
    target = Path(path)
    if target.suffix != EXPORTED:
        raise OptionError(f"{target}: an exported net is a {EXPORTED} file")
    check_writable(target)
    names = [model] if isinstance(model, Net) else list(parts(model))
    nets = [name if isinstance(name, Net) else load(name, device="cpu") for name in names]
    several = len(nets) > 1
    done = []
    for number, net in enumerate(nets, start=1):
        most = net.passes if passes is None else passes
        if isinstance(most, bool) or not isinstance(most, int) or not 1 <= most <= net.passes:
            raise OptionError(
                f"passes is {passes!r}; take a whole number from 1 to {net.passes}, or None for all"
            )
        place = target.with_stem(f"{target.stem}-{number}") if several else target
        _write(net, place, most)
        done.append(place)
    return done


def _write(net: Net, path: Path, passes: int) -> None:
    inputs = ["surface", "sigma"] if getattr(net, "sigma", False) else ["surface"]
    outputs = list(net.EXPORTED_OUTPUTS)
    data = _graph(net, inputs, outputs, passes)
    card: Json = {
        "format": FORMAT,
        "task": net.task,
        "model": {"kind": kind_of(net), **net.settings},
        "parameters": sum(p.numel() for p in net.parameters()),
        "onnx": {
            "opset": OPSET,
            "inputs": inputs,
            "outputs": outputs,
            "size": SIZE,
            "passes": passes,
        },
        "sha256": hashlib.sha256(data).hexdigest(),
    }
    write_bytes(path, data)
    write_json(card_of(path), card)


def _graph(net: Net, inputs: list[str], outputs: list[str], passes: int) -> bytes:
    """Return the content of the ONNX file of a net."""
    if any(find_spec(name) is None for name in ("onnx", "onnxscript")):
        raise BackendError(
            'the export of nets needs onnx and onnxscript: pip install ".[onnx]" in the folder of '
            "gso"
        )
    own = copy.deepcopy(net).cpu().eval().requires_grad_(False)
    own.bf16 = False
    for part in own.modules():
        # An activation in place has no ONNX operator, and would be decomposed with all its shapes.
        if isinstance(part, nn.LeakyReLU):
            part.inplace = False
    module = _Exported(own, passes).eval()
    # Two surfaces: an example of one would fix the size of the batch.
    example = (torch.rand(2, SIZE, SIZE, 3), torch.full((2,), 0.01))[: len(inputs)]
    # Fills the cache of spline bases, which become constants of the graph.
    module(*example)
    batch = torch.export.Dim("batch")
    shapes = {name: {0: batch} for name in inputs}
    with warnings.catch_warnings(), _untraced():
        warnings.simplefilter("ignore")
        try:
            traced = torch.export.export(module, example, dynamic_shapes=shapes, strict=False)
            program: Any = torch.onnx.export(
                traced,
                (),
                input_names=inputs,
                output_names=outputs,
                dynamic_shapes=shapes,
                opset_version=OPSET,
                custom_translation_table=_operators(),
                dynamo=True,
                verbose=False,
                optimize=False,  # The runtime does that itself when it loads the file.
            )
        # The exporter's errors have no class in common but Exception.
        except Exception as error:
            raise BackendError(f"the net cannot be exported: {error}") from error
    content: bytes = program.model_proto.SerializeToString()
    return content


@contextmanager
def _untraced() -> Iterator[None]:
    """Keep PyTorch from recording the Python stack of every operation.

    That takes most of the time of an export, and writes the names of this machine's folders to the
    file.
    """
    config: Any = import_module("torch.fx.config")
    before = getattr(config, "do_not_emit_stack_traces", False)
    config.do_not_emit_stack_traces = True
    try:
        yield
    finally:
        config.do_not_emit_stack_traces = before


def _operators() -> dict[Any, Callable[..., Any]]:
    """Return ONNX forms of the functions of PyTorch that have none, or only a coarse one."""
    op: Any = import_module("onnxscript").opset18
    double, single = 11, 1  # ONNX's numbers of the types

    def hypot(x: Any, y: Any) -> Any:
        return op.Sqrt(op.Add(op.Mul(x, x), op.Mul(y, y)))

    def atan2(y: Any, x: Any) -> Any:
        # Curvature is a small difference of angles, so that the rounding of angles decides about
        # the nets' inputs. ONNX Runtime has the arc tangent in single precision only: a step of
        # Newton's method in double precision makes the angle exact.
        u, v = op.Cast(x, to=double), op.Cast(y, to=double)
        zero, one, two, pi, tiny = (
            op.CastLike(op.Constant(value_float=value), u)
            for value in (0.0, 1.0, 2.0, math.pi, 1e-30)
        )
        length = op.Max(hypot(u, v), tiny)
        ratio = op.Div(v, op.Add(length, op.Abs(u)))
        acute = op.Mul(two, op.Cast(op.Atan(op.Cast(ratio, to=single)), to=double))
        obtuse = op.Sub(op.Mul(op.Where(op.Less(v, zero), op.Neg(one), one), pi), acute)
        near = op.Where(op.Less(u, zero), obtuse, acute)
        miss = op.Sub(op.Mul(v, op.Cos(near)), op.Mul(u, op.Sin(near)))
        return op.CastLike(op.Add(near, op.Div(miss, length)), x)

    return {torch.ops.aten.hypot.default: hypot, torch.ops.aten.atan2.default: atan2}
