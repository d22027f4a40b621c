# SPDX-License-Identifier: Apache-2.0
"""The bench's scenarios that begin with a .blend file."""
