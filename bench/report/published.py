"""The published figures: Wang et al. 2024, Tables 1 to 3.

The times of the nets were measured on an NVIDIA 3080. The processor of the optimiser's times is
not given; neither are fairness, strain and flipped cells.
"""

from __future__ import annotations

from gso.dataset import LEVELS, PUBLISHED, PUBLISHED_FLAT

#: Mean loss_gc of the input surfaces.
INPUT = PUBLISHED["loss_gc_before"]

#: Developable surfaces.
TABLE_1: dict[str, dict[str, float]] = {
    "TNO": {**{k: PUBLISHED[k] for k in ("loss_gc", "K_A_r", "d_H")}, "seconds": 38.256},
    "Net-S": {"loss_gc": 0.0273, "K_A_r": 0.8776, "d_H": 0.608, "seconds": 0.013},
    "Net-C": {"loss_gc": 0.0417, "K_A_r": 0.8300, "d_H": 0.414, "seconds": 0.013},
    "Net-CF": {"loss_gc": 0.0291, "K_A_r": 0.8768, "d_H": 0.517, "seconds": 0.026},
}

#: Flat images.
TABLE_2: dict[str, dict[str, float]] = {
    "Init": {"loss_iso_cell": 6.21e-3, "seconds": 0.002},
    "TNO": {**PUBLISHED_FLAT, "seconds": 4.235},
    "Net": {"loss_iso_cell": 2.94e-4, "seconds": 0.015},
    "Net-W": {"loss_iso_cell": 2.46e-4, "seconds": 0.015},
}

_NOISY, _THETA = (4.02, 21.36, 44.64, 61.59), (0.633, 1.502, 2.505, 3.544)
_RATE = (83.84, 92.85, 94.42, 94.30)
#: Denoised surfaces by the standard deviation of the noise: angles in degrees, rate in percent.
TABLE_3: dict[float, dict[str, float]] = {
    level: {"theta_noisy": noisy, "theta": theta, "rate": rate}
    for level, noisy, theta, rate in zip(LEVELS, _NOISY, _THETA, _RATE, strict=True)
}

#: The published row that each net of the package is compared with.
NETS: dict[str, dict[str, float]] = {
    **{name.lower(): row for name, row in TABLE_1.items() if name != "TNO"},
    **{"developable": TABLE_1["Net-CF"], "flatten": TABLE_2["Net"], "flatten-w": TABLE_2["Net-W"]},
}
#: Figure 5: blocks, channels and number of parameters of the net that the paper chose.
CHOSEN = {"blocks": 4, "channels": 16, "parameters": 2.82e6}
