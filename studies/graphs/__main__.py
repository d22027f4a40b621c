# SPDX-License-Identifier: Apache-2.0
"""Fits of the values that node graphs leave unlinked, on scenes that Cycles renders and judges.

    python -m studies.graphs ROWS.jsonl --size 96 --seeds 1
    python -m studies.graphs ROWS.jsonl --size 96 --seeds 1 --series values
    python -m studies.graphs ROWS.jsonl --size 96 --seeds 1 --series mixes
    python -m studies.graphs ROWS.jsonl --size 96 --seeds 1 --series bumps

The first fits values of the shader's sockets, the second such inside the nodes, 4 to 9 numbers a graph (`values.py`),
the third those of several shaders of a mix and its factors (`mixes.py`),
the fourth colour, metallic and roughness below bumps and normal maps (`bumps.py`).
Truth and start are drawn at random. Each row has the FLIP over the target, in Cycles, of the start, of the result and
of another render of the truth (the floor), the largest error of each value, its deviation, and the seconds. Rows that
are in the file already are not made again. Needs the bpy module.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from .bumps import BUMPS
from .head import LIGHTS
from .materials import GRAPHS
from .measure import SERIES, row
from .mixes import MIXES
from .values import FITTED


def main() -> None:
    """Make the rows that are missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path, help="file to append to, one JSON object a line")
    parser.add_argument("--series", choices=SERIES, default=SERIES[0], help="what is fitted")
    parser.add_argument("--graphs", nargs="+", choices=[*GRAPHS, *MIXES, *BUMPS], default=None)
    parser.add_argument("--lights", nargs="+", choices=LIGHTS, default=list(LIGHTS))
    parser.add_argument("--seeds", type=int, default=1, help="scenes for each graph and light")
    parser.add_argument("--views", type=int, choices=(1, 2), default=1, help="cameras whose pictures are fitted")
    parser.add_argument("--size", type=int, default=96, help="pixels along each side")
    chosen = parser.parse_args()
    import blender_addon

    blender_addon.register()  # what was applied is kept in properties of the material
    lines = chosen.rows.read_text("utf-8").splitlines() if chosen.rows.is_file() else []
    keys = ("series", "graph", "light", "seed", "size", "views")
    known = {tuple({"series": SERIES[0], "views": 1, **json.loads(line)}[key] for key in keys) for line in lines}
    all_graphs = {"sockets": GRAPHS, "values": FITTED, "mixes": MIXES, "bumps": BUMPS}[chosen.series]
    graphs = chosen.graphs or list(all_graphs)
    for seed in range(chosen.seeds):
        for light in chosen.lights:
            for graph in graphs:
                if (chosen.series, graph, light, seed, chosen.size, chosen.views) in known:
                    continue
                made = row(graph, light, seed, chosen.size, chosen.series, chosen.views)
                with chosen.rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(made) + "\n")
                print(json.dumps(made), flush=True)


if __name__ == "__main__":
    main()
