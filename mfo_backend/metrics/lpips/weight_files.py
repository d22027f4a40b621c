# SPDX-License-Identifier: Apache-2.0
"""Where the networks of LPIPS are looked for; PyTorch is not needed to look."""

from __future__ import annotations

import os
from pathlib import Path

FOLDER_VARIABLE = "MFO_LPIPS_WEIGHTS"
# as torchvision publishes them; the name carries the first digits of the SHA-256. The last one is a file of the
# user's own making that holds the convolutional part alone.
TRUNK_FILES = {
    "alex": ("alexnet-owt-7be5be79.pth", "alexnet-owt-4df8aa71.pth", "alexnet-features.pth"),
    "vgg": ("vgg16-397923af.pth", "vgg16-features.pth"),
    "squeeze": ("squeezenet1_1-b8a52dc0.pth", "squeezenet1_1-f364aa15.pth", "squeezenet1_1-features.pth"),
}


def weight_folders() -> list[Path]:
    """The user's folder, if one is named, and that of torch.hub (documentation of `torch.hub.get_dir`, torch 2.6)."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    cache = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    home = os.environ.get("TORCH_HOME") or os.path.join(cache, "torch")
    return [*([Path(chosen)] if chosen else []), Path(home).expanduser() / "hub" / "checkpoints"]


def find_weights(net: str) -> Path | None:
    """The file of network `net` (``alex``, ``vgg`` or ``squeeze``), or None."""
    files = (folder / name for folder in weight_folders() for name in TRUNK_FILES[net])
    return next((path for path in files if path.is_file()), None)
