"""A verdict on noise in words."""

from __future__ import annotations

import numpy as np

from fluorspar.comparing.noise import NoiseVerdict

__all__ = ["noise_sentence", "share_text", "verdict_text"]

_VISIBLE = 0.05  # a relative difference of luminance of about one CIEDE2000


def share_text(noise: NoiseVerdict) -> str:
    """The share of the squared difference that noise explains, in words; never more than all of it."""
    if not np.isfinite(noise.share):
        return "no difference"
    if (noise.doubt and not noise.one_sided) or 1 <= noise.share_uncertainty < np.inf:
        return "not known"
    plus = f" ± {100 * min(noise.share_uncertainty, 1):.1f}" if np.isfinite(noise.share_uncertainty) else ""
    return f"{100 * min(noise.share, 1):.1f}{plus} %"


def verdict_text(noise: NoiseVerdict) -> str:
    """Whether the difference is more than noise, in words."""
    if noise.differs is None:
        return "no verdict"
    if noise.differs:
        return "more than noise"
    if not (np.isfinite(noise.share) and _VISIBLE < noise.detectable < np.inf):
        return "no more than noise"
    least = f"{100 * noise.detectable:.0f} % of a {_part(noise)}"
    return f"no more than noise, but too noisy to tell differences below {least}"


def noise_sentence(noise: NoiseVerdict, subject: str = "") -> str:
    """What the standard errors say in words, the verdict first; `subject` is put before the share."""
    parts = []
    if noise.doubt:
        parts.append(noise.doubt)
    elif np.isfinite(noise.share):
        parts.append(
            f"z of the mean {abs(noise.mean_z):.1f}, worst {_part(noise)} {noise.block_z:.1f}, "
            f"squares {max(0.0, noise.share_z):.1f}, bound {noise.block_bound:.1f}"
        )
    else:
        parts.append("there is no difference")
    if noise.unexplained:
        what = "pixels" if _part(noise) == "block" else "points"
        parts.append(f"{noise.unexplained} {what} differ where there is no noise")
    if np.isfinite(noise.share) and (noise.one_sided or not noise.doubt):
        alone = f", {noise.known_of} alone," if noise.one_sided else ""
        parts.append(f"{subject}share of the squared difference{alone} {share_text(noise)}")
    return f"{verdict_text(noise)} ({'; '.join(parts)})"


def _part(noise: NoiseVerdict) -> str:
    """What the deviations are of."""
    return "block" if noise.blocks < noise.observations else "point"
