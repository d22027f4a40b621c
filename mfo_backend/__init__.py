# SPDX-License-Identifier: Apache-2.0
"""Recover the Principled BSDF parameters that reproduce a reference picture.

The backend of the Material Fit extension: a process of its own that reads a job folder and writes results into it.
It never imports bpy. Layers, from the bottom: types, scene, material, render, metrics, solve, fit, report, job, cli;
an import may only point down (`tests/test_import_arrows.py`).
"""

__version__ = "0.15.0"
