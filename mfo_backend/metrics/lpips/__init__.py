# SPDX-License-Identifier: Apache-2.0
"""LPIPS from the authors' heads and the user's copy of the networks they were fitted to."""
