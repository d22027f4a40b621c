# SPDX-License-Identifier: Apache-2.0
"""Dr.Jit's arrays with derivatives, clamps and tables: what all models are written in."""
