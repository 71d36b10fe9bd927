"""The measurement conditions M0, M1 and M2 of ISO 13655, which print people put beside their numbers."""

from __future__ import annotations

from dataclasses import dataclass

from fluorspar.errors import OptionError, message

__all__ = ["CONDITIONS", "MeasurementCondition", "measurement_condition"]


@dataclass(frozen=True)
class MeasurementCondition:
    """With which light a sample is measured, and for which light its colour is then calculated.

    Parameters
    ----------
    name : str
        "M0", "M1" or "M2".
    source : str
        Name of the illuminant that shines on the sample.
    viewed_in : str
        Name of the illuminant of the tristimulus sums: the measured radiance factor is multiplied with it.
    uv_cut : float or None
        Wavelength in nm below which the source gives nothing; None for a source as it is.
    meaning : str
        In words.
    """

    name: str
    source: str
    viewed_in: str
    uv_cut: float | None
    meaning: str


CONDITIONS = {
    condition.name: condition
    for condition in (
        MeasurementCondition("M0", "A", "D50", None, "measured with illuminant A, little ultraviolet"),
        MeasurementCondition("M1", "D50", "D50", None, "measured with D50 and all its ultraviolet"),
        MeasurementCondition("M2", "D50", "D50", 400.0, "measured with D50 without what is below 400 nm"),
    )
}
"""By name. ISO 13655:2017 asks for D50 in the sums of all of them. For M0 it names illuminant A; for M2 any
source that gives hardly anything in the ultraviolet, here D50 with a sharp cut at 400 nm, so that M1 and M2
differ by the ultraviolet and by nothing else."""


def measurement_condition(name: str) -> MeasurementCondition:
    """Look up a condition, in upper or lower case.

    Raises
    ------
    OptionError
        If there is none of that name; M3 is M2 with polarisers, which a matte surface does not notice.

    Examples
    --------
    >>> measurement_condition("m2").uv_cut
    400.0
    """
    if condition := CONDITIONS.get(name.strip().upper()):
        return condition
    fix = "M3 is M2 with polarising filters: use M2" if name.strip().upper() == "M3" else ""
    fault = "there is no such measurement condition"
    raise OptionError(message(fault, got=repr(name), expected=", ".join(CONDITIONS), fix=fix))
