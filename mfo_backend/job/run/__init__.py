# SPDX-License-Identifier: Apache-2.0
"""One job from its request to its result, and every way to stop it."""
