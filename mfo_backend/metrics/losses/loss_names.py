# SPDX-License-Identifier: Apache-2.0
"""The names of the losses: a kind, such as ``pu21``, and ``-ldr`` (display values) or ``-hdr`` (scene-linear)."""

from __future__ import annotations

from ...types.errors import BadInputError

OPTIONAL_KINDS = ("cvvdp", "lpips_alex", "lpips_vgg", "lpips_squeeze")
LDR_LOSSES = ("mse-ldr", "pu21-ldr", "itp-ldr", "flip-ldr")
HDR_LOSSES = ("mse-hdr", "log-hdr", "relative-hdr", "pu21-hdr", "itp-hdr", "flip-hdr")
LOSS_NAMES = LDR_LOSSES + HDR_LOSSES
OPTIONAL_LDR_LOSSES = tuple(f"{kind}-ldr" for kind in OPTIONAL_KINDS)
OPTIONAL_HDR_LOSSES = tuple(f"{kind}-hdr" for kind in OPTIONAL_KINDS)
# these need PyTorch, and packages or weights of the user
OPTIONAL_LOSS_NAMES = OPTIONAL_LDR_LOSSES + OPTIONAL_HDR_LOSSES
# sums of squares, which least squares can minimise
SQUARED_KINDS = ("mse", "log", "relative", "pu21", "itp")

_ALL = LOSS_NAMES + OPTIONAL_LOSS_NAMES
KINDS = tuple(dict.fromkeys(name[:-4] for name in _ALL))
# LPIPS has AlexNet where none is named, as in its package; LPIPS(PU) is that of scene-linear values
ALIASES = {"lpips": "lpips_alex", "lpips-ldr": "lpips_alex-ldr", "lpips-hdr": "lpips_alex-hdr"} | {
    f"lpips_pu{net}": f"lpips{net or '_alex'}-hdr" for net in ("", "_alex", "_vgg", "_squeeze")
}


def check_loss_name(name: str) -> str:
    """`name` with its alias resolved: a kind, or a kind with its range.

    Raises
    ------
    BadInputError
        If there is no such loss.
    """
    found = ALIASES.get(name, name)
    if found in KINDS or found in _ALL:
        return found
    if found.endswith("-ldr") and f"{found[:-4]}-hdr" in _ALL:
        raise BadInputError(
            f"There is no loss {name!r}, for {found[:-4]} is of scene-linear values: use {found[:-4]}-hdr."
        )
    raise BadInputError(
        f"Unknown loss {name!r}: choose one of {', '.join(KINDS)}, lpips or lpips_pu, "
        "with -ldr or -hdr behind it where it should not follow the reference."
    )


def loss_in_range(name: str, dynamic_range: str) -> str:
    """The full name of loss `name` where the fit's losses have the range ``ldr`` or ``hdr``.

    Raises
    ------
    BadInputError
        If there is no such loss.
    """
    found = check_loss_name(name)
    return check_loss_name(found if found in _ALL else f"{found}-{dynamic_range}")


def is_squared(name: str) -> bool:
    """Whether the loss is a sum of squares."""
    return check_loss_name(name).partition("-")[0] in SQUARED_KINDS
