# SPDX-License-Identifier: Apache-2.0
"""Node graphs on the target: the truth by recorded paths against Cycles, and fits of the values without a link."""
