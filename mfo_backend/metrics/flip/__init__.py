# SPDX-License-Identifier: Apache-2.0
"""FLIP and HDR-FLIP: features, filters, error maps and gradients."""
