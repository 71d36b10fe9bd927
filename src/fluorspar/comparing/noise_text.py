"""A verdict on noise in words."""

from __future__ import annotations

import numpy as np

from fluorspar.comparing.noise import NoiseVerdict

__all__ = ["noise_sentence", "share_text", "verdict_text"]


def share_text(noise: NoiseVerdict) -> str:
    """The share of the squared difference that noise explains, in words; never more than all of it."""
    if not np.isfinite(noise.share):
        return "no difference"
    if noise.doubt and not noise.one_sided:
        return "not known"
    if not np.isfinite(noise.share_uncertainty):
        return "all" if noise.share > 1 else f"{100 * noise.share:.1f} %"
    if noise.share > 1 + noise.share_uncertainty:
        return "all"
    return f"{100 * noise.share:.1f} ± {100 * noise.share_uncertainty:.1f} %"


def verdict_text(noise: NoiseVerdict) -> str:
    """Whether the difference is more than noise, in words."""
    if noise.differs is None:
        return "no verdict"
    return "more than noise" if noise.differs else "no more than noise"


def noise_sentence(noise: NoiseVerdict, subject: str = "") -> str:
    """What the standard errors say, in words; `subject` is put before what noise explains."""
    of_pixels = noise.blocks < noise.observations
    without_noise = ""
    if noise.unexplained:
        what = "pixels" if of_pixels else "points"
        without_noise = f"; {noise.unexplained} {what} differ where there is no noise"
    explained = f"{subject}of {noise.known_of} explains {share_text(noise)} of the squared difference"
    if noise.doubt and noise.one_sided:
        return f"{noise.doubt}; {explained.replace(' explains', ' alone explains')}"
    if noise.doubt:
        return noise.doubt + without_noise
    if not np.isfinite(noise.share):
        return f"there is no difference{without_noise}"
    where = f"of {noise.blocks} blocks" if of_pixels else "of the points"
    return (
        f"{explained}; in standard errors, the squares deviate by {noise.share_z:.1f}, "
        f"the mean by {abs(noise.mean_z):.1f}, the greatest {where} by {noise.block_z:.1f} "
        f"(noise alone: below {noise.block_bound:.1f}){without_noise}, so the difference is {verdict_text(noise)}"
    )
