# SPDX-License-Identifier: Apache-2.0
"""Light transport as Cycles does it: the path tracer, direct light, shading of smooth facets."""
