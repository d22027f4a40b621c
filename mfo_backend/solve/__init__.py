# SPDX-License-Identifier: Apache-2.0
"""Optimisers and stopping rules. Knows vectors, bounds and losses, no renderer."""
