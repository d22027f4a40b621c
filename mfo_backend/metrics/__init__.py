# SPDX-License-Identifier: Apache-2.0
"""Image differences and their gradients. Knows images only."""
