# SPDX-License-Identifier: Apache-2.0
"""The options of commands that spread their work over processes or machines."""

from __future__ import annotations

import argparse


def add_cluster_options(parser: argparse.ArgumentParser) -> None:
    """Add `--workers` and `--scheduler`."""
    places = parser.add_mutually_exclusive_group()
    places.add_argument(
        "--workers", type=_count, default=0, metavar="N", help="N processes on this machine that share its cores"
    )
    places.add_argument("--scheduler", metavar="ADDRESS", help="a running Dask scheduler, such as tcp://10.0.0.5:8786")


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is not a whole number from 1 on")
    return value
