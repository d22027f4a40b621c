# SPDX-License-Identifier: Apache-2.0
"""Random settings of random scenes: where our picture is not Cycles' and no note says so. See `study`."""
